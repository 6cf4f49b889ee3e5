# SPDX-License-Identifier: MIT
"""Echo sources of the plan: where a ranger's ping is reflected back to it.

In: walls (n, 4) and places. Out: `Walls.near` gives the `WallIndex` for kernels; `echo_sources` is such a kernel.
Owns, in `Walls`, the tables of the tiles that a cloud has reached; they are made when it first comes near.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Int32s
from echostep.jit import inline_kernel, inline_part, kernel, lean_kernel, part
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
from echostep.walls.tile_points import CORNER, EDGE, WALL, in_sector
from echostep.walls.visibility import tile_sources

__all__ = ["CORNER", "EDGE", "MOST_SOURCES", "WALL", "Walls", "echo_sources"]


MOST_SOURCES = 8  # of one ping: the nearest ones mask the others
FARTHEST_M = 3.0  # greatest `reach_m`: it bounds the tiles made at once
FOOT_M = 1e-3  # a wall so close before another does not hide it: walls drawn twice
NEAREST_M = 1e-6  # a source no further away has no direction
CONE = math.cos(CONE_RAD)


class Receiver(NamedTuple):
    """A ranger: its place (m), and the unit vector of its axis."""

    x: float
    y: float
    axis_x: float
    axis_y: float


class Limits(NamedTuple):
    """Sources that a query leaves out because they cannot be the first echo.

    Edges farther than `edge_m`, and sources farther than a wall within `sure_m` whose foot is off the axis by at most `sure_cos` (a cosine).
    """

    sure_m: float
    sure_cos: float
    edge_m: float


EVERYTHING = Limits(0.0, 1.0, EAR_REACH_M)


class SourceList(NamedTuple):
    """Echo sources found so far, nearest first, each array (MOST_SOURCES,): distance (m), cosine off the axis and later the angle (rad), kind."""

    distance_m: Floats
    off_axis: Floats
    kind: Floats


class Walls:
    """A plan's walls, and the tables of the tiles that a cloud has reached so far."""

    def __init__(self, walls: Floats, slant_rad: float = 0.0) -> None:
        """`slant_rad`: greatest angle of a ray to a wall's normal for which the tables must hold; 0 serves `echo_sources`."""
        self._index = build_index(walls, slant_rad)

    @property
    def index(self) -> WallIndex:
        """The index as it is, with the tiles tabulated so far."""
        return self._index

    def near(self, x_m: Floats, y_m: Floats, reach_m: float = 0.0) -> WallIndex:
        """The index with all tiles tabulated that hold these places (n,) or anything within `reach_m` (at most FARTHEST_M) of them."""
        reach_m = min(reach_m, FARTHEST_M)
        tiles = np.empty(len(x_m) * (int(2.0 * reach_m / TILE_M) + 2) ** 2, np.int32)
        count = _missing_tiles(np.ascontiguousarray(x_m), np.ascontiguousarray(y_m), reach_m, self._index, tiles)
        if count:
            self._index = _tabulate(tiles[:count], self._index)
        return self._index


@lean_kernel
def _missing_tiles(x: Floats, y: Floats, reach: float, index: WallIndex, tiles: Int32s) -> int:
    """Tiles near these places that are not tabulated, each once, in order of appearance, into `tiles`; their number."""
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
                if index.tile_number[tile] == 0:
                    index.tile_number[tile] = -1  # listed, until the end of this function
                    tiles[count] = tile
                    count += 1
    for k in range(count):
        index.tile_number[tiles[k]] = 0
    return count


@kernel
def _tabulate(tiles: Int32s, index: WallIndex) -> WallIndex:
    """Append the tables of these tiles. Indexes given out before stay as they are."""
    count = index.tabulated
    faces, points, numbers = index.faces, index.points, tiles.astype(np.int64)
    for k in range(len(tiles)):
        more_faces, more_points = tile_sources(numbers[k], index, index.slant)
        faces = _appended(faces, count + k, more_faces)
        points = _appended(points, count + k, more_points)
    for k in range(len(tiles)):
        index.tile_number[tiles[k]] = count + k + 1
    return WallIndex(
        index.x0_m, index.y0_m, index.columns, index.rows, index.walls, index.start, index.ids, index.slant, index.tile_number,
        count + len(tiles), faces, points,
    )  # fmt: skip


