# SPDX-License-Identifier: MIT
"""Readings of both rangers at many poses, tile by tile.

In: poses and the tables of their tiles. Out: for each ranger the shortest ray that counts [Girard 2011, eq. 3]. Owns nothing.
Every loop goes over the poses of one tile, without a branch and over few arrays, so that the compiler makes vector instructions of it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Int32s
from echostep.jit import allocating_part, inline_part, kernel, lean_part, part
from echostep.walls.echo_sources import Receiver, bearing, hidden
from echostep.walls.index import (
    BEARINGS,
    CONE_RAD,
    SourceTable,
    WallIndex,
    tile_at,
)
from echostep.walls.visibility import tile_sources

Eight = tuple[float, float, float, float, float, float, float, float]

MOST_RAYS = 8  # of a fan
POSES = 256  # processed at a time in a tile: their columns stay in the nearest cache
COLUMNS = 10  # of scratch, each (POSES,): x, y, axis x, axis y, reading left, reading right, and four for `_meet`
FEWEST = 10  # poses in a tile: fewer are faster one by one
SAME_M = 1e-9  # walls so close together are met by a ray at once


class Poses(NamedTuple):
    """n poses, each (n,): place (m) and heading (rad); the rangers look to the left and to the right of the heading."""

    x: Floats
    y: Floats
    heading: Floats


class Fan(NamedTuple):
    """Rays of a ranger: `cosine` and `sine` of each off the axis; `bound`: sine of the bound before it, `last` behind the last one."""

    cosine: Eight
    sine: Eight
    bound: Eight
    last: float


class Cone(NamedTuple):
    """The same rays for one pose at a time: `fan` (3, rays + 1) has cosine and sine of each off the axis, and the sine of the bound before it.

    `slant`: tangent of half the spacing of two rays. `maximum_m`: reading when no ray counts.
    """

    fan: Floats
    slant: float
    maximum_m: float


class WallLine(NamedTuple):
    """Start of a wall and its unit tangent."""

    x: float
    y: float
    tx: float
    ty: float


class WallEnds(NamedTuple):
    """Both ends of a wall."""

    ax: float
    ay: float
    bx: float
    by: float


@lean_part
def sort_by_tile(poses: Poses, index: WallIndex, which: Int32s, begin: Int32s, order: Int32s) -> int:
    """Numbers of the poses into `order` (n,), tile by tile in the order of the tables; where each begins into `begin` (tabulated + 2,), zeros before.

    Returns how many are in tiles with at least FEWEST poses; the others come last.
    """
    x, y, heading = poses
    odd = index.tabulated
    for i in range(len(x)):
        tile = tile_at(x[i], y[i], index)
        k = index.tile_number[tile] - 1 if tile >= 0 and math.isfinite(heading[i]) else odd
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


@lean_part
def read_cones(
    poses: Poses, index: WallIndex, order: Int32s, begin: Int32s, fan: Fan, maximum_m: float, columns: Floats, ranges: Floats
) -> None:  # fmt: skip
    """Fill `ranges` (n, 2) of the poses that were sorted into tiles; `columns` (COLUMNS, POSES) is scratch."""
    x, y, heading = poses
    for k in range(index.tabulated):
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


@lean_part
def _meet(face: int, index: WallIndex, fan: Fan, maximum_m: float, columns: Floats, m: int) -> None:
    """Shorten the readings of m poses by the rays that meet one wall first."""
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
        screen = WallEnds(walls[w, 0], walls[w, 1], walls[w, 2], walls[w, 3])
        _hide(c, px, py, s, WallLine(x, y, tx, ty), screen, maximum_m)
    _keep(c, e, left, right)


@lean_part
def _place(px: Floats, py: Floats, x: float, y: float, tx: float, ty: float, along: Floats, aside: Floats) -> None:
    """Places (or directions, from 0, 0) along and to the left of a line from x, y with tangent t."""
    for i in range(len(px)):
        dx, dy = px[i] - x, py[i] - y
        along[i], aside[i] = dx * tx + dy * ty, dy * tx - dx * ty


@lean_part
def _end(c: Floats, e: Floats, h: Floats, s: Floats, width_m: float, fan: Fan, maximum_m: float) -> int:
    """Where the ray nearest to the wall's normal ends; returns how many rays count.

    In the wall's axes, along its tangent and to the left of it:

              in                                      out
        e, c  left ranger's axis, along and left      e: 1 the left ranger looks at the wall, -1 the right one does
        s, h  pose, along and left                    s: end of the ray along the wall
                                                      c: length of the ray, `maximum_m` where it does not count

        sign of c * h    the left ranger looks    side
              < 0        towards the wall          1
              > 0        away from it             -1
              = 0        along it                 no ray counts
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


