# SPDX-License-Identifier: MIT
"""Stairs between the levels of a drawing, as connectors in a well with a way in on each level.

In: the path on the stairs, in the plan. Out: `Well`s; levels with their walls. Owns their width. Echoes on stairs are not drawn:
the well is the rectangle about the path.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely

from echostep.arrays import Floats
from echostep.plan import Connector, Door, Level
from echostep_app.mapping.graph.levels import WalkLevels
from echostep_app.plan.places.faces import CLEAR_M as BESIDE_DOOR_M

HALF_M = 0.6  # of a flight's width, assumed
DOOR_M = 1.0  # width of the way in
CLEAR_M = 0.15  # about the well, in which other walls end: nearer ones are taken for its own
# Before the well, where no other door leads: its rim runs along it, as the check of plans says
BEFORE_M = BESIDE_DOOR_M + 0.05
LEAST_M = 0.1  # a shorter piece is not a wall
SHARED = 0.3  # of the smaller well's area: two flights in one well


@dataclass(frozen=True, slots=True)
class Well:
    """Stairs in one rectangle `area` of the plan; `ways_in`: level and place (x, y) of each end of a flight."""

    area: shapely.Polygon
    ways_in: tuple[tuple[int, float, float], ...]

    @property
    def levels(self) -> tuple[int, ...]:
        """The levels that it joins."""
        return tuple(sorted({level for level, _, _ in self.ways_in}))


def wells_of(levels: WalkLevels, path: Floats) -> list[Well]:
    """The wells of a path (n, 2); flights above one another are in one well."""
    wells: list[Well] = []
    for first, last in levels.stairs:
        flight = shapely.LineString(path[first : last + 1])
        area = shapely.oriented_envelope(flight.buffer(HALF_M, cap_style="flat"))
        ends = tuple((int(levels.of[k]), float(path[k, 0]), float(path[k, 1])) for k in (first, last))
        well, apart = Well(area, ends), []
        for other in wells:
            shared = other.area.intersection(well.area).area
            if shared > SHARED * min(other.area.area, well.area.area):
                both = shapely.oriented_envelope(shapely.union(other.area, well.area))
                well = Well(both, other.ways_in + well.ways_in)
            else:
                apart.append(other)
        wells = [*apart, well]
    return wells


def connector(well: Well, number: int) -> Connector:
    """The stairs of a plan in this well."""
    return Connector("stairs", f"stairs {number}", well.levels, np.array(well.area.exterior.coords)[:-1].round(3))


def with_wells(level: Level, index: int, wells: list[Well]) -> Level:
    """The level with the walls of the wells that join it, each open where the path led in; drawn walls end before them."""
    for well in wells:
        if index not in well.levels:
            continue
        outside, doubtful = (_outside(walls, well) for walls in (level.walls, level.doubtful))
        lines = shapely.linestrings(np.array([door.line for door in level.doors]).reshape(-1, 2, 2))
        far = shapely.distance(lines, well.area) > BEFORE_M
        doors = [door for door, is_far in zip(level.doors, far.tolist(), strict=True) if is_far]
        rim, ways = _rim(well, index)
        doors += [Door((float(a), float(b), float(c), float(d)), "open") for a, b, c, d in ways]
        walls = np.concatenate([outside, np.array(rim).reshape(-1, 4)])
        level = replace(level, walls=walls.round(3), doubtful=doubtful.round(3), doors=tuple(doors))
    return level


def _outside(walls: Floats, well: Well) -> Floats:
    """The parts of walls (n, 4) outside a well."""
    lines = shapely.difference(shapely.linestrings(walls.reshape(-1, 2, 2)), well.area.buffer(CLEAR_M))
    parts = [part for part in shapely.get_parts(lines) if part.length > LEAST_M]
    return np.array([np.array(part.coords).ravel() for part in parts]).reshape(-1, 4)


def _rim(well: Well, index: int) -> tuple[list[Floats], list[Floats]]:
    """Walls about a well, and the ways in on this level: x0, y0, x1, y1 each."""
    corners = np.array(well.area.exterior.coords)
    sides = [(a, b) for a, b in zip(corners[:-1], corners[1:], strict=True)]
    gaps: list[list[tuple[float, float]]] = [[] for _ in sides]
    for level, x, y in well.ways_in:
        if level == index:
            away = [shapely.LineString(side).distance(shapely.Point(x, y)) for side in sides]
            k = int(np.argmin(away))
            (a, b), half = sides[k], 0.5 * DOOR_M
            length = float(np.hypot(*(b - a)))
            at = float((np.array([x, y]) - a) @ (b - a)) / length
            gaps[k].append((max(at - half, LEAST_M), min(at + half, length - LEAST_M)))
    walls, ways = [], []
    for (a, b), open_ in zip(sides, gaps, strict=True):
        along, length = (b - a) / np.hypot(*(b - a)), float(np.hypot(*(b - a)))
        begin = 0.0
        for low, high in _joined(open_):
            walls.append(np.concatenate([a + begin * along, a + low * along]).round(3))
            ways.append(np.concatenate([a + low * along, a + high * along]).round(3))
            begin = high
        walls.append(np.concatenate([a + begin * along, a + length * along]).round(3))
    return walls, ways


def _joined(intervals: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Intervals in order, merged where they are nearer than a wall's least length."""
    merged: list[tuple[float, float]] = []
    for low, high in sorted(intervals):
        if merged and low < merged[-1][1] + LEAST_M:
            merged[-1] = (merged[-1][0], max(merged[-1][1], high))
        else:
            merged.append((low, high))
    return merged