@part
def _appended(table: SourceTable, tile: int, more: SourceTable) -> SourceTable:
    """`table` of `tile` tiles with one more tile, in arrays that are at least doubled when they grow."""
    unit, rows = tile * BEARINGS, table.tile_start[tile]
    ordered, used = table.start[unit], table.screen_start[rows]
    added, screens = len(more.rows), len(more.screens)
    start, screen_start = _room(table.start, unit + BEARINGS + 1), _room(table.screen_start, rows + added + 1)
    tile_start, order = _room(table.tile_start, tile + 2), _room(table.order, ordered + len(more.order))
    all_rows, hiding = table.rows, _room(table.screens, used + screens)
    if len(all_rows) < rows + added:
        all_rows = np.empty((2 * (rows + added), more.rows.shape[1]))
        _copy_rows(table.rows, rows, all_rows, 0)
    _copy_rows(more.rows, added, all_rows, rows)
    _copy(more.screens, screens, hiding, used, 0)
    _copy(more.screen_start, added + 1, screen_start, rows, used)
    tile_start[tile + 1] = rows + added
    _copy(more.order, len(more.order), order, ordered, rows)
    _copy(more.start, BEARINGS + 1, start, unit, ordered)
    return SourceTable(tile_start, start, order, all_rows, screen_start, hiding)


@part
def _room(numbers: Int32s, size: int) -> Int32s:
    """The same numbers in an array that holds at least `size`."""
    if len(numbers) >= size:
        return numbers
    larger = np.zeros(2 * size, np.int32)
    _copy(numbers, len(numbers), larger, 0, 0)
    return larger


@part
def _copy(numbers: Int32s, count: int, into: Int32s, at: int, plus: int) -> None:
    """Write the first `count` numbers, each with `plus` added, into an array from `at` on; a slice would compile an error message, too."""
    for k in range(count):
        into[at + k] = numbers[k] + plus


@part
def _copy_rows(rows: Floats, count: int, into: Floats, at: int) -> None:
    """Write the first `count` rows into a table from `at` on."""
    for k in range(count):
        for column in range(rows.shape[1]):
            into[at + k, column] = rows[k, column]


@lean_kernel
def echo_sources(
    px: float, py: float, axis_rad: float, index: WallIndex, distance_m: Floats, off_axis_rad: Floats, kind: Floats
) -> int:
    """Unhidden echo sources within half a cone of CONE_RAD and EAR_REACH_M, nearest first, at most MOST_SOURCES; their number.

    WALL: foot of the perpendicular on a wall. CORNER: inside of a corner that is about square, where two reflections send sound back. EDGE: any other
    place where a wall ends or walls turn. Raises LookupError where `Walls.near` has not been.
    """
    receiver = Receiver(px, py, math.cos(axis_rad), math.sin(axis_rad))
    return first_sources(receiver, axis_rad, index, EVERYTHING, SourceList(distance_m, off_axis_rad, kind))


@inline_kernel
def first_sources(receiver: Receiver, axis_rad: float, index: WallIndex, limits: Limits, sources: SourceList) -> int:
    """`echo_sources` of a receiver with this bearing of its axis, without the sources that `limits` leaves out: for loops over many receivers."""
    u = _unit_of(receiver.x, receiver.y, axis_rad, index)
    if u < 0:
        return 0
    n, reach_m = _add_faces(receiver, index.walls, index.faces, u, limits, sources)
    n = _add_points(receiver, index.walls, index.points, u, n, reach_m, limits, sources)
    for i in range(n):
        sources.off_axis[i] = _angle(sources.off_axis[i])
    return n


@lean_kernel
def are_tabulated(x: Floats, y: Floats, index: WallIndex) -> bool:
    """Whether sources can be asked for at all of these places (n,)."""
    for i in range(len(x)):
        tile = tile_at(x[i], y[i], index)
        if tile >= 0 and not 0 < index.tile_number[tile] <= index.tabulated:
            return False
    return True


@inline_part
def _unit_of(x: float, y: float, axis_rad: float, index: WallIndex) -> int:
    """The unit of `SourceTable` for a pose; -1 where there are no sources. Raises LookupError for a tile without a table, which is never silence."""
    tile = tile_at(x, y, index)
    if tile < 0 or not math.isfinite(axis_rad):
        return -1
    k = index.tile_number[tile] - 1
    if not 0 <= k < index.tabulated:
        raise LookupError("the tile has no table: Walls.near makes it")
    return k * BEARINGS + bearing(axis_rad)


@inline_part
def bearing(axis_rad: float) -> int:
    """Which of the BEARINGS of `SourceTable` an axis has."""
    turns = axis_rad * (0.5 / math.pi)
    return min(int((turns - math.floor(turns)) * BEARINGS), BEARINGS - 1)


