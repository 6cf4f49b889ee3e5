# SPDX-License-Identifier: MIT
"""The lines of a level as architects draw them: walls, windows, doors, exits, stairs, lifts, ramps; each kind has a pattern of its own.

In: a `Plan`, a level. Out: segments (n, 4) in metres by kind, and names of stairs, lifts and ramps with their destinations. Owns the measures.
A plan says neither to which side a door opens nor where flights begin: no leaf's arc and no arrow along the steps is drawn.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import shapely

from echostep.arrays import Floats
from echostep.plan import Connector, ConnectorKind, Door, Level, Plan, sides
from echostep_app.plan.places.exits import OUT_M

# All assumed:
HALF_WINDOW_M = 0.12  # from the glass to each face of its wall
HALF_JAMB_M = 0.15  # of the tick across the wall at each side of a door
TREAD_M = 0.3  # between two steps, of a common staircase
MOST_TREADS = 16  # on one outline; a longer staircase has wider ones, so that they stay apart on a screen
HEAD_SHARE = 0.15  # of a ramp's length: its arrow heads
SIGN_M = 1.0  # from the pose outside an exit to its sign


def level_lines(plan: Plan, level: int) -> dict[str, Floats]:
    """The lines of a level by kind, always all kinds. "door": jambs, and leaves that are shut; "unknown": leaves that may be open or shut."""
    drawn = plan.levels[level]
    return {
        "wall": np.concatenate((drawn.walls, *(sides(corners) for corners in drawn.obstacles))),
        "window": _windows(drawn.windows),
        **_doors(drawn),
        "exit": exit_lines(plan, level),
        **{kind: _way_lines(plan, level, kind, pattern) for kind, pattern in PATTERNS.items()},
    }


def exit_lines(plan: Plan, level: int) -> Floats:
    """A line (n, 4) from each exit of a level to where its sign stands outside."""
    out = [(e.x_m, e.y_m, math.cos(e.heading_rad), math.sin(e.heading_rad)) for e in plan.exits if e.level == level]
    rows = [(x - OUT_M * c, y - OUT_M * s, x + SIGN_M * c, y + SIGN_M * s) for x, y, c, s in out]
    return np.array(rows).reshape(-1, 4)


def way_names(plan: Plan, level: int) -> list[tuple[str, tuple[float, float]]]:
    """Name or kind of each connector of a level, with arrows up and down where it leads there, and the place of this text."""
    height_m = plan.levels[level].height_m
    names = []
    for way in _ways(plan, level):
        others_m = [plan.levels[k].height_m for k in way.levels if k != level]
        arrows = "↑" * any(h > height_m for h in others_m) + "↓" * any(h < height_m for h in others_m)
        at = shapely.make_valid(shapely.Polygon(way.outline_m)).representative_point()
        names.append((f"{way.name or way.kind} {arrows}".strip(), (at.x, at.y)))
    return names


def _ways(plan: Plan, level: int) -> list[Connector]:
    return [connector for connector in plan.connectors if level in connector.levels]


def _across(segments: Floats) -> Floats:
    """Unit vectors (n, 2) across segments (n, 4)."""
    along = segments[:, 2:] - segments[:, :2]
    return np.stack((-along[:, 1], along[:, 0]), axis=1) / np.hypot(*along.T)[:, None]


def _windows(glass: Floats) -> Floats:
    """Each window (n, 4) as the glass between the two faces of its wall, closed at both ends."""
    aside = HALF_WINDOW_M * _across(glass)
    left, right = glass + np.tile(aside, 2), glass - np.tile(aside, 2)
    ends = [np.concatenate((left[:, k : k + 2], right[:, k : k + 2]), axis=1) for k in (0, 2)]
    return np.concatenate((glass, left, right, *ends))


def _doors(level: Level) -> dict[str, Floats]:
    """A tick at each jamb, and the leaf where it is shut or may be."""
    doors = _rows(level.doors)
    aside = HALF_JAMB_M * _across(doors)
    ticks = [np.concatenate((doors[:, k : k + 2] + aside, doors[:, k : k + 2] - aside), axis=1) for k in (0, 2)]
    shut = _rows([door for door in level.doors if door.state == "closed"])
    unknown = _rows([door for door in level.doors if door.state == "unknown"])
    return {"door": np.concatenate((*ticks, shut)), "unknown": unknown}


def _rows(doors: Sequence[Door]) -> Floats:
    return np.array([door.line for door in doors]).reshape(-1, 4)


def _way_lines(plan: Plan, level: int, kind: ConnectorKind, pattern: Callable[[Floats, Floats], Floats]) -> Floats:
    """Outlines of a level's connectors of one kind with their pattern, cut at the outline."""
    rows = [np.zeros((0, 4))]
    for way in _ways(plan, level):
        if way.kind == kind:
            polygon = shapely.make_valid(shapely.Polygon(way.outline_m))
            lines = shapely.linestrings(pattern(*_axes(polygon)).reshape(-1, 2, 2))
            parts = shapely.get_parts(shapely.intersection(lines, polygon))
            inside = parts[(shapely.get_type_id(parts) == 1) & (shapely.length(parts) > 0.0)]
            cut = [shapely.get_coordinates(part)[[0, -1]].reshape(1, 4) for part in inside]
            rows += [sides(way.outline_m), *cut]
    return np.concatenate(rows)


def _axes(polygon: shapely.Geometry) -> tuple[Floats, Floats]:
    """Four corners (4, 2) of the smallest rectangle around an outline, so that the first side is a long one, and the vector (2,) along it."""
    box = shapely.get_coordinates(shapely.oriented_envelope(polygon))
    if len(box) < 4:  # an outline without area
        box = box[[0, -1, -1, 0, 0]]
    corners = box[:4] if np.hypot(*(box[1] - box[0])) >= np.hypot(*(box[2] - box[1])) else box[1:5]
    return corners, corners[1] - corners[0]


def _treads(corners: Floats, along: Floats) -> Floats:
    """Steps across the long side."""
    length_m = float(np.hypot(*along))
    count = min(int(length_m / TREAD_M), MOST_TREADS)
    shares = np.linspace(0.0, 1.0, count + 1)[1:-1, None]
    return np.concatenate((corners[0] + shares * along, corners[3] + shares * along), axis=1)


def _double_arrow(corners: Floats, along: Floats) -> Floats:
    """A line along the middle with a head at both ends: which end is up is not in the plan."""
    across = corners[3] - corners[0]
    a, b = corners[0] + 0.5 * across, corners[1] + 0.5 * across
    heads = [
        (*tip, *(tip + sign * HEAD_SHARE * along + side * 0.25 * across))
        for tip, sign in ((a, 1.0), (b, -1.0))
        for side in (-1.0, 1.0)
    ]
    return np.array([(*a, *b), *heads])


PATTERNS: dict[ConnectorKind, Callable[[Floats, Floats], Floats]] = {
    "stairs": _treads,
    "lift": lambda corners, _: np.concatenate((corners[:2], corners[2:]), axis=1),  # both diagonals
    "ramp": _double_arrow,
}
