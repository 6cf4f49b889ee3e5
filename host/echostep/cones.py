"""What the cones of many poses read, by the tiles in which they are.

In: poses and the tables of their tiles. Out: for each ranger the shortest ray that counts [Girard 2011, eq. 3]. Owns nothing.
Every loop goes over the poses of one tile, without a branch and over few arrays, so that the compiler makes vector instructions of it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from echostep.kernels import LEAN
from echostep.walls import WallIndex, tile_at

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Eight = tuple[float, float, float, float, float, float, float, float]

MOST_RAYS = 8  # of a fan
POSES = 256  # of a tile at a time: their columns stay in the nearest cache
COLUMNS = 10
FEWEST = 10  # in a tile: for less it takes longer than one by one
SAME_M = 1e-9  # a ray meets walls so close together at once


class Fan(NamedTuple):
    """Rays of a ranger: `cosine` and `sine` of each off the axis; `bound`: sine of the bound before it, `last` behind the last one."""

    cosine: Eight
    sine: Eight
    bound: Eight
    last: float


@njit(**LEAN)
def sort_by_tile(x: Floats, y: Floats, heading: Floats, index: WallIndex, which: Ints, begin: Ints, order: Ints) -> int:
    """Numbers of the poses (n,) into `order`, tile by tile in the order in which they were looked at: `begin` (looked + 2,), zeros before.

    Returns how many there are in tiles with FEWEST at least; the others come last.
    """
    odd = index.looked
    for i in range(len(x)):
        tile = tile_at(x[i], y[i], index)
        k = index.seen[tile] - 1 if tile >= 0 and math.isfinite(heading[i]) else odd
        which[i] = k if 0 <= k < odd else odd
        begin[which[i] + 1] += 1
    for i in range(len(x)):
        if begin[which[i] + 1] < FEWEST:
            which[i] = odd
    for k in range(odd):
        if begin[k + 1] < FEWEST:
            begin[odd + 1] += begin[k + 1]
            begin[k + 1] = 0
    for k in range(odd + 1):
        begin[k + 1] += begin[k]
    sorted_ = begin[odd]
    for i in range(len(x)):
        order[begin[which[i]]] = i
        begin[which[i]] += 1
    for k in range(odd, -1, -1):
        begin[k + 1] = begin[k]
    begin[0] = 0
    return sorted_


@njit(**LEAN)
def read_cones(
    x: Floats, y: Floats, heading: Floats, index: WallIndex, order: Ints, begin: Ints, fan: Fan, maximum_m: float,
    columns: Floats, ranges: Floats,
) -> None:  # fmt: skip
    """Fill `ranges` (n, 2) of the poses that were sorted into tiles; `columns` (COLUMNS, POSES) is scratch."""
    for k in range(index.looked):
        for first in range(begin[k], begin[k + 1], POSES):
            chosen = order[first : min(first + POSES, begin[k + 1])]
            m = len(chosen)
            px, py, ax, ay, left, right = (
                columns[0, :m], columns[1, :m], columns[2, :m], columns[3, :m], columns[4, :m], columns[5, :m]
            )  # fmt: skip
            for i in range(m):
                j = chosen[i]
                px[i], py[i], ax[i], ay[i] = x[j], y[j], -math.sin(heading[j]), math.cos(heading[j])
                left[i] = right[i] = maximum_m
            for face in range(index.faces.tile_start[k], index.faces.tile_start[k + 1]):
                _meet(face, index, fan, maximum_m, columns, m)
            for i in range(m):
                ranges[chosen[i], 0], ranges[chosen[i], 1] = left[i], right[i]


@njit(**LEAN)
def _meet(face: int, index: WallIndex, fan: Fan, maximum_m: float, columns: Floats, m: int) -> None:
    """The rays of m poses that meet one wall first."""
    px, py, ax, ay, left, right = (
        columns[0, :m], columns[1, :m], columns[2, :m], columns[3, :m], columns[4, :m], columns[5, :m]
    )  # fmt: skip
    s, h, c, e = columns[6, :m], columns[7, :m], columns[8, :m], columns[9, :m]
    faces, walls = index.faces, index.walls
    x, y, tx, ty = faces.rows[face, 0], faces.rows[face, 1], faces.rows[face, 2], faces.rows[face, 3]
    _place(px, py, x, y, tx, ty, s, h)
    _place(ax, ay, 0.0, 0.0, tx, ty, e, c)
    if not _end(c, e, h, s, faces.rows[face, 4], fan, maximum_m):
        return
    for j in range(faces.screen_start[face], faces.screen_start[face + 1]):
        w = faces.screens[j]
        _hide(c, px, py, s, x, y, tx, ty, walls[w, 0], walls[w, 1], walls[w, 2], walls[w, 3], maximum_m)
    _keep(c, e, left, right)


@njit(**LEAN)
def _place(px: Floats, py: Floats, x: float, y: float, tx: float, ty: float, along: Floats, aside: Floats) -> None:
    """Places (or directions, from 0, 0) along and to the left of a line from x, y with tangent t."""
    for i in range(len(px)):
        dx, dy = px[i] - x, py[i] - y
        along[i], aside[i] = dx * tx + dy * ty, dy * tx - dx * ty


@njit(**LEAN)
def _end(c: Floats, e: Floats, h: Floats, s: Floats, width_m: float, fan: Fan, maximum_m: float) -> int:
    """Where the ray nearest to the wall's normal ends, and how many count.

    In: the axis to the left of the wall's tangent and along it, the pose likewise. Out: `c` length of the ray (`maximum_m` where it does not
    count), `s` its end along the wall, `e` 1 for the left ranger and -1 for the right one.
    """
    cos0, cos1, cos2, cos3, cos4, cos5, cos6, cos7 = fan.cosine
    sin0, sin1, sin2, sin3, sin4, sin5, sin6, sin7 = fan.sine
    bound0, bound1, bound2, bound3, bound4, bound5, bound6, bound7 = fan.bound
    count = 0
    for i in range(len(c)):
        side = -1.0 if c[i] * h[i] > 0.0 else 1.0
        d, towards, aside = abs(h[i]), -side * c[i], -side * e[i] * h[i]
        u, v = cos0, sin0
        u, v = (cos1 if aside >= bound1 * d else u), (sin1 if aside >= bound1 * d else v)
        u, v = (cos2 if aside >= bound2 * d else u), (sin2 if aside >= bound2 * d else v)
        u, v = (cos3 if aside >= bound3 * d else u), (sin3 if aside >= bound3 * d else v)
        u, v = (cos4 if aside >= bound4 * d else u), (sin4 if aside >= bound4 * d else v)
        u, v = (cos5 if aside >= bound5 * d else u), (sin5 if aside >= bound5 * d else v)
        u, v = (cos6 if aside >= bound6 * d else u), (sin6 if aside >= bound6 * d else v)
        u, v = (cos7 if aside >= bound7 * d else u), (sin7 if aside >= bound7 * d else v)
        length = d / abs(u * towards - v * side * e[i])
        foot = s[i] + length * (u * side * e[i] + v * towards)
        counts = (aside >= bound0 * d) & (aside < fan.last * d) & (foot >= 0.0) & (foot <= width_m)
        counts &= (length < maximum_m) & (c[i] * h[i] != 0.0)
        c[i] = length if counts else maximum_m
        s[i], e[i] = foot, side
        count += 1 if counts else 0
    return count


@njit(**LEAN)
def _hide(
    length: Floats, px: Floats, py: Floats, s: Floats, x: float, y: float, tx: float, ty: float,
    ax: float, ay: float, bx: float, by: float, maximum_m: float,
) -> None:  # fmt: skip
    """Rays to a wall do not count if they meet the wall from a to b before it; touching counts (`walls.segments_cross`)."""
    vx, vy = bx - ax, by - ay
    for i in range(len(length)):
        share = 1.0 - SAME_M / length[i]
        ux, uy = share * (x + s[i] * tx - px[i]), share * (y + s[i] * ty - py[i])
        cx, cy = ax - px[i], ay - py[i]
        d1, d2 = ux * cy - uy * cx, ux * (cy + vy) - uy * (cx + vx)
        here = vy * cx - vx * cy
        met = (d1 * d2 <= 0.0) & (d1 != d2) & (here * (here + vx * uy - vy * ux) <= 0.0)
        length[i] = maximum_m if met else length[i]


@njit(**LEAN)
def _keep(length: Floats, side: Floats, left: Floats, right: Floats) -> None:
    """The shorter one, for the ranger that it belongs to."""
    for i in range(len(length)):
        left[i] = length[i] if (side[i] > 0.0) & (length[i] < left[i]) else left[i]
        right[i] = length[i] if (side[i] < 0.0) & (length[i] < right[i]) else right[i]
