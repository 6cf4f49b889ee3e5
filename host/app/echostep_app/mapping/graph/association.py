# SPDX-License-Identifier: MIT
"""Which fragments are pieces of one straight wall.

In: fragments at their present places. Out: `FittedWalls`. Owns the gates. Each fragment, in order of the path, joins the wall that it continues,
or begins one. A wall that was last detected more than `KNOWN_M` of path ago counts as another one, unless a closure has tied both places together.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Floats, Ints
from echostep.jit import inline_part, kernel
from echostep_app.mapping.graph.fragments import Fragments
from echostep_app.mapping.graph.graph import FittedWalls
from echostep_app.mapping.graph.nodes import Nodes
from echostep_app.mapping.graph.spots import is_spot

APART_M = 0.15  # distance of a fragment's middle from its wall's line: three standard deviations of either
TURNED_RAD = math.radians(6.0)
GAP_M = 2.0  # along the wall, between the pieces of one: wider than a door
KNOWN_M = 15.0  # of path, over which odometry alone distinguishes a wall from another beside it
SMALL_M = 0.5  # a shorter fragment begins no wall: a corner or an edge seems to be one


def associate(
    nodes: Nodes, fragments: Fragments, centre_m: Floats, normal_rad: Floats, anchored: Bools, level: Ints
) -> FittedWalls:
    """The walls of all fragments, each at the mean of its pieces, also walls of one piece. `anchored` (f,): the place is known by a closure.

    `level` (f,): a wall lies on one level.
    """
    order = np.lexsort((-fragments.half_m, fragments.node))
    size_m, spot = fragments.half_m[order] * 2.0, is_spot(fragments.half_m[order])
    long = np.concatenate([order[size_m >= SMALL_M], order[spot]])
    short = order[(size_m < SMALL_M) & ~spot]
    way_m = nodes.way_m[fragments.node]
    placed = _Placed(centre_m, normal_rad, fragments.half_m, fragments.sd_rad, way_m, anchored)
    of, normals, rhos, count = np.full(len(order), -1, np.int64), [], [], 0
    for k in range(int(level.max(initial=-1)) + 1):
        longs = long[level[long] == k]
        found, normal, rho = _associate(np.concatenate([longs, short[level[short] == k]]), len(longs), placed)
        of = np.where(found < 0, of, found + count)
        normals.append(normal)
        rhos.append(rho)
        count += len(normal)
    return FittedWalls(np.concatenate([*normals, np.zeros(0)]), np.concatenate([*rhos, np.zeros(0)]), of)


class _Placed(NamedTuple):
    """Fragments (f,) in the map: middle (f, 2), normal, half length, its standard deviation, length of the path, whether a closure ties the place."""

    centre_m: Floats
    normal_rad: Floats
    half_m: Floats
    sd_rad: Floats
    way_m: Floats
    anchored: Bools


@kernel
def _associate(order: Ints, longs: int, p: _Placed) -> tuple[Ints, Floats, Floats]:
    """Wall of each fragment, and normal and rho of each wall; the first `longs` of `order` may begin one."""
    centre, normal, half, sd_rad, way, anchored = p
    n = len(order)
    of = np.full(len(half), -1, np.int64)
    w_normal, w_sum, w_rho = np.zeros(n), np.zeros(n), np.zeros(n)
    w_low, w_high, w_way = np.zeros(n), np.zeros(n), np.zeros(n)
    w_x, w_y = np.zeros(n), np.zeros(n)
    w_anchored = np.zeros(n, np.bool_)
    count = 0
    for k in range(n):
        f = order[k]
        best, best_off = -1, APART_M
        for w in range(count):
            if abs(way[f] - w_way[w]) > KNOWN_M and not (anchored[f] and w_anchored[w]):
                continue
            turned, off, along = _beside(centre[f], normal[f], w_x[w], w_y[w], w_normal[w])
            near = along - half[f] < w_high[w] + GAP_M and along + half[f] > w_low[w] - GAP_M
            if near and abs(turned) < TURNED_RAD + 2.0 * sd_rad[f] and abs(off) < best_off:
                best, best_off = w, abs(off)
        if best < 0:
            if k >= longs:
                continue
            best = count
            count += 1
            w_normal[best], w_x[best], w_y[best] = normal[f], centre[f, 0], centre[f, 1]
        # The line turns and moves towards the mean of its pieces; short ones only belong to it.
        turned, off, along = _beside(centre[f], normal[f], w_x[best], w_y[best], w_normal[best])
        if k < longs:
            weight = half[f] / sd_rad[f] ** 2
            w_sum[best] += weight
            share = weight / w_sum[best]
            w_low[best], w_high[best] = min(w_low[best], along - half[f]), max(w_high[best], along + half[f])
            w_x[best] += share * off * math.cos(w_normal[best])
            w_y[best] += share * off * math.sin(w_normal[best])
            w_normal[best] += share * turned
        w_way[best] = max(w_way[best], way[f])
        w_anchored[best] = w_anchored[best] or anchored[f]
        of[f] = best
    for w in range(count):
        w_rho[w] = math.cos(w_normal[w]) * w_x[w] + math.sin(w_normal[w]) * w_y[w]
    return of, w_normal[:count].copy(), w_rho[:count].copy()


@inline_part
def _beside(centre: Floats, normal: float, x: float, y: float, wall_normal: float) -> tuple[float, float, float]:
    """Turn of a fragment against a wall's normal, distance of its middle from the wall's line, and place along it from (x, y)."""
    turned = (normal - wall_normal + math.pi) % (2.0 * math.pi) - math.pi
    c, s = math.cos(wall_normal), math.sin(wall_normal)
    dx, dy = centre[0] - x, centre[1] - y
    return turned, c * dx + s * dy, -s * dx + c * dy