@lean_part
def _hide(
    length: Floats, px: Floats, py: Floats, s: Floats, line: WallLine, screen: WallEnds, maximum_m: float
) -> None:
    """Rays to places s along a line do not count if they meet another wall before it; touching counts (`index.segments_cross`)."""
    x, y, tx, ty = line
    ax, ay, bx, by = screen
    vx, vy = bx - ax, by - ay
    for i in range(len(length)):
        share = 1.0 - SAME_M / length[i]
        ux, uy = share * (x + s[i] * tx - px[i]), share * (y + s[i] * ty - py[i])
        cx, cy = ax - px[i], ay - py[i]
        d1, d2 = ux * cy - uy * cx, ux * (cy + vy) - uy * (cx + vx)
        here = vy * cx - vx * cy
        met = (d1 * d2 <= 0.0) & (d1 != d2) & (here * (here + vx * uy - vy * ux) <= 0.0)
        length[i] = maximum_m if met else length[i]


@lean_part
def _keep(length: Floats, side: Floats, left: Floats, right: Floats) -> None:
    """Keep the shorter reading, of the ranger that the ray belongs to."""
    for i in range(len(length)):
        left[i] = length[i] if (side[i] > 0.0) & (length[i] < left[i]) else left[i]
        right[i] = length[i] if (side[i] < 0.0) & (length[i] < right[i]) else right[i]


@kernel
def lambda_ray_ranges(
    x: Floats, y: Floats, heading_rad: Floats, index: WallIndex,
    rays: int = 7, aperture_rad: float = math.radians(55.0), maximum_m: float = 6.0,
) -> Floats:  # fmt: skip
    """Readings (n, 2) of the left and the right ranger at n poses [Girard 2011, eq. 3].

    Each ranger sends `rays` rays, `aperture_rad` / `rays` apart about its axis. A ray ends at the first wall it meets, and counts if it meets that
    within half the spacing from its normal. The reading is the shortest ray that counts, `maximum_m` (at most EAR_REACH_M) if there is none.
    No ray is cast: a wall can only answer on the ray that is nearest to its normal. Fast where `Walls` was made for half the spacing.
    """
    ranges = np.empty((len(x), 2))
    spacing = aperture_rad / rays
    angle = (np.arange(rays + 1) + 0.5 - 0.5 * rays) * spacing
    bound = np.sin(np.minimum(np.maximum(angle - 0.5 * spacing, -0.5 * math.pi), 0.5 * math.pi))
    cosine, sine = np.cos(angle), np.sin(angle)
    slant = math.tan(0.5 * spacing) * (1.0 + 1e-12)
    tables_hold = slant <= index.slant * (1.0 + 1e-11) and 0.5 * aperture_rad <= CONE_RAD
    order, others = np.arange(len(x)).astype(np.int32), 0
    poses = Poses(x, y, heading_rad)
    if tables_hold and rays <= MOST_RAYS:
        begin = np.zeros(index.tabulated + 2, np.int32)
        others = sort_by_tile(poses, index, np.empty(len(x), np.int32), begin, order)
        eight = Fan(_eight(cosine, rays, 0.0), _eight(sine, rays, 0.0), _eight(bound, rays, np.inf), bound[rays])
        columns = np.empty((COLUMNS, POSES))
        read_cones(poses, index, order, begin, eight, maximum_m, columns, ranges)
    cone = Cone(np.vstack((cosine, sine, bound)), slant, maximum_m)
    _cone_ranges(order[others:], poses, index, cone, tables_hold, ranges)
    return ranges


