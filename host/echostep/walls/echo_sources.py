"""What a ranger hears from a place: the echo sources of the plan.

In: walls (n, 4) and places. Out: `Walls.near` gives the `WallIndex` for kernels; `echo_sources` is such a kernel.
`Walls` owns the tables of the tiles that a cloud has reached; they are made when it first comes near.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats, Int32s
from echostep.jit import allocating_kernel, inline_kernel, kernel, lean_kernel
from echostep.walls.index import (
    BEARINGS,
    CONE_RAD,
    EAR_REACH_M,
    JOIN_M,
    TILE_M,
    SourceTable,
    WallIndex,
    build_index,
    segments_cross,
    tile_at,
)
from echostep.walls.visibility import CORNER, EDGE, in_sector, tile_sources

__all__ = ["CORNER", "EDGE", "MOST_SOURCES", "WALL", "Walls", "echo_sources"]


WALL = 0.0
MOST_SOURCES = 8
FARTHEST_M = 3.0
FOOT_M = 1e-3  # what stands so close to a wall does not hide it: walls drawn twice
NEAREST_M = 1e-6
CONE = math.cos(CONE_RAD)


class Walls:
    """A plan's walls, and the tables of the tiles that were looked at so far."""

    def __init__(self, walls: Floats, slant_rad: float = 0.0) -> None:
        """`slant_rad`: greatest angle of a ray to a wall's normal for which the tables must hold; 0 serves `echo_sources`."""
        self._index = build_index(walls, slant_rad)

    @property
    def index(self) -> WallIndex:
        """The index as it is, with the tiles looked at so far."""
        return self._index

    def near(self, x_m: Floats, y_m: Floats, reach_m: float = 0.0) -> WallIndex:
        """The index with all tiles looked at that hold these places (n,) or anything within `reach_m` (at most FARTHEST_M) of them."""
        reach_m = min(reach_m, FARTHEST_M)
        tiles = np.empty(len(x_m) * (int(2.0 * reach_m / TILE_M) + 2) ** 2, np.int32)
        count = _unseen(np.ascontiguousarray(x_m), np.ascontiguousarray(y_m), reach_m, self._index, tiles)
        if count:
            self._index = _look(tiles[:count], self._index)
        return self._index


@lean_kernel
def _unseen(x: Floats, y: Floats, reach: float, index: WallIndex, tiles: Int32s) -> int:
    """Tiles near these places that were not looked at, each once, in order of appearance, into `tiles`; their number."""
    count = 0
    for i in range(len(x)):
        if tile_at(x[i], y[i], index) < 0:
            continue
        left, right = (x[i] - reach - index.x0_m) / TILE_M, (x[i] + reach - index.x0_m) / TILE_M
        low, high = (y[i] - reach - index.y0_m) / TILE_M, (y[i] + reach - index.y0_m) / TILE_M
        for row in range(max(int(low), 0), min(int(high) + 1, index.rows)):
            for tile in range(
                row * index.columns + max(int(left), 0), row * index.columns + min(int(right) + 1, index.columns)
            ):
                if index.seen[tile] == 0:
                    index.seen[tile] = -1
                    tiles[count] = tile
                    count += 1
    for k in range(count):
        index.seen[tiles[k]] = 0
    return count


@kernel
def _look(tiles: Int32s, index: WallIndex) -> WallIndex:
    """Append the tables of these tiles. Indexes given out before stay as they are."""
    count = index.looked
    faces, points, numbers = index.faces, index.points, tiles.astype(np.int64)
    for k in range(len(tiles)):
        more_faces, more_points = tile_sources(numbers[k], index, index.slant)
        faces = _appended(faces, count + k, more_faces)
        points = _appended(points, count + k, more_points)
    for k in range(len(tiles)):
        index.seen[tiles[k]] = count + k + 1
    return WallIndex(
        index.x0_m, index.y0_m, index.columns, index.rows, index.walls, index.start, index.ids, index.slant, index.seen,
        count + len(tiles), faces, points,
    )  # fmt: skip


