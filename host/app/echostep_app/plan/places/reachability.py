# SPDX-License-Identifier: MIT
"""Rooms that no door, stairs or lift reaches.

In: a `Plan` and its faces. Out: `PlanFinding`s. Owns nothing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np

from echostep.plan import Level, Plan, Room
from echostep_app.plan.places.faces import OUTSIDE, Face, Faces, connected_groups, door_faces, leader_of
from echostep_app.plan.places.findings import PlanFinding

MANY_CLOSED = 5  # from this many rooms without a door on a level, their cause is reported once; assumed


def unreachable_rooms(plan: Plan, faces: Sequence[Faces]) -> Iterator[PlanFinding]:
    """Enclosed rooms without a connection by doors, stairs or lifts to the start; without a start: to the group with most rooms.

    Many rooms of one level without any door give one finding on the cause.
    """
    rooms, home = _groups_of_rooms(plan, faces)
    apart = [(i, room, f) for i, room, f, group in rooms if group != home]
    for i, level in enumerate(plan.levels):
        with_door = {f for pair in door_faces(level.doors, faces[i]) for f in pair}
        closed = [room for k, room, f in apart if k == i and f not in with_door]
        many = len(closed) >= MANY_CLOSED
        if many:
            yield PlanFinding("no door", i, closed[0].at_m, _without_doors(len(closed), closed[0].name, level))
        for k, room, f in apart:
            if k == i and (f in with_door or not many):
                text = f"room {room.name!r} cannot be reached by doors, stairs or lifts"
                yield PlanFinding("unreachable", i, room.at_m, text)


def _groups_of_rooms(plan: Plan, faces: Sequence[Faces]) -> tuple[list[tuple[int, Room, int, Face]], Face | None]:
    """Level, room, face and group of connected faces of each enclosed room; and the group of the start, else the one with most rooms.

    The group is None when each of many rooms is alone.
    """
    leader = connected_groups(plan, faces)
    rooms: list[tuple[int, Room, int, Face]] = []
    for i, level in enumerate(plan.levels):
        at = faces[i].indices_of(np.array([room.at_m for room in level.rooms]).reshape(-1, 2)).tolist()
        rooms += [(i, r, f, leader_of(leader, (i, f))) for r, f in zip(level.rooms, at, strict=True) if f != OUTSIDE]
    if not rooms:
        return [], None
    counts = Counter(group for *_, group in rooms)
    if plan.start is None:
        group, count = counts.most_common(1)[0]
        return rooms, None if count == 1 and len(rooms) >= MANY_CLOSED else group
    at = faces[plan.start.level].indices_of(np.array([[plan.start.x_m, plan.start.y_m]]))
    return rooms, leader_of(leader, (plan.start.level, int(at[0])))


def _without_doors(count: int, name: str, level: Level) -> str:
    """Text of the finding on rooms without a door."""
    why = "" if level.doors else "; the level has none at all"
    return f"{count} rooms have no door, as {name!r}{why}: plan import --doors 0.9 assumes them (IMDF), plan edit draws them"
