# SPDX-License-Identifier: MIT
"""Points of a tile: the places where walls end or meet, corners and edges, that can be detected from it.

In: a tile's corners and the walls near it. Out: a `SourceTable` of points with their screens. Owns nothing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Int32s
from echostep.jit import inline_part, lean_part, part
from echostep.walls.index import EAR_REACH_M, JOIN_M, POINT, TILE_M, SourceTable, WallIndex
from echostep.walls.tile_geometry import SLACK_M, by_bearing, covered, frame

WALL, EDGE, CORNER = 0.0, 1.0, 2.0  # kinds of echo sources
FLAT_RAD = math.radians(3.0)  # two walls that turn by less continue each other: drawing accuracy
# Greatest deviation from a right angle at which two reflections still send sound back, assumed.
CORNER_RAD = math.radians(30.0)


class Wedge(NamedTuple):
    """A tile as seen from a point: unit vector e towards its middle, and the least and greatest tangent (aside / ahead) of its corners."""

    ex: float
    ey: float
    low: float
    high: float


@part
def tile_points(corners: Floats, near: Int32s, index: WallIndex) -> SourceTable:
    """Ends of the walls of `near` within EAR_REACH_M of a tile: a row for each sector in which an end is a corner or an edge, with its screens.

    While they are collected, rows have two more columns: bearing from the tile, its spread. All sectors of one end have the
    same screens, which are copied.
    """
    points, starts = np.empty((8, POINT + 2)), np.zeros(9, np.int32)
    screens, used, count = np.empty(256, np.int32), 0, 0
    sectors, rays = np.empty((64, 5)), np.empty((64, 2))
    walls = index.walls
    for w in near:
        for end in range(2):
            x, y = walls[w, 2 * end], walls[w, 2 * end + 1]
            dx = max(corners[0, 0] - x, x - corners[2, 0], 0.0)
            dy = max(corners[0, 1] - y, y - corners[2, 1], 0.0)
            if dx * dx + dy * dy > EAR_REACH_M * EAR_REACH_M:
                continue
            kinds = _sectors(x, y, 2 * w + end, index, corners, sectors, rays)
            if kinds == 0:
                continue
            if len(screens) < used + len(near):
                screens = np.concatenate((screens, screens, near))
            more, centre, spread = _point_screens(x, y, corners, near, walls, screens[used:])
            if more < 0:
                continue
            for k in range(kinds):
                if count == len(points):
                    points, starts = np.concatenate((points, points)), np.concatenate((starts, starts))
                if len(screens) < used + more:
                    screens = np.concatenate((screens, screens))
                points[count, 0], points[count, 1] = x, y
                for j in range(POINT - 3):
                    points[count, 2 + j] = sectors[k, j]
                points[count, POINT], points[count, POINT + 1] = centre, spread
                points[count, POINT - 1] = dx * dx + dy * dy
                if k > 0:
                    for j in range(used, used + more):
                        screens[j] = screens[j - more]
                used += more
                count += 1
                starts[count] = used
    bearings, order = by_bearing(points[:count], POINT - 1)
    rows, total = points[:count, :POINT].copy(), np.array([0, count], np.int32)
    return SourceTable(total, bearings, order, rows, starts[: count + 1].copy(), screens[:used].copy())


@part
def _sectors(x: float, y: float, end: int, index: WallIndex, corners: Floats, sectors: Floats, rays: Floats) -> int:
    """Sectors about the wall end x, y, and its kind in each, into `sectors`; their number, 0 if a joined end is the source instead."""
    walls, count = index.walls, 0
    column, row = int((x - index.x0_m) / TILE_M), int((y - index.y0_m) / TILE_M)
    tile = row * index.columns + column
    for k in range(index.start[tile], index.start[tile + 1]):
        u = index.ids[k]
        ux, uy, tx, ty, length = frame(walls, u)
        s, h = (x - ux) * tx + (y - uy) * ty, (y - uy) * tx - (x - ux) * ty
        if abs(h) > JOIN_M or s < -JOIN_M or s > length + JOIN_M or count + 2 > len(rays):
            continue
        at_start, at_end = math.hypot(s, h) <= JOIN_M, math.hypot(s - length, h) <= JOIN_M
        if (at_start and _goes_before(walls, u, 0, x, y, end)) or (at_end and _goes_before(walls, u, 1, x, y, end)):
            return 0
        if not at_end or at_start:
            rays[count, 0], rays[count, 1] = tx, ty
            count += 1
        if not at_start:
            rays[count, 0], rays[count, 1] = -tx, -ty
            count += 1
    return _kinds(x, y, rays[:count], corners, sectors)


@inline_part
def _goes_before(walls: Floats, u: int, its_end: int, x: float, y: float, end: int) -> bool:
    """Whether an end of wall u is the source instead of the joined end at x, y: of joined ends the least in x, y, number is."""
    ux, uy = walls[u, 2 * its_end], walls[u, 2 * its_end + 1]
    if ux != x:
        return ux < x
    if uy != y:
        return uy < y
    return 2 * u + its_end < end


@part
def _kinds(x: float, y: float, rays: Floats, corners: Floats, sectors: Floats) -> int:
    """The sectors between the walls that leave x, y, into `sectors`: kind for a ranger in the sector, unit vectors of its sides.

             | ray b                    width of the sector from a to b, counter-clockwise
     CORNER  |                          about 90 deg: CORNER
    ---------o x, y                     about 180 deg: no source, the walls continue each other
      ray a    EDGE (270 deg)           else: EDGE; also all round (a = b = 0) where one wall ends
    """
    angles, order, count = np.empty(len(rays)), np.empty(len(rays), np.int32), 0
    for k in range(len(rays)):
        angles[k] = math.atan2(rays[k, 1], rays[k, 0])
        slot = k
        while slot > 0 and angles[order[slot - 1]] > angles[k]:
            order[slot] = order[slot - 1]
            slot -= 1
        order[slot] = k
    for i in range(len(order)):
        a, b = order[i], order[(i + 1) % len(order)]
        width = angles[b] - angles[a]
        if i == len(order) - 1:
            width += 2.0 * math.pi
        if abs(width - math.pi) < FLAT_RAD or width < FLAT_RAD or count == len(sectors):
            continue
        if width < math.pi and not _sector_meets(x, y, rays[a], rays[b], corners):
            continue
        sectors[count, 0] = CORNER if abs(width - 0.5 * math.pi) <= CORNER_RAD else EDGE
        for j in range(2):
            sectors[count, 1 + j] = rays[a, j] if len(order) > 1 else 0.0
            sectors[count, 3 + j] = rays[b, j] if len(order) > 1 else 0.0
        count += 1
    return count


@inline_part
def in_sector(dx: float, dy: float, ax: float, ay: float, bx: float, by: float) -> bool:
    """Whether direction d lies in the sector from a counter-clockwise to b; a = b = 0 is all round."""
    after_a, before_b = ax * dy - ay * dx >= 0.0, dx * by - dy * bx >= 0.0
    return (after_a and before_b) if ax * by - ay * bx > 0.0 else (after_a or before_b)


@lean_part
def _sector_meets(x: float, y: float, a: Floats, b: Floats, corners: Floats) -> bool:
    """Whether a tile may reach into the sector narrower than a half turn from a to b about x, y."""
    left_of_a, right_of_b = False, False
    for k in range(4):
        dx, dy = corners[k, 0] - x, corners[k, 1] - y
        left_of_a |= a[0] * dy - a[1] * dx >= 0.0
        right_of_b |= dx * b[1] - dy * b[0] >= 0.0
    return left_of_a and right_of_b


@part
def _point_screens(
    x: float, y: float, corners: Floats, near: Int32s, walls: Floats, screens: Int32s
) -> tuple[int, float, float]:
    """Walls that may stand between x, y and a place in the tile, into `screens`: their number, -1 if they hide it from everywhere.

    And the bearing of x, y from the tile, with the greatest deviation from it. A tile that is all ahead of x, y is seen in a narrow wedge:

                  aside ^       . high
                        |   +------+
              x, y  o --|---| tile |----> ahead (unit vector e)
                        |   +------+
                        |       . low       low, high: aside / ahead
    """
    mx, my = 0.5 * (corners[0, 0] + corners[2, 0]) - x, 0.5 * (corners[0, 1] + corners[2, 1]) - y
    wedge, narrow = _wedge_of_tile(x, y, mx, my, corners)
    x0, x1 = min(x, corners[0, 0]), max(x, corners[2, 0])
    y0, y1 = min(y, corners[0, 1]), max(y, corners[2, 1])
    spans, covering, count = np.empty((len(near), 4)), 0, 0
    for u in near:
        ax, ay, bx, by = walls[u, 0], walls[u, 1], walls[u, 2], walls[u, 3]
        if max(ax, bx) < x0 or min(ax, bx) > x1 or max(ay, by) < y0 or min(ay, by) > y1:
            continue
        if (ax == x and ay == y) or (bx == x and by == y):
            continue  # both lines meet there, so nowhere else
        if narrow:
            a, b, before = _clip_to_wedge(ax - x, ay - y, bx - x, by - y, wedge, corners, x, y)
            if a > b:
                continue
            if before:
                spans[covering, 0], spans[covering, 1], spans[covering, 2], spans[covering, 3] = a, b, 0.0, 0.0
                covering += 1
        screens[count] = u
        count += 1
    if narrow and covered(spans[:covering], wedge.low, wedge.high, 0.0):
        return -1, 0.0, 0.0
    return count, math.atan2(-my, -mx), math.atan(max(wedge.high, -wedge.low)) if narrow else math.pi


@lean_part
def _wedge_of_tile(x: float, y: float, mx: float, my: float, corners: Floats) -> tuple[Wedge, bool]:
    """The wedge in which a tile, its middle at (mx, my) from x, y, is seen from there; and whether it is all ahead and x, y outside."""
    inside = corners[0, 0] <= x <= corners[2, 0] and corners[0, 1] <= y <= corners[2, 1]
    length = math.hypot(mx, my)
    ex, ey = (mx / length, my / length) if length > 0.0 else (1.0, 0.0)
    low, high, nearest = np.inf, -np.inf, np.inf
    for k in range(4):
        dx, dy = corners[k, 0] - x, corners[k, 1] - y
        ahead, aside = dx * ex + dy * ey, dy * ex - dx * ey
        nearest = min(nearest, ahead)
        if ahead > 0.0:
            low, high = min(low, aside / ahead), max(high, aside / ahead)
    return Wedge(ex, ey, low, high), not inside and nearest > JOIN_M


@lean_part
def _clip_to_wedge(
    ax: float, ay: float, bx: float, by: float, wedge: Wedge, corners: Floats, x: float, y: float
) -> tuple[float, float, bool]:
    """Part of a wall a-b (from x, y) within a wedge, as tangents from and to, from > to for none; and whether all corners are behind the wall."""
    ex, ey, low, high = wedge
    a_ahead, a_aside, b_ahead, b_aside = ax * ex + ay * ey, ay * ex - ax * ey, bx * ex + by * ey, by * ex - bx * ey
    if min(a_aside - high * a_ahead, b_aside - high * b_ahead) > SLACK_M:
        return 1.0, 0.0, False
    if max(a_aside - low * a_ahead, b_aside - low * b_ahead) < -SLACK_M:
        return 1.0, 0.0, False
    ux, uy = bx - ax, by - ay
    here = ax * uy - ay * ux  # its sign is the side of the wall on which the origin lies
    before, beside = True, True
    for k in range(4):
        side = ((corners[k, 1] - y - ay) * ux - (corners[k, 0] - x - ax) * uy) * here
        before &= side < 0.0
        beside &= side > 0.0
    if beside or max(a_ahead, b_ahead) <= 0.0:
        return 1.0, 0.0, False
    if min(a_ahead, b_ahead) <= 0.0 or abs(here) <= 2.0 * JOIN_M * math.hypot(ux, uy):
        return low, high, False
    a, b = a_aside / a_ahead, b_aside / b_ahead
    return max(min(a, b), low), min(max(a, b), high), before
