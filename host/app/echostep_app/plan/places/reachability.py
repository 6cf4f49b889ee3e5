# SPDX-License-Identifier: MIT
"""Rooms, and large parts of a level, that no door, stairs or lift reaches.

In: a `Plan` and its faces. Out: `PlanFinding`s. Owns nothing.
The narrowest opening of a room is found by bisection: the walls are made thicker until the room is closed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from shapely.geometry import Point, Polygon
from shapely.geometry.base import BaseGeometry

from echostep.arrays import Floats
from echostep.plan import Level, Plan, Room
from echostep_app.plan.cropping import within
from echostep_app.plan.places.faces import OUTSIDE, Face, Faces, beside, connected_groups, door_faces, leader_of
from echostep_app.plan.places.findings import PlanFinding

PART, HOLLOW_M = 0.25, 1.3  # of a level's area, from which it is told; narrower spaces are insides of walls; assumed
MANY_CLOSED = 5  # from this many rooms without a door on a level, their cause is reported once; assumed


def unreachable_rooms(plan: Plan, faces: Sequence[Faces]) -> Iterator[PlanFinding]:
    """Enclosed rooms without a connection by doors, stairs or lifts to the start; without a start: to the group with most rooms.

    Many rooms of one level without any door give one finding on the cause.
    """
    leader = connected_groups(plan, faces)
    rooms, home = _groups_of_rooms(plan, faces, leader)
    yield from _parts(plan, faces, leader, {group for *_, group in rooms}, home)
    apart = [(i, room, f) for i, room, f, group in rooms if group != home]
    pairs = [door_faces(level.doors, of) for level, of in zip(plan.levels, faces, strict=True)]
    if len(pairs) > 1 and any(pairs) and not any(OUTSIDE in pair for level in pairs for pair in level):
        i = next(i for i, level in enumerate(pairs) if level)  # one level may be a part of a house
        words = "no door and no gap leads outside: the building has no exit"
        yield PlanFinding("no exit", i, beside(plan.levels[i].doors[0])[0], words)
    for i, level in enumerate(plan.levels):
        with_door = {f for pair in pairs[i] for f in pair}
        closed = [room for k, room, f in apart if k == i and f not in with_door]
        many = len(closed) >= MANY_CLOSED
        if many:
            yield PlanFinding("no door", i, closed[0].at_m, _without_doors(len(closed), closed[0].name, level))
        for k, room, f in apart:
            if k == i and (f in with_door or not many):
                text = f"room {room.name!r} cannot be reached by doors, stairs or lifts"
                yield PlanFinding("unreachable", i, room.at_m, text)


def _parts(
    plan: Plan, faces: Sequence[Faces], leader: dict[Face, Face], known: set[Face], home: Face | None
) -> Iterator[PlanFinding]:
    """Large parts of levels without a named room that are not connected to `home`, or without any room to the largest part."""
    sizes: list[Counter[Face]] = [Counter() for _ in faces]
    middles: dict[tuple[int, Face], Point] = {}
    joined = {i for connector in plan.connectors for i in connector.levels}
    for i, level in enumerate(faces):
        for k, area in enumerate(level.areas if i in joined or len(faces) == 1 else ()):
            if not area.buffer(-HOLLOW_M / 2).is_empty:
                group = leader_of(leader, (i, k))
                sizes[i][group] += area.area
                middles.setdefault((i, group), area.representative_point())
    if not known and plan.start is None:
        home = next((group for group, _ in sum(sizes, Counter[Face]()).most_common(1)), None)
    for i, groups in enumerate(sizes):
        for group, size in groups.items():
            if home is not None and group not in (home, *known) and size >= PART * groups.total():
                at = middles[i, group]
                text = f"{size:.0f} m2 around here cannot be reached by doors, gaps, stairs or lifts"
                yield PlanFinding("sealed", i, (at.x, at.y), text)


def _groups_of_rooms(
    plan: Plan, faces: Sequence[Faces], leader: dict[Face, Face]
) -> tuple[list[tuple[int, Room, int, Face]], Face | None]:
    """Level, room, face and group of connected faces of each enclosed room; and the group of the start, else the one with most rooms.

    The group is None when each of many rooms is alone.
    """
    rooms: list[tuple[int, Room, int, Face]] = []
    for i, level in enumerate(plan.levels):
        at = faces[i].indices_of(np.array([room.at_m for room in level.rooms]).reshape(-1, 2)).tolist()
        rooms += [(i, r, f, leader_of(leader, (i, f))) for r, f in zip(level.rooms, at, strict=True) if f != OUTSIDE]
    counts = Counter(group for *_, group in rooms)
    if plan.start is None:
        group, count = counts.most_common(1)[0] if counts else (None, 0)
        return rooms, None if count == 1 and len(rooms) >= MANY_CLOSED else group
    at = faces[plan.start.level].indices_of(np.array([[plan.start.x_m, plan.start.y_m]]))
    return rooms, leader_of(leader, (plan.start.level, int(at[0])))


def _without_doors(count: int, name: str, level: Level) -> str:
    """Text of the finding on rooms without a door."""
    why = "" if level.doors else "; the level has none at all"
    return f"{count} rooms have no door, as {name!r}{why}: plan import --doors 0.9 assumes them (IMDF), plan edit draws them"


REACH_M = 20.0  # half the side of the square that is searched
WIDTHS_M = (0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)


def narrowest_opening(segments: Floats, at_m: tuple[float, float]) -> tuple[float, float, float] | None:
    """x, y and an upper bound of the width of the narrowest opening, in metres; None when it is wider than 6 m or further than 20 m."""
    x, y = at_m
    window = shapely.box(x - REACH_M, y - REACH_M, x + REACH_M, y + REACH_M)
    walls = shapely.union_all(shapely.linestrings(within(segments, window.bounds).reshape(-1, 2, 2)))
    if walls.is_empty or walls.distance(Point(at_m)) < WIDTHS_M[0]:
        return None
    low, high, opening = 0, len(WIDTHS_M) - 1, None
    while low <= high:  # bisection for the smallest thickness that closes the room
        middle = (low + high) // 2
        free = _free(window, walls, at_m, WIDTHS_M[middle])
        if free is not None and free[0].intersects(window.boundary):
            low = middle + 1
        else:
            high = middle - 1
            opening = (free, WIDTHS_M[middle])
    if opening is None or opening[0] is None:
        return None
    across = shapely.shortest_line(*opening[0])  # from the room to the outside: through the opening that is closed
    return None if across.intersects(walls) else (float(across.centroid.x), float(across.centroid.y), opening[1])


def _free(
    window: Polygon, walls: BaseGeometry, at_m: tuple[float, float], width_m: float
) -> tuple[Polygon, BaseGeometry] | None:
    """Free space with walls `width_m` thick: the part around the point, and all parts at the window's edge; None when the point is covered."""
    thick = shapely.union_all(shapely.buffer(shapely.get_parts(walls), width_m / 2, quad_segs=4))
    parts = shapely.get_parts(window.difference(thick))
    inside = parts[shapely.intersects(parts, Point(at_m))]
    outside = shapely.union_all(parts[shapely.intersects(parts, window.boundary)])
    return (inside[0], outside) if len(inside) and not outside.is_empty else None
