# SPDX-License-Identifier: MIT
"""Checks of a plan: gaps, overlaps, loose doors, open rooms, unreachable rooms, stairs and lifts without access, other units.

In: a `Plan`. Out: `PlanFinding`s, numbered from 1, level by level. Owns the tolerances.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from echostep.arrays import Bools, Floats
from echostep.plan import Level, Plan
from echostep_app.plan.places.faces import JAMB_M, OUTSIDE, TOUCH_M, Faces, extend, faces_under, find_faces, is_walled
from echostep_app.plan.places.findings import Lines, PlanFinding
from echostep_app.plan.places.gaps import with_gaps
from echostep_app.plan.places.reachability import narrowest_opening, unreachable_rooms
from echostep_app.plan.places.standing import StandingGround

# Tolerances, assumed:
NEAR_M = 0.1  # a wall's end that is nearer than this to a wall was meant to touch it
OVERLAP_M = 0.02  # shorter overlaps are not reported
ELBOW_M2 = 1.0  # stairs with less free area beside them than this have no access
WIDEST_M, MOST_RISE_M = 20.0, 100.0  # of a door; from a level to the next one
MOST_LEAKS = 20  # searches for the opening of a room in one plan, because each takes a while
NOT_ENCLOSED = "is not enclosed by walls, doors and gaps"
PARALLEL = 0.02  # sine of the angle below which walls count as parallel


def check_plan(plan: Plan) -> list[PlanFinding]:
    """All findings of a plan, sorted by level and numbered from 1."""
    passable = replace(plan, levels=tuple(with_gaps(level) for level in plan.levels))
    faces = [find_faces(level) for level in passable.levels]
    findings = [finding for i, level in enumerate(plan.levels) for finding in _level(level, i, faces[i])]
    findings += [*unreachable_rooms(passable, faces), *_connectors(passable, faces), *_start(plan)]
    findings.sort(key=lambda finding: finding.level)
    not_enclosed = [k for k, finding in enumerate(findings) if finding.text.endswith(NOT_ENCLOSED)]
    for k in not_enclosed[:MOST_LEAKS]:
        findings[k] = _with_leak(findings[k], plan.levels[findings[k].level])
    return [replace(finding, number=number) for number, finding in enumerate(findings, 1)]


def _level(level: Level, i: int, faces: Faces) -> Iterator[PlanFinding]:
    solid = level.heard
    lines = shapely.linestrings(solid.reshape(-1, 2, 2))
    tree = shapely.STRtree(lines)
    yield from _gaps(solid, tree, i)
    yield from _overlaps(solid, tree, i)
    yield from _doors(level, tree, i)
    at = faces.indices_of(np.array([room.at_m for room in level.rooms]).reshape(-1, 2))
    for room in (room for room, face in zip(level.rooms, at, strict=True) if face == OUTSIDE):
        yield PlanFinding("open room", i, room.at_m, f"room {room.name!r} {NOT_ENCLOSED}")


def _gaps(solid: Floats, tree: shapely.STRtree, i: int) -> Iterator[PlanFinding]:
    """Ends of walls that touch no wall, but are within `NEAR_M` of one that is not parallel to theirs."""
    ends = solid.reshape(-1, 2)
    if not len(ends):
        return
    end, wall = tree.query(shapely.points(ends), predicate="dwithin", distance=NEAR_M)
    end, wall = end[end // 2 != wall], wall[end // 2 != wall]
    distance = shapely.distance(shapely.points(ends[end]), tree.geometries[wall])
    free = np.ones(len(ends), dtype=bool)
    free[end[distance <= TOUCH_M]] = False
    crossing = shapely.distance(tree.geometries[end // 2], tree.geometries[wall]) <= TOUCH_M
    open_ = free[end] & ~crossing & ~_beside(solid[end // 2], solid[wall])
    seen: set[frozenset[int]] = set()
    for k in np.flatnonzero(open_)[np.argsort(distance[open_], kind="stable")]:
        pair = frozenset((int(end[k] // 2), int(wall[k])))
        if pair not in seen and free[end[k]]:
            seen.add(pair)
            x, y = ends[end[k]]
            lines = _lines(solid, pair)
            yield PlanFinding("gap", i, (float(x), float(y)), f"walls almost meet: {distance[k]:.3f} m apart", lines)
            free[end[k]] = False


def _overlaps(solid: Floats, tree: shapely.STRtree, i: int) -> Iterator[PlanFinding]:
    """Pairs of walls on one line that overlap."""
    if not len(solid):
        return
    one, other = tree.query(tree.geometries, predicate="dwithin", distance=TOUCH_M / 2)
    one, other = one[one < other], other[one < other]
    for k in np.flatnonzero(_shared_m(solid[one], solid[other]) > OVERLAP_M):
        a, b = solid[one[k]], solid[other[k]]
        shared = float(_shared_m(a[None], b[None])[0])
        shorter = a if np.hypot(*(a[2:] - a[:2])) < np.hypot(*(b[2:] - b[:2])) else b
        x, y = (shorter[:2] + shorter[2:]) / 2
        lines = _lines(solid, (int(one[k]), int(other[k])))
        yield PlanFinding("overlap", i, (float(x), float(y)), f"walls overlap along {shared:.2f} m", lines)


def _doors(level: Level, tree: shapely.STRtree, i: int) -> Iterator[PlanFinding]:
    """Doors with an end that is not at a wall, and doors that a wall runs through."""
    for number, door in enumerate(level.doors):
        name = f"door {door.name or number}"
        at, lines = door.middle_m, (door.line,)
        off_m = max(_distance(tree, shapely.Point(end)) for end in (door.line[:2], door.line[2:]))
        if off_m > JAMB_M:
            words = "ends in no wall" if np.isinf(off_m) else f"ends {off_m:.2f} m from any wall"
            yield PlanFinding("door", i, at, f"{name} {words}", lines)
        if door.width_m > WIDEST_M:
            text = f"{name} is {door.width_m:.3g} m wide: is the plan in metres?"
            yield PlanFinding("door", i, at, text, lines)
        if is_walled(door, tree):
            text = f"a wall runs through {name} or along it: doors are gaps in the walls"
            yield PlanFinding("door", i, at, text, lines)


def _distance(tree: shapely.STRtree, point: shapely.Point) -> float:
    """Distance to the nearest wall; infinity when it is more than 1 m."""
    distances = tree.query_nearest(point, max_distance=1.0, return_distance=True, all_matches=False)[1]
    return float(distances[0]) if len(distances) else float("inf")


def _with_leak(finding: PlanFinding, level: Level) -> PlanFinding:
    """The finding "not enclosed", moved to the narrowest opening when one is found."""
    doors = np.array([door.line for door in level.doors]).reshape(-1, 4)
    gap = narrowest_opening(np.concatenate((level.solid, extend(doors, JAMB_M))), finding.position_m)
    if gap is None:
        return finding
    x, y, width = gap
    text = f"{finding.text}; the narrowest way out is {width:g} m wide or less"
    return replace(finding, position_m=(x, y), text=text, lines_m=((*finding.position_m, x, y),))


def _start(plan: Plan) -> Iterator[PlanFinding]:
    """A start that is impossible."""
    start = plan.start
    if start is None or start.level < 0:
        return
    if objection := StandingGround(plan).objection(start.x_m, start.y_m, start.level):
        advice = f"; {objection.advice}" if objection.advice else ""
        yield PlanFinding("start", start.level, (start.x_m, start.y_m), f"the start: {objection.reason}{advice}")


def _connectors(plan: Plan, faces: Sequence[Faces]) -> Iterator[PlanFinding]:
    """Stairs, lifts and ramps that are outside the building or without access; levels without any of them."""
    for connector in plan.connectors:
        area = shapely.Polygon(connector.outline_m)
        middle = area.representative_point() if area.is_valid else shapely.Point(connector.outline_m.mean(axis=0))
        at = (middle.x, middle.y)
        if not area.is_valid:
            text = f"{connector.kind} {connector.name!r}: its outline crosses itself"
            yield PlanFinding("way", connector.levels[0], at, text)
        for i in connector.levels:
            if faces[i].indices_of(np.array([at]))[0] == OUTSIDE:
                yield PlanFinding("way", i, at, f"{connector.kind} {connector.name!r} {NOT_ENCLOSED}")
            elif _sealed(shapely.make_valid(area), plan.levels[i], faces[i]):
                text = f"{connector.kind} {connector.name!r} has no door and no way out to this level"
                yield PlanFinding("way", i, at, text)
    joined = {i for connector in plan.connectors for i in connector.levels}
    if len(plan.levels) > 1:
        for i in sorted(set(range(len(plan.levels))) - joined):
            yield PlanFinding("way", i, _middle(plan.levels[i]), "no stairs, lift or ramp leads to this level")
    for i, (low, high) in enumerate(pairwise(plan.levels), start=1):
        if (rise_m := abs(high.height_m - low.height_m)) > MOST_RISE_M:
            text = f"levels {low.name} and {high.name} are {rise_m:.3g} m apart: are their heights in metres?"
            yield PlanFinding("way", i, _middle(high), text)


def _middle(level: Level) -> tuple[float, float]:
    """The mean of the ends of its walls."""
    x, y = level.solid.reshape(-1, 2).mean(axis=0) if len(level.solid) else (0.0, 0.0)
    return float(x), float(y)


def _sealed(area: BaseGeometry, level: Level, faces: Faces) -> bool:
    """Whether stairs or a lift fill an enclosed space that has no door and no other free area."""
    held = faces_under(area, faces)
    if OUTSIDE in held or held[1:]:
        return False
    room = faces.areas[held[0]]
    near = [door for door in level.doors if shapely.LineString((door.line[:2], door.line[2:])).distance(room) < JAMB_M]
    return not near and room.area - room.intersection(area).area < ELBOW_M2


def _beside(a: Floats, b: Floats) -> Bools:
    """Which pairs (n,) of walls are parallel but not on one line, as the two faces of a wall whose end is open."""
    u, v = a[:, 2:] - a[:, :2], b[:, 2:] - b[:, :2]
    lengths = np.hypot(*u.T) * np.hypot(*v.T)
    parallel = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) < PARALLEL * lengths
    w = b[:, :2] - a[:, :2]
    off = np.abs(u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0]) / np.hypot(*u.T)
    return np.asarray(parallel & (off > TOUCH_M))


def _shared_m(a: Floats, b: Floats) -> Floats:
    """Length of the overlap of pairs of walls (n, 4); 0 for pairs that are not on one line."""
    u = a[:, 2:] - a[:, :2]
    length = np.hypot(*u.T)
    u = u / length[:, None]
    w0, w1 = b[:, :2] - a[:, :2], b[:, 2:] - a[:, :2]
    off = np.maximum(np.abs(u[:, 0] * w0[:, 1] - u[:, 1] * w0[:, 0]), np.abs(u[:, 0] * w1[:, 1] - u[:, 1] * w1[:, 0]))
    s0, s1 = (u * w0).sum(axis=1), (u * w1).sum(axis=1)
    shared = np.minimum(np.maximum(s0, s1), length) - np.maximum(np.minimum(s0, s1), 0.0)
    flat = off < np.minimum(TOUCH_M / 2, PARALLEL * np.abs(s1 - s0))
    return np.where(flat, np.maximum(shared, 0.0), 0.0)


def _lines(solid: Floats, which: Sequence[int] | frozenset[int]) -> Lines:
    return tuple((float(x0), float(y0), float(x1), float(y1)) for x0, y0, x1, y1 in solid[sorted(which)])
