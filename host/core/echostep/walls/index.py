# SPDX-License-Identifier: MIT
"""The walls of a plan on a grid of square tiles: which of them a move crosses.

In: wall segments (n, 4) in map metres. Out: `WallIndex`, plain arrays for kernels, and `crosses_wall`. Owns nothing.
Each tile lists the walls that touch it, so that a short move is checked against one or two walls, in a plan of any size. The second half of the
index, the echo sources by tile, is filled by `echo_sources.Walls`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba.core import types
from numba.extending import typeof_impl

from echostep.arrays import Bools, Floats, Int32s
from echostep.errors import EchostepError
from echostep.jit import inline_part, kernel, lean_kernel, part

TILE_M = 1.0
EAR_REACH_M = 6.3  # greatest distance of an echo source: a little more than the rangers' 6 m
JOIN_M = 0.01  # walls whose ends are no further apart are joined: drawing accuracy
# Greatest angle off a ranger's axis: half the 55 degree cone and its rim [Girard 2011, Figure 2]; a wall at 1 m still answers there
CONE_RAD = math.radians(40.0)
MAX_TILES = 40_000_000  # a plan with more is not in metres, and its index would fill the memory
SHORTEST_M = 1e-6  # shorter walls are left out
FACE, POINT = 5, 8  # columns of the rows of a face and of a point (`WallIndex`)
BEARINGS = 16  # sectors of the ranger's axis for which the tables list their rows


class SourceTable(NamedTuple):
    """Places that may reflect sound, by tile and by bearing of the ranger's axis.

    With unit u = k * BEARINGS + bearing, the k-th tabulated tile has rows[order[start[u] : start[u + 1]]] within CONE_RAD of that bearing; all its
    rows are rows[tile_start[k] : tile_start[k + 1]]. The walls that can hide row i from somewhere in the tile are
    walls[screens[screen_start[i] : screen_start[i + 1]]].
    """

    tile_start: Int32s
    start: Int32s
    order: Int32s
    rows: Floats
    screen_start: Int32s
    screens: Int32s


class WallIndex(NamedTuple):
    """A grid of tiles over the walls, and the echo sources of those tiles that are tabulated.

    Tile t is touched by walls[ids[start[t] : start[t + 1]]]. `tile_number[t]` is k + 1 for the k-th tabulated tile, else 0; this index has the first
    `tabulated` of them. Rows of `faces` (walls): start x, y of the wall, its unit tangent x, y, its length. Rows of `points` (ends of walls): x, y,
    kind, the sector in which they are of that kind, as unit vectors x, y of its sides, counter-clockwise, squared distance from the tile. Both hold
    for sound that leaves a wall at up to `slant` (tangent) from its normal.
    """

    x0_m: float
    y0_m: float
    columns: int
    rows: int
    walls: Floats
    start: Int32s
    ids: Int32s
    slant: float
    tile_number: Int32s
    tabulated: int
    faces: SourceTable
    points: SourceTable


@typeof_impl.register(WallIndex)
def _index_type(index: WallIndex, context: object) -> types.Type:
    """The numba type of every index: found once, because looking at all its arrays takes longer than many a kernel."""
    if not _INDEX_TYPE:
        _INDEX_TYPE.append(types.NamedTuple([typeof_impl(field, context) for field in index], WallIndex))  # type: ignore[no-untyped-call]
    return _INDEX_TYPE[0]


_INDEX_TYPE: list[types.Type] = []


def no_sources(columns: int) -> SourceTable:
    """A table without rows."""
    none = np.zeros(1, np.int32)
    return SourceTable(none, none, none[:0], np.zeros((0, columns)), none, none[:0])


def build_index(walls: Floats, slant_rad: float = 0.0) -> WallIndex:
    """Index of walls (n, 4), no tile tabulated yet; raises EchostepError for a plan too wide for its tiles.

    Walls without length or with a coordinate that is not finite are left out.
    """
    walls = np.ascontiguousarray(walls, dtype=np.float64).reshape(-1, 4)
    with np.errstate(invalid="ignore", over="ignore"):
        length = np.hypot(walls[:, 2] - walls[:, 0], walls[:, 3] - walls[:, 1])
    valid = np.isfinite(length) & (length >= SHORTEST_M)
    walls = walls if valid.all() else walls[valid]
    tables = (no_sources(FACE), no_sources(POINT))
    none, slant = np.zeros(1, np.int32), math.tan(slant_rad)
    if not len(walls):
        return WallIndex(0.0, 0.0, 0, 0, walls, none, none[:0], slant, none[:0], 0, *tables)
    ends = walls.reshape(-1, 2)
    low, high = ends.min(0) - EAR_REACH_M, ends.max(0) + EAR_REACH_M
    size = np.ceil((high - low) / TILE_M) + 1
    if size.prod() > MAX_TILES:
        raise EchostepError(f"the plan spans {high[0] - low[0]:.0f} x {high[1] - low[1]:.0f} m: are its units metres?")
    columns, rows = int(size[0]), int(size[1])
    start, ids = _walls_by_tile(walls, float(low[0]), float(low[1]), columns, rows)
    tile_number = np.zeros(columns * rows, np.int32)
    return WallIndex(float(low[0]), float(low[1]), columns, rows, walls, start, ids, slant, tile_number, 0, *tables)


NO_WALLS = build_index(np.zeros((0, 4)))


@kernel
def _walls_by_tile(walls: Floats, x0: float, y0: float, columns: int, rows: int) -> tuple[Int32s, Int32s]:
    """For each tile, the walls that come within JOIN_M of it, as starts and ids in order."""
    start = np.zeros(columns * rows + 1, np.int32)
    for w in range(len(walls)):
        low, high = _row_span(walls, w, y0, rows)
        for r in range(low, high):
            first, beyond = _column_span(walls, w, r, x0, y0, columns)
            for t in range(r * columns + first, r * columns + beyond):
                start[t] += 1
    total = 0
    for t in range(len(start)):
        total += start[t]
        start[t] = total
    ids = np.empty(total, np.int32)
    for w in range(len(walls) - 1, -1, -1):
        low, high = _row_span(walls, w, y0, rows)
        for r in range(low, high):
            first, beyond = _column_span(walls, w, r, x0, y0, columns)
            for t in range(r * columns + first, r * columns + beyond):
                start[t] -= 1
                ids[start[t]] = w
    return start, ids


@inline_part
def _row_span(walls: Floats, w: int, y0: float, rows: int) -> tuple[int, int]:
    """Rows of tiles that a wall touches."""
    low, high = min(walls[w, 1], walls[w, 3]), max(walls[w, 1], walls[w, 3])
    return max(int((low - JOIN_M - y0) / TILE_M), 0), min(int((high + JOIN_M - y0) / TILE_M) + 1, rows)


@inline_part
def _column_span(walls: Floats, w: int, r: int, x0: float, y0: float, columns: int) -> tuple[int, int]:
    """Columns of tiles that a wall touches within a row."""
    ax, ay, bx, by = walls[w, 0], walls[w, 1], walls[w, 2], walls[w, 3]
    if abs(by - ay) > JOIN_M:
        slope = (bx - ax) / (by - ay)
        below = max(min(ay, by), y0 + r * TILE_M - JOIN_M)
        above = min(max(ay, by), y0 + (r + 1) * TILE_M + JOIN_M)
        ax, bx = ax + slope * (below - ay), ax + slope * (above - ay)
    low, high = min(ax, bx), max(ax, bx)
    return max(int((low - JOIN_M - x0) / TILE_M), 0), min(int((high + JOIN_M - x0) / TILE_M) + 1, columns)


@inline_part
def tile_at(x: float, y: float, index: WallIndex) -> int:
    """Number of the tile that holds a point; -1 outside, and for a point that is not finite."""
    column, row = (x - index.x0_m) / TILE_M, (y - index.y0_m) / TILE_M
    if not (0.0 <= column < index.columns and 0.0 <= row < index.rows):
        return -1
    return int(row) * index.columns + int(column)


@inline_part
def segments_cross(ax: float, ay: float, bx: float, by: float, walls: Floats, j: int) -> bool:
    """Whether the segment a-b meets wall j; touching counts, gliding along it does not."""
    cx, cy, dx, dy = walls[j, 0], walls[j, 1], walls[j, 2], walls[j, 3]
    ux, uy, vx, vy = bx - ax, by - ay, dx - cx, dy - cy
    d1 = ux * (cy - ay) - uy * (cx - ax)
    d2 = ux * (dy - ay) - uy * (dx - ax)
    if d1 * d2 > 0.0 or d1 == d2:
        return False
    return (vx * (ay - cy) - vy * (ax - cx)) * (vx * (by - cy) - vy * (bx - cx)) <= 0.0


@lean_kernel
def crosses_wall(ax: float, ay: float, bx: float, by: float, index: WallIndex) -> bool:
    """Whether a move from a to b crosses any wall; never for a move that is not finite."""
    walls, start, ids, x0, y0 = index.walls, index.start, index.ids, index.x0_m, index.y0_m
    columns, rows = index.columns, index.rows
    c0, r0, c1, r1 = (ax - x0) / TILE_M, (ay - y0) / TILE_M, (bx - x0) / TILE_M, (by - y0) / TILE_M
    if not (min(c0, c1, r0, r1) >= 0.0 and max(c0, c1) < columns and max(r0, r1) < rows):
        c0, r0, c1, r1 = _clipped(c0, r0, c1, r1, columns, rows)
        if not c0 >= 0.0:
            return False
    pieces = int(max(abs(c1 - c0), abs(r1 - r0))) + 1
    c1, r1 = (c1 - c0) / pieces, (r1 - r0) / pieces
    for _ in range(pieces):
        left, right = int(min(c0, c0 + c1)), min(int(max(c0, c0 + c1)), columns - 1)
        for r in range(int(min(r0, r0 + r1)), min(int(max(r0, r0 + r1)), rows - 1) + 1):
            for k in range(start[r * columns + left], start[r * columns + right + 1]):
                if segments_cross(ax, ay, bx, by, walls, ids[k]):
                    return True
        c0, r0 = c0 + c1, r0 + r1
    return False


@kernel
def crossings(from_x: Floats, from_y: Floats, to_x: Floats, to_y: Floats, index: WallIndex) -> Bools:
    """Which moves (n,) cross a wall."""
    crosses = np.empty(len(to_x), np.bool_)
    for i in range(len(to_x)):
        crosses[i] = crosses_wall(from_x[i], from_y[i], to_x[i], to_y[i], index)
    return crosses


@part
def _clipped(c0: float, r0: float, c1: float, r1: float, columns: int, rows: int) -> tuple[float, float, float, float]:
    """The part of a move that is on the grid, in tiles [Liang, Barsky 1984]; -1 if there is none or the move is not finite."""
    if not (math.isfinite(c1 - c0) and math.isfinite(r1 - r0)):
        return -1.0, -1.0, -1.0, -1.0
    enter, leave = _within(c0, c1 - c0, columns, 0.0, 1.0)
    enter, leave = _within(r0, r1 - r0, rows, enter, leave)
    if not enter < leave:
        return -1.0, -1.0, -1.0, -1.0
    c, r = c1 - c0, r1 - r0
    return (
        min(max(c0 + enter * c, 0.0), columns - 1e-6), min(max(r0 + enter * r, 0.0), rows - 1e-6),
        min(max(c0 + leave * c, 0.0), columns - 1e-6), min(max(r0 + leave * r, 0.0), rows - 1e-6),
    )  # fmt: skip


@part
def _within(offset: float, along: float, width: float, enter: float, leave: float) -> tuple[float, float]:
    """Share of a move at which it enters 0 to `width` along one axis, and at which it leaves."""
    if along == 0.0:
        return (enter, leave) if 0.0 <= offset <= width else (1.0, 0.0)
    near, far = -offset / along, (width - offset) / along
    return max(enter, min(near, far)), min(leave, max(near, far))
