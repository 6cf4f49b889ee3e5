# SPDX-License-Identifier: MIT
"""Echo sources of many receivers at once: of a block of them in one tile, whose axes have one bearing.

In: places and axes in a block. Out: a list of sources for each receiver, in the same block. Owns nothing.

A block is one array of columns of BLOCK numbers, one for each receiver: column c begins at c. All inner loops run over the receivers and have no
branches, so that the compiler computes several receivers at once.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep.jit import inline_kernel, inline_part, kernel, lean_part
from echostep.walls.index import CONE_RAD, EAR_REACH_M, JOIN_M, SourceTable, segments_cross, wall_at
from echostep.walls.tile_points import EDGE, WALL, in_sector

BLOCK, MOST_SOURCES = 64, 8  # receivers; sources of each: the nearest ones mask the others
FOOT_M = 1e-3  # a wall so close before another does not hide it: walls drawn twice
NEAREST_M = 1e-6  # a source no further away has no direction
CONE = math.cos(CONE_RAD)
# Columns: place and axis of the receiver, distance within which a source can be the first (m); a new source, the end of the ray to it or its kind
X, Y, AXIS_X, AXIS_Y, REACH, NEW_M, NEW_COS, END_X, END_Y = range(0, 9 * BLOCK, BLOCK)
NEW_KIND = END_X
# The lists, MOST_SOURCES columns each, nearest first: distance (m), inf for none; cosine off the axis and later the angle (rad); kind. Then FREE ones
DISTANCE, OFF_AXIS, KIND, FREE = range(9 * BLOCK, (10 + 3 * MOST_SOURCES) * BLOCK, MOST_SOURCES * BLOCK)


Limits = tuple[float, float, float]  # of the sources that are listed, see `list_sources`


@kernel
def new_block() -> Floats:
    """A block with four free columns."""
    return np.empty(FREE + 4 * BLOCK)


@kernel
def one_receiver() -> tuple[Floats, Floats, Floats, Floats]:
    """A block, and in it distances, angles off the axis and kinds (MOST_SOURCES,) of the first receiver's sources."""
    block = new_block()
    return block, block[DISTANCE:OFF_AXIS:BLOCK], block[OFF_AXIS:KIND:BLOCK], block[KIND:FREE:BLOCK]


@inline_kernel
def set_receiver(block: Floats, i: int, x: float, y: float, axis_x: float, axis_y: float) -> None:
    """Place the i-th receiver."""
    block[X + i], block[Y + i], block[AXIS_X + i], block[AXIS_Y + i] = x, y, axis_x, axis_y


@lean_part
def list_of_unit(
    count: int, u: int, walls: Floats, faces: SourceTable, points: SourceTable, limits: Limits, block: Floats
) -> int:
    """`list_sources` of unit u of these tables."""
    n, reach_m, (sure_m, sure_cos, edge_m) = 0, 0.0, limits
    for i in range(count):
        block[REACH + i] = EAR_REACH_M
    for position in range(faces.start[u], faces.start[u + 1]):
        row = faces.order[position]
        if _unhidden(count, _feet(count, row, faces, block), row, walls, faces, block):
            for i in range(count):
                is_sure = block[NEW_M + i] <= sure_m and block[NEW_COS + i] >= sure_cos
                block[REACH + i] = block[NEW_M + i] if is_sure else block[REACH + i]
            n = _insert(count, n, WALL, block)
    for i in range(count):
        reach_m = max(reach_m, block[REACH + i])
    for position in range(points.start[u], points.start[u + 1]):
        row = points.order[position]
        if points.rows[row, 7] > reach_m * reach_m:
            break  # nearest first
        if _unhidden(count, _rays(count, row, points, edge_m, block), row, walls, points, block):
            n = _insert(count, n, points.rows[row, 2], block)
    for k in range(n):
        for i in range(count):
            block[OFF_AXIS + k * BLOCK + i] = _angle(block[OFF_AXIS + k * BLOCK + i])
    return n


