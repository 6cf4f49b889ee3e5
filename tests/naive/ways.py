# SPDX-License-Identifier: MIT
"""Slow twin of the router: the length of the shortest walk from each cell of a level to the nearest of some places, on its own finer grid.

Moves go to the 32 cells of a ring, so that a straight line is at most 1.4 % too long. Stairs change the level in any cell of their outline.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from echostep.arrays import Bools, Floats
from echostep.plan import Plan, Pose
from echostep_app.plan.routing import BODY_M, CLIMB

CELL_M = 0.1
MARGIN_M = 1.5
MOVES = [(u, v) for u in range(-3, 4) for v in range(-3, 4) if math.gcd(u, v) == 1]


class ShortestWalks:
    """`to_nearest_m` (levels, columns, rows): the shortest walk from the middle of each cell; infinite without one."""

    def __init__(self, plan: Plan, places: tuple[Pose, ...]) -> None:
        ends = np.concatenate([level.solid.reshape(-1, 2) for level in plan.levels])
        self.low = ends.min(0) - MARGIN_M
        shape = len(plan.levels), *np.ceil((ends.max(0) + MARGIN_M - self.low) / CELL_M).astype(int).tolist()
        index = np.arange(np.prod(shape)).reshape(shape)
        x, y = (self.low[axis] + (np.arange(shape[axis + 1]) + 0.5) * CELL_M for axis in (0, 1))
        points = shapely.points(*np.meshgrid(x, y, indexing="ij"))
        inside = [shapely.contains(shapely.Polygon(c.outline_m), points) for c in plan.connectors]
        self.free = np.array([_free(plan, k, points, inside) for k in range(len(plan.levels))])
        rows, columns, lengths = list[Floats](), list[Floats](), list[Floats]()
        for u, v in MOVES:
            here, there = _cut(index, u, v), _cut(index, -u, -v)
            both = _cut(self.free, u, v) & _cut(self.free, -u, -v)
            rows, columns = [*rows, here[both]], [*columns, there[both]]
            lengths.append(np.full(both.sum(), CELL_M * math.hypot(u, v)))
        for connector, cells in zip(plan.connectors, inside, strict=True):
            for one, other in zip(connector.levels[:-1], connector.levels[1:], strict=True):
                if connector.kind != "lift":
                    rise_m = abs(plan.levels[one].height_m - plan.levels[other].height_m)
                    rows, columns = [*rows, index[one][cells]], [*columns, index[other][cells]]
                    lengths.append(np.full(cells.sum(), CLIMB * rise_m))
        graph = coo_array((np.concatenate(lengths), (np.concatenate(rows), np.concatenate(columns))), (index.size,) * 2)
        seeds = [index[p.level][self.cell(p.x_m, p.y_m)] for p in places]
        self.to_nearest_m = dijkstra(graph.tocsr(), directed=False, indices=seeds, min_only=True).reshape(shape)

    def cell(self, x_m: float, y_m: float) -> tuple[int, int]:
        """The cell of a position."""
        column, row = ((np.array([x_m, y_m]) - self.low) / CELL_M).astype(int).tolist()
        return column, row


def _free(plan: Plan, k: int, points: Floats, inside: list[Bools]) -> Bools:
    """Which cells of a level are farther than half a body from every wall, or on stairs."""
    walls = shapely.union_all(shapely.linestrings(plan.levels[k].solid.reshape(-1, 2, 2))).buffer(BODY_M)
    shapely.prepare(walls)
    free = ~shapely.contains(walls, points)
    for corners in plan.levels[k].obstacles:
        free &= ~shapely.contains(shapely.Polygon(corners), points)
    for connector, cells in zip(plan.connectors, inside, strict=True):
        free |= cells & (k in connector.levels)
    return free


def _cut(cells: Any, u: int, v: int) -> Any:
    """The cells from which a move (u, v) stays on the grid."""
    return cells[:, max(-u, 0) : min(-u, 0) or None, max(-v, 0) : min(-v, 0) or None]