@kernel
def _appended(table: SourceTable, tile: int, more: SourceTable) -> SourceTable:
    """`table` of `tile` tiles with one more, in arrays that are at least doubled when they grow."""
    unit, rows = tile * BEARINGS, table.tile_start[tile]
    ordered, used = table.start[unit], table.screen_start[rows]
    added, screens = len(more.rows), len(more.screens)
    start, screen_start = _room(table.start, unit + BEARINGS + 1), _room(table.screen_start, rows + added + 1)
    tile_start, order = _room(table.tile_start, tile + 2), _room(table.order, ordered + len(more.order))
    kept, hiding = table.rows, _room(table.screens, used + screens)
    if len(kept) < rows + added:
        kept = np.empty((2 * (rows + added), more.rows.shape[1]))
        kept[:rows] = table.rows[:rows]
    kept[rows : rows + added] = more.rows
    hiding[used : used + screens] = more.screens
    screen_start[rows : rows + added + 1] = more.screen_start + used
    tile_start[tile + 1] = rows + added
    order[ordered : ordered + len(more.order)] = more.order + rows
    start[unit : unit + BEARINGS + 1] = more.start + ordered
    return SourceTable(tile_start, start, order, kept, screen_start, hiding)


@kernel
def _room(numbers: Int32s, size: int) -> Int32s:
    """The same numbers in an array that holds at least `size`."""
    if len(numbers) >= size:
        return numbers
    larger = np.zeros(2 * size, np.int32)
    larger[: len(numbers)] = numbers
    return larger


@lean_kernel
def echo_sources(
    px: float, py: float, axis_rad: float, index: WallIndex, distance_m: Floats, off_axis_rad: Floats, kind: Floats
) -> int:
    """Unhidden echo sources within half a cone of CONE_RAD and EAR_REACH_M, nearest first, at most MOST_SOURCES; their number.

    WALL: foot of the perpendicular on a wall. CORNER: inside of a corner that is about square, where two reflections send sound back. EDGE: any other
    place where a wall ends or walls turn.
    """
    tile = tile_at(px, py, index)
    if tile < 0 or not math.isfinite(axis_rad):
        return 0
    k = index.seen[tile] - 1
    u = bearing(axis_rad)
    ax, ay = math.cos(axis_rad), math.sin(axis_rad)
    if not 0 <= k < index.looked:
        return _sources_unseen(px, py, ax, ay, tile, u, index, distance_m, off_axis_rad, kind)
    u += k * BEARINGS
    n = _add_faces(px, py, ax, ay, index.walls, index.faces, u, distance_m, off_axis_rad, kind)
    n = _add_points(px, py, ax, ay, index.walls, index.points, u, n, distance_m, off_axis_rad, kind)
    for i in range(n):
        off_axis_rad[i] = _angle(off_axis_rad[i])
    return n


@inline_kernel
def bearing(axis_rad: float) -> int:
    """Which of the BEARINGS of `SourceTable` an axis has."""
    turns = axis_rad * (0.5 / math.pi)
    return min(int((turns - math.floor(turns)) * BEARINGS), BEARINGS - 1)


@allocating_kernel
def _sources_unseen(
    px: float, py: float, ax: float, ay: float, tile: int, u: int, index: WallIndex,
    distance_m: Floats, off_axis_rad: Floats, kind: Floats,
) -> int:  # fmt: skip
    """The same for a tile that nobody looked at before."""
    faces, points = tile_sources(tile, index, 0.0)
    n = _add_faces(px, py, ax, ay, index.walls, faces, u, distance_m, off_axis_rad, kind)
    n = _add_points(px, py, ax, ay, index.walls, points, u, n, distance_m, off_axis_rad, kind)
    for i in range(n):
        off_axis_rad[i] = _angle(off_axis_rad[i])
    return n