@inline_part
def _feet(count: int, row: int, faces: SourceTable, block: Floats) -> int:
    """Make the feet of the perpendiculars on a wall the new sources, as if no wall were between; their number.

    In the wall's own axes: s along its tangent t, h to the left of it.

          h ^
            |      o receiver (s, h)        d = |h|
            |      |
            o------x----------> s      x: the source, at 0 <= s <= length
          start   foot         end
    """
    r, found = faces.rows, 0
    wx, wy, tx, ty, length = r[row, 0], r[row, 1], r[row, 2], r[row, 3], r[row, 4]
    for i in range(count):
        dx, dy = block[X + i] - wx, block[Y + i] - wy
        s, h = dx * tx + dy * ty, dy * tx - dx * ty
        d, ahead = abs(h), (block[AXIS_X + i] * ty - block[AXIS_Y + i] * tx) * h
        is_source = ahead >= CONE * d and 0.0 <= s <= length and NEAREST_M < d <= block[REACH + i]
        along = max(1.0 - FOOT_M / d, 0.0) * h
        block[NEW_M + i], block[NEW_COS + i] = d if is_source else math.inf, ahead / d
        block[END_X + i], block[END_Y + i] = block[X + i] + along * ty, block[Y + i] - along * tx
        found += block[NEW_M + i] < math.inf
    return found


@inline_part
def _rays(count: int, row: int, points: SourceTable, edge_m: float, block: Floats) -> int:
    """Make a corner, or an edge within `edge_m`, the new source of the receivers in its sector, as if no wall were between; their number."""
    r, found = points.rows, 0
    x, y, ax, ay, bx, by = r[row, 0], r[row, 1], r[row, 3], r[row, 4], r[row, 5], r[row, 6]
    most_m = edge_m if r[row, 2] == EDGE else EAR_REACH_M
    for i in range(count):
        dx, dy = x - block[X + i], y - block[Y + i]
        d, ahead = math.sqrt(dx * dx + dy * dy), dx * block[AXIS_X + i] + dy * block[AXIS_Y + i]
        is_source = ahead >= CONE * d and NEAREST_M < d <= min(block[REACH + i], most_m)
        is_source &= in_sector(-dx, -dy, ax, ay, bx, by)
        share = max(1.0 - JOIN_M / d, 0.0)
        block[NEW_M + i], block[NEW_COS + i] = d if is_source else math.inf, ahead / d
        block[END_X + i], block[END_Y + i] = block[X + i] + share * dx, block[Y + i] + share * dy
        found += block[NEW_M + i] < math.inf
    return found


@inline_part
def _unhidden(count: int, found: int, row: int, walls: Floats, table: SourceTable, block: Floats) -> int:
    """Leave out those of the `found` new sources of a row of which a wall crosses the ray; the number of the others."""
    for j in range(table.screen_start[row], table.screen_start[row + 1]):
        if found == 0:
            break
        wall, found = wall_at(walls, table.screens[j]), 0
        for i in range(count):
            is_hidden = segments_cross(block[X + i], block[Y + i], block[END_X + i], block[END_Y + i], wall)
            block[NEW_M + i] = math.inf if is_hidden else block[NEW_M + i]
            found += block[NEW_M + i] < math.inf
    return found


@inline_part
def _angle(cosine: float) -> float:
    """Arc cosine within the cone, to 1e-8: its series in 1 - cosine."""
    x = max(1.0 - cosine, 0.0)
    series = 35.0 / 18432.0 + x * (63.0 / 90112.0 + x * (231.0 / 851968.0))
    series = 1.0 + x * (1.0 / 12.0 + x * (3.0 / 160.0 + x * (5.0 / 896.0 + x * series)))
    return math.sqrt(2.0 * x) * series


@inline_part
def _insert(count: int, n: int, kind: float, block: Floats) -> int:
    """Insert the new sources, all of one kind, into lists of up to n; beyond MOST_SOURCES the farthest are dropped. The greatest length."""
    for i in range(count):
        block[NEW_KIND + i] = kind
    for k in range(n):
        for i in range(count):
            at, is_nearer = k * BLOCK + i, block[NEW_M + i] < block[DISTANCE + k * BLOCK + i]
            _exchange(block, DISTANCE + at, NEW_M + i, is_nearer)
            _exchange(block, OFF_AXIS + at, NEW_COS + i, is_nearer)
            _exchange(block, KIND + at, NEW_KIND + i, is_nearer)
    if n == MOST_SOURCES:
        return n
    for i in range(count):
        at = n * BLOCK + i
        block[DISTANCE + at], block[OFF_AXIS + at] = block[NEW_M + i], block[NEW_COS + i]
        block[KIND + at] = block[NEW_KIND + i]
    return n + 1


@inline_part
def _exchange(block: Floats, a: int, b: int, does: bool) -> None:
    """Exchange two numbers of a block, or not."""
    block[a], block[b] = block[b] if does else block[a], block[a] if does else block[b]
