# SPDX-License-Identifier: MIT
"""Slow twin of the router: the shortest walk from every cell of a finer grid to the nearest of some places, without lifts.

Moves go to the 32 cells of a ring, so that a straight line is at most 1.4 % too long. Stairs change the level in any cell of their outline.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from echostep.arrays import Floats
from echostep.plan import Plan, Pose
from echostep_app.plan.routing import BODY_M, CLIMB

CELL_M, MARGIN_M, NEAR_M = 0.1, 1.5, 0.17
MOVES = [(u, v) for u in range(-3, 4) for v in range(-3, 4) if math.gcd(u, v) == 1]


def shortest_walks(plan: Plan, places: Sequence[Pose]) -> tuple[Floats, Floats]:
    """The corner (x, y) of the grid, and the lengths of the walks (levels, columns, rows) in metres; NaN in walls, infinite without a way."""
    ends = np.concatenate([level.solid.reshape(-1, 2) for level in plan.levels])
    low, high = ends.min(0) - MARGIN_M, ends.max(0) + MARGIN_M
    x, y = (np.arange(low[axis], high[axis], CELL_M) + CELL_M / 2 for axis in (0, 1))
    points = shapely.points(*np.meshgrid(x, y, indexing="ij"))
    lines = [shapely.union_all(shapely.linestrings(level.solid.reshape(-1, 2, 2))) for level in plan.levels]
    walls, thin = (shapely.buffer(lines, by_m) for by_m in (BODY_M, NEAR_M))
    shapely.prepare([*walls, *thin])
    free = np.array([~shapely.contains(area, points) for area in walls])
    edge = [*range(3), *range(-3, 0)]  # over it nothing moves
    free[:, edge] = free[:, :, edge] = False
    index, edges = np.arange(free.size).reshape(free.shape), []
    for connector in plan.connectors:
        inside = shapely.contains(shapely.Polygon(connector.outline_m), points)
        for k in connector.levels:  # narrow stairs: close to their walls, but never over one in one move
            free[k] |= inside & ~shapely.contains(thin[k], points)
        for one, other in pairwise(connector.levels if connector.kind != "lift" else ()):
            rise_m = abs(plan.levels[one].height_m - plan.levels[other].height_m)
            edges.append((index[one][inside], index[other][inside], CLIMB * rise_m))
    for u, v in MOVES:
        there = np.roll(index, (-u, -v), (1, 2))
        both = free & np.roll(free, (-u, -v), (1, 2))
        edges.append((index[both], there[both], CELL_M * math.hypot(u, v)))
    rows, columns, lengths = (np.concatenate([np.broadcast_to(e[k], e[0].shape) for e in edges]) for k in range(3))
    graph = coo_array((lengths, (rows, columns)), (index.size, index.size)).tocsr()
    seeds = [index[p.level][tuple(((np.array([p.x_m, p.y_m]) - low) / CELL_M).astype(int))] for p in places]
    walked = dijkstra(graph, directed=False, indices=seeds, min_only=True).reshape(free.shape)
    return low, np.where(free, walked, np.nan)