@inline_part
def _add_faces(
    receiver: Receiver, walls: Floats, faces: SourceTable, u: int, limits: Limits, sources: SourceList
) -> tuple[int, float]:
    """Feet of perpendiculars on the walls of unit u, with cosines off the axis; their number, and the distance up to which a source can be first.

    In the wall's own axes: s along its tangent t, h to the left of it.

          h ^
            |      o receiver (s, h)        d = |h|
            |      |
            o------x----------> s      x: the source, at 0 <= s <= length
          start   foot         end
    """
    px, py, ax, ay = receiver
    n, reach_m = 0, EAR_REACH_M
    for position in range(faces.start[u], faces.start[u + 1]):
        i = faces.order[position]
        dx, dy = px - faces.rows[i, 0], py - faces.rows[i, 1]
        tx, ty = faces.rows[i, 2], faces.rows[i, 3]
        s, h = dx * tx + dy * ty, dy * tx - dx * ty
        d = abs(h)
        ahead = (ax * ty - ay * tx) * h
        if not (ahead >= CONE * d and 0.0 <= s <= faces.rows[i, 4] and NEAREST_M < d <= reach_m):
            continue
        share = 1.0 - FOOT_M / d
        qx, qy = px + share * h * ty, py - share * h * tx
        if d > FOOT_M and hidden(px, py, qx, qy, walls, faces, i):
            continue
        n = _insert(n, d, ahead / d, WALL, sources)
        if d <= limits.sure_m and ahead >= limits.sure_cos * d:
            reach_m = d
    return n, reach_m


@inline_part
def _add_points(
    receiver: Receiver,
    walls: Floats,
    points: SourceTable,
    u: int,
    n: int,
    reach_m: float,
    limits: Limits,
    sources: SourceList,
) -> int:
    """Corners and edges of unit u up to `reach_m`, after the n sources found before; the new number."""
    px, py, ax, ay = receiver
    for position in range(points.start[u], points.start[u + 1]):
        i = points.order[position]
        if points.rows[i, 7] > reach_m * reach_m:
            break  # nearest first
        dx, dy = points.rows[i, 0] - px, points.rows[i, 1] - py
        ahead, d2 = dx * ax + dy * ay, dx * dx + dy * dy
        most_m = min(reach_m, limits.edge_m) if points.rows[i, 2] == EDGE else reach_m
        if not (ahead > 0.0 and ahead * ahead >= CONE * CONE * d2 and d2 <= most_m * most_m):
            continue
        if not in_sector(-dx, -dy, points.rows[i, 3], points.rows[i, 4], points.rows[i, 5], points.rows[i, 6]):
            continue
        d = math.sqrt(d2)
        share = 1.0 - JOIN_M / d
        if d <= NEAREST_M or (share > 0.0 and hidden(px, py, px + share * dx, py + share * dy, walls, points, i)):
            continue
        n = _insert(n, d, ahead / d, points.rows[i, 2], sources)
    return n


@inline_part
def hidden(px: float, py: float, qx: float, qy: float, walls: Floats, table: SourceTable, i: int) -> bool:
    """Whether one of the walls that can hide row i lies between p and q."""
    for j in range(table.screen_start[i], table.screen_start[i + 1]):  # noqa: SIM110 (numba)
        if segments_cross(px, py, qx, qy, walls, table.screens[j]):
            return True
    return False


@inline_part
def _angle(cosine: float) -> float:
    """Arc cosine within the cone, to 1e-8: its series in 1 - cosine."""
    x = max(1.0 - cosine, 0.0)
    series = 35.0 / 18432.0 + x * (63.0 / 90112.0 + x * (231.0 / 851968.0))
    series = 1.0 + x * (1.0 / 12.0 + x * (3.0 / 160.0 + x * (5.0 / 896.0 + x * series)))
    return math.sqrt(2.0 * x) * series


@inline_part
def _insert(n: int, d: float, off: float, new_kind: float, sources: SourceList) -> int:
    """Insert a source among n, nearest first; beyond MOST_SOURCES the farthest is dropped."""
    distance_m, off_axis, kind = sources
    i = n
    if n == MOST_SOURCES:
        if d >= distance_m[n - 1]:
            return n
        i = n - 1
    while i > 0 and distance_m[i - 1] > d:
        distance_m[i], off_axis[i], kind[i] = distance_m[i - 1], off_axis[i - 1], kind[i - 1]
        i -= 1
    distance_m[i], off_axis[i], kind[i] = d, off, new_kind
    return min(n + 1, MOST_SOURCES)
