# SPDX-License-Identifier: MIT
"""A plan as a walk that passed all of its walls on both sides: walks are placed on it and tied to it as to another walk.

In: a level of a plan. Out: `Mapped`, not to be drawn by itself. Owns the distance from which a wall is seen.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep.plan import Level
from echostep_app.mapping.graph.directions import RIGHT_RAD, Directions
from echostep_app.mapping.graph.fragments import SD_M, SD_RAD, Fragments
from echostep_app.mapping.graph.graph import FittedWalls, Graph
from echostep_app.mapping.graph.nodes import Nodes, Pings
from echostep_app.mapping.mapper import Mapped

PIECE_M = 2.0  # of wall, seen from its middle
BEFORE_M = 0.8  # distance from which it is seen: less than half of a corridor
LEAST_M = 0.3  # a shorter piece is not used
RIGID_M, RIGID_RAD = 0.001, 1e-4  # standard deviations of one piece against the next: the plan does not bend
STRAIGHT = 0.7  # share of the walls along two directions at right angles, from which the plan has these


def plan_as_walk(level: Level, sd_m: float) -> Mapped:
    """The walls of a level, whose places have this standard deviation, as fragments of a path in the frame of the plan."""
    pieces = _pieces(level.solid)
    along = pieces[:, 2:] - pieces[:, :2]
    length = np.hypot(*along.T)
    middle, normal = 0.5 * (pieces[:, :2] + pieces[:, 2:]), np.arctan2(along[:, 0], -along[:, 1])
    middle, half = np.repeat(middle, 2, axis=0), np.repeat(0.5 * length, 2)
    seen = np.repeat(normal, 2) + np.tile([0.0, math.pi], len(length))
    at = middle - BEFORE_M * np.column_stack([np.cos(seen), np.sin(seen)])
    pose = np.column_stack([at, np.zeros(len(at))])
    n, count = len(pose), max(len(pose) - 1, 0)
    nodes = Nodes(np.zeros(n), pose, np.full(count, RIGID_M), np.full(count, RIGID_RAD), np.zeros(n), ())
    sd = math.hypot(SD_M, sd_m)
    fragments = Fragments(
        np.arange(n), middle - at, seen, half, np.full(n, sd), np.full(n, SD_RAD), np.full(n, 10), np.zeros(0, np.int64)
    )
    none = FittedWalls(np.zeros(0), np.zeros(0), np.full(n, -1))
    graph = Graph(nodes, fragments, pose.copy(), none, base_rad=_base(normal, length))
    nothing, integers = np.zeros(0), np.zeros(0, np.int64)
    pings = Pings(np.zeros((0, 2)), nothing, nothing, integers, nothing, integers, nothing)
    directions = Directions(graph.base_rad or 0.0, np.zeros(n), 0.0)
    return Mapped(graph, pings, (), directions, ())


def _pieces(walls: Floats) -> Floats:
    """Walls (n, 4) in pieces of PIECE_M at most, without the shortest ones."""
    rows = [np.zeros((0, 4))]
    for x0, y0, x1, y1 in walls.tolist():
        length = math.hypot(x1 - x0, y1 - y0)
        if length < LEAST_M:
            continue
        share = np.linspace(0.0, 1.0, math.ceil(length / PIECE_M) + 1)
        ends = np.column_stack([x0 + share * (x1 - x0), y0 + share * (y1 - y0)])
        rows.append(np.column_stack([ends[:-1], ends[1:]]))
    return np.concatenate(rows)


def _base(normal_rad: Floats, length_m: Floats) -> float | None:
    """The direction of most walls, by length, modulo a right angle; None if they have none."""
    if not len(normal_rad):
        return None
    tried = np.arange(0.0, RIGHT_RAD, math.radians(0.5))
    off = (normal_rad[:, None] - tried + 0.5 * RIGHT_RAD) % RIGHT_RAD - 0.5 * RIGHT_RAD
    share = (length_m[:, None] * (np.abs(off) < math.radians(1.0))).sum(0) / length_m.sum()
    best = int(np.argmax(share))
    if share[best] < STRAIGHT:
        return None
    near = np.abs(off[:, best]) < math.radians(1.0)
    return float(tried[best] + np.average(off[near, best], weights=length_m[near]))