@inline_kernel
def _add_faces(
    px: float, py: float, ax: float, ay: float, walls: Floats, faces: SourceTable, u: int,
    distance_m: Floats, off_axis: Floats, kind: Floats,
) -> int:  # fmt: skip
    """The walls of unit u; `off_axis` gets cosines."""
    n = 0
    for at in range(faces.start[u], faces.start[u + 1]):
        i = faces.order[at]
        dx, dy = px - faces.rows[i, 0], py - faces.rows[i, 1]
        tx, ty = faces.rows[i, 2], faces.rows[i, 3]
        s, h = dx * tx + dy * ty, dy * tx - dx * ty
        d = abs(h)
        ahead = (ax * ty - ay * tx) * h
        if not (ahead >= CONE * d and 0.0 <= s <= faces.rows[i, 4] and NEAREST_M < d <= EAR_REACH_M):
            continue
        share = 1.0 - FOOT_M / d
        qx, qy = px + share * h * ty, py - share * h * tx
        if d > FOOT_M and hidden(px, py, qx, qy, walls, faces, i):
            continue
        n = _insert(n, d, ahead / d, WALL, distance_m, off_axis, kind)
    return n


@inline_kernel
def _add_points(
    px: float, py: float, ax: float, ay: float, walls: Floats, points: SourceTable, u: int, n: int,
    distance_m: Floats, off_axis: Floats, kind: Floats,
) -> int:  # fmt: skip
    """The corners and edges of unit u, after n walls."""
    for at in range(points.start[u], points.start[u + 1]):
        i = points.order[at]
        dx, dy = points.rows[i, 0] - px, points.rows[i, 1] - py
        ahead, d2 = dx * ax + dy * ay, dx * dx + dy * dy
        if not (ahead > 0.0 and ahead * ahead >= CONE * CONE * d2 and d2 <= EAR_REACH_M * EAR_REACH_M):
            continue
        if not in_sector(-dx, -dy, points.rows[i, 3], points.rows[i, 4], points.rows[i, 5], points.rows[i, 6]):
            continue
        d = math.sqrt(d2)
        share = 1.0 - JOIN_M / d
        if d <= NEAREST_M or (share > 0.0 and hidden(px, py, px + share * dx, py + share * dy, walls, points, i)):
            continue
        n = _insert(n, d, ahead / d, points.rows[i, 2], distance_m, off_axis, kind)
    return n


@inline_kernel
def hidden(px: float, py: float, qx: float, qy: float, walls: Floats, table: SourceTable, i: int) -> bool:
    """Whether one of the walls that can hide row i stands between p and q."""
    for j in range(table.screen_start[i], table.screen_start[i + 1]):  # noqa: SIM110 (numba)
        if segments_cross(px, py, qx, qy, walls, table.screens[j]):
            return True
    return False


@inline_kernel
def _angle(cosine: float) -> float:
    """Arc cosine within the cone, to 1e-8: its series in 1 - cosine."""
    x = max(1.0 - cosine, 0.0)
    series = 35.0 / 18432.0 + x * (63.0 / 90112.0 + x * (231.0 / 851968.0))
    series = 1.0 + x * (1.0 / 12.0 + x * (3.0 / 160.0 + x * (5.0 / 896.0 + x * series)))
    return math.sqrt(2.0 * x) * series


@inline_kernel
def _insert(n: int, d: float, off: float, what: float, distance_m: Floats, off_axis: Floats, kind: Floats) -> int:
    """Sort a source in among n, nearest first; beyond MOST_SOURCES the farthest goes."""
    i = n
    if n == MOST_SOURCES:
        if d >= distance_m[n - 1]:
            return n
        i = n - 1
    while i > 0 and distance_m[i - 1] > d:
        distance_m[i], off_axis[i], kind[i] = distance_m[i - 1], off_axis[i - 1], kind[i - 1]
        i -= 1
    distance_m[i], off_axis[i], kind[i] = d, off, what
    return min(n + 1, MOST_SOURCES)
