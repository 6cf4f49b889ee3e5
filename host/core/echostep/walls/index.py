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
GROUP, MOST_TILES = 64, 32  # moves that are checked together, and tiles around them up to which that is faster
BEARINGS = 16  # sectors of the ranger's axis for which the tables list their rows

Wall = tuple[float, float, float, float]  # start x, y, end x, y (m)


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
    start, ids = np.zeros(columns * rows + 1, np.int32), np.empty(0, np.int32)
    for is_counted in (False, True):
        for w in range(len(walls) - 1, -1, -1):
            wall = wall_at(walls, w)
            low, high = _row_span(wall, y0, rows)
            for r in range(low, high):
                first, beyond = _column_span(wall, r, x0, y0, columns)
                for t in range(r * columns + first, r * columns + beyond):
                    start[t] += -1 if is_counted else 1
                    if is_counted:
                        ids[start[t]] = w
        if not is_counted:
            for t in range(1, len(start)):
                start[t] += start[t - 1]
            ids = np.empty(start[-1], np.int32)
    return start, ids


@inline_part
def wall_at(walls: Floats, j: int) -> Wall:
    """Start and end of wall j."""
    return walls[j, 0], walls[j, 1], walls[j, 2], walls[j, 3]


@inline_part
def _row_span(wall: Wall, y0: float, rows: int) -> tuple[int, int]:
    """Rows of tiles that a wall touches: the first, and the one beyond the last."""
    return _tiles(min(wall[1], wall[3]) - y0, max(wall[1], wall[3]) - y0, rows)


@inline_part
def _column_span(wall: Wall, r: int, x0: float, y0: float, columns: int) -> tuple[int, int]:
    """Columns of tiles that a wall touches within a row."""
    ax, ay, bx, by = wall
    if abs(by - ay) > JOIN_M:
        slope = (bx - ax) / (by - ay)
        below = max(min(ay, by), y0 + r * TILE_M - JOIN_M)
        above = min(max(ay, by), y0 + (r + 1) * TILE_M + JOIN_M)
        ax, bx = ax + slope * (below - ay), ax + slope * (above - ay)
    return _tiles(min(ax, bx) - x0, max(ax, bx) - x0, columns)


@inline_part
def _tiles(low_m: float, high_m: float, count: int) -> tuple[int, int]:
    """Of `count` tiles in a line, those within JOIN_M of a span: the first, and the one beyond the last."""
    low, high = (low_m - JOIN_M) / TILE_M, (high_m + JOIN_M) / TILE_M
    return int(min(max(low, 0.0), count)), int(min(max(high + 1.0, 0.0), count))


@inline_part
def tile_at(x: float, y: float, index: WallIndex) -> int:
    """Number of the tile that holds a point; -1 outside, and for a point that is not finite."""
    column, row = (x - index.x0_m) / TILE_M, (y - index.y0_m) / TILE_M
    if not (0.0 <= column < index.columns and 0.0 <= row < index.rows):
        return -1
    return int(row) * index.columns + int(column)


@inline_part
def segments_cross(ax: float, ay: float, bx: float, by: float, wall: Wall) -> bool:
    """Whether the segment a-b meets a wall; touching counts, gliding along it does not."""
    cx, cy, dx, dy = wall
    ux, uy, vx, vy = bx - ax, by - ay, dx - cx, dy - cy
    d1 = ux * (cy - ay) - uy * (cx - ax)
    d2 = ux * (dy - ay) - uy * (dx - ax)
    if d1 * d2 > 0.0 or d1 == d2:
        return False
    return (vx * (ay - cy) - vy * (ax - cx)) * (vx * (by - cy) - vy * (bx - cx)) <= 0.0


@lean_kernel
def crosses_wall(ax: float, ay: float, bx: float, by: float, index: WallIndex) -> bool:
    """Whether a move from a to b crosses any wall; never for a move that is not finite."""
    if not (math.isfinite(bx - ax) and math.isfinite(by - ay)):
        return False
    low, high = _row_span((ax, ay, bx, by), index.y0_m, index.rows)
    for r in range(low, high):
        first, beyond = _column_span((ax, ay, bx, by), r, index.x0_m, index.y0_m, index.columns)
        for k in range(index.start[r * index.columns + first], index.start[r * index.columns + beyond]):
            if segments_cross(ax, ay, bx, by, wall_at(index.walls, index.ids[k])):
                return True
    return False


@kernel
def crossings(from_x: Floats, from_y: Floats, to_x: Floats, to_y: Floats, index: WallIndex) -> Bools:
    """Which moves (n,) cross a wall: in groups, against the walls in the box around each group, or one by one where that has many tiles."""
    crosses = np.zeros(len(to_x), np.bool_)
    for begin in range(0, len(to_x), GROUP):
        end = min(begin + GROUP, len(to_x))
        ax, ay, bx, by = from_x[begin:end], from_y[begin:end], to_x[begin:end], to_y[begin:end]
        if not _cross_in_box(ax, ay, bx, by, index, crosses[begin:end]):
            for i in range(end - begin):
                crosses[begin + i] = crosses_wall(ax[i], ay[i], bx[i], by[i], index)
    return crosses


@part
def _cross_in_box(ax: Floats, ay: Floats, bx: Floats, by: Floats, index: WallIndex, crosses: Bools) -> bool:
    """Mark the moves (n,) from a to b that cross a wall in the box around them; False if the box has many tiles, or is not finite."""
    left, right, low, high = ax[0], ax[0], ay[0], ay[0]
    for i in range(len(ax)):
        left, right = min(left, ax[i], bx[i]), max(right, ax[i], bx[i])
        low, high = min(low, ay[i], by[i]), max(high, ay[i], by[i])
    if not (right - left) * (high - low) < MOST_TILES * TILE_M * TILE_M:
        return False
    first, beyond = _tiles(left - index.x0_m, right - index.x0_m, index.columns)
    below, above = _tiles(low - index.y0_m, high - index.y0_m, index.rows)
    for r in range(below, above):
        for k in range(index.start[r * index.columns + first], index.start[r * index.columns + beyond]):
            wall = wall_at(index.walls, index.ids[k])
            for i in range(len(ax)):
                crosses[i] |= segments_cross(ax[i], ay[i], bx[i], by[i], wall)
    return True