@part
def _eight(values: Floats, count: int, beyond: float) -> Eight:
    """The first ones of `values`, at most MOST_RAYS, and the rest of them `beyond`."""
    row = np.full(MOST_RAYS, beyond)
    row[:count] = values[:count]
    return row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7]


@lean_part
def _cone_ranges(chosen: Int32s, poses: Poses, index: WallIndex, cone: Cone, tables_hold: bool, ranges: Floats) -> None:
    """Fill `ranges` of the chosen poses, one by one; `tables_hold`: whether the index was made for at least this slant."""
    x, y, heading = poses
    for i in chosen:
        tile = tile_at(x[i], y[i], index)
        if tile < 0 or not math.isfinite(heading[i]):
            ranges[i, 0] = ranges[i, 1] = cone.maximum_m
            continue
        k = index.tile_number[tile] - 1
        ax, ay = -math.sin(heading[i]), math.cos(heading[i])
        to_left, to_right = Receiver(x[i], y[i], ax, ay), Receiver(x[i], y[i], -ax, -ay)
        if not (0 <= k < index.tabulated and tables_hold):
            ranges[i, 0] = _cone_range_without_tables(to_left, tile, index, cone)
            ranges[i, 1] = _cone_range_without_tables(to_right, tile, index, cone)
            continue
        left = bearing(heading[i] + 0.5 * math.pi)
        right = (left + BEARINGS // 2) % BEARINGS
        left, right = left + k * BEARINGS, right + k * BEARINGS
        ranges[i, 0] = _cone_range(to_left, index.walls, index.faces, left, cone)
        ranges[i, 1] = _cone_range(to_right, index.walls, index.faces, right, cone)


@allocating_part
def _cone_range_without_tables(receiver: Receiver, tile: int, index: WallIndex, cone: Cone) -> float:
    """`_cone_range` where the index has no tables for the tile or for this slant."""
    faces, _ = tile_sources(tile, index, cone.slant)
    shortest = cone.maximum_m
    for u in range(BEARINGS):
        shortest = min(shortest, _cone_range(receiver, index.walls, faces, u, cone))
    return shortest


@inline_part
def _cone_range(receiver: Receiver, walls: Floats, faces: SourceTable, u: int, cone: Cone) -> float:
    """The shortest ray that counts of a ranger, among the walls of unit u."""
    px, py, ax, ay = receiver
    fan, slant, shortest = cone
    rays = fan.shape[1] - 1
    for position in range(faces.start[u], faces.start[u + 1]):
        i = faces.order[position]
        dx, dy = px - faces.rows[i, 0], py - faces.rows[i, 1]
        tx, ty = faces.rows[i, 2], faces.rows[i, 3]
        h = dy * tx - dx * ty
        d, aside = abs(h), -(ax * tx + ay * ty) * h
        s, aslant = dx * tx + dy * ty, d * slant
        if not (d < shortest and -aslant <= s <= faces.rows[i, 4] + aslant and (ax * ty - ay * tx) * h > 0.0):
            continue
        if aside < fan[2, 0] * d or aside >= fan[2, rays] * d:
            continue
        k = 0  # the ray nearest to the wall's normal
        for j in range(1, rays):
            k += aside >= fan[2, j] * d
        rx, ry = ax * fan[0, k] - ay * fan[1, k], ay * fan[0, k] + ax * fan[1, k]
        length = d / abs(rx * ty - ry * tx)
        foot = s + length * (rx * tx + ry * ty)
        if not (length < shortest and 0.0 <= foot <= faces.rows[i, 4]):
            continue
        if not hidden(px, py, px + (length - SAME_M) * rx, py + (length - SAME_M) * ry, walls, faces, i):
            shortest = length
    return shortest
