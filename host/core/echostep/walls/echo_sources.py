# SPDX-License-Identifier: MIT
"""Echo sources of the plan: where a ranger's ping is reflected back to it.

In: walls (n, 4) and places. Out: `Walls.near` gives the `WallIndex` for kernels; `echo_sources` is such a kernel.
Owns, in `Walls`, the tables of the tiles that a cloud has reached; they are made when it first comes near.

A tile's tables have its faces, walls that can reflect sound straight back, and its points, places where walls end or meet, with the screens: walls
that may hide each. All are safe: a source that is left out can be detected from nowhere in the tile, and a wall that is not among the screens hides
nothing from anywhere in it. So a query gets the exact answer from a few walls [potentially visible sets, Teller and Sequin 1991].
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats, Int32s
from echostep.jit import inline_kernel, kernel, lean_kernel, part
from echostep.walls.index import BEARINGS, EAR_REACH_M, JOIN_M, TILE_M, SourceTable, WallIndex, build_index, tile_at
from echostep.walls.source_blocks import Limits, list_of_unit, one_receiver, set_receiver
from echostep.walls.tile_faces import tile_faces
from echostep.walls.tile_geometry import SLACK_M
from echostep.walls.tile_points import tile_points

__all__ = ["Walls", "are_tabulated", "echo_sources", "list_sources", "one_receiver", "unit_at"]
FARTHEST_M = 3.0  # greatest `reach_m`: it bounds the tiles made at once


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
def tile_sources(tile: int, index: WallIndex, slant: float) -> tuple[SourceTable, SourceTable]:
    """Faces and points that can be detected from a tile, for sound up to `slant` (tangent) off the normal of a wall."""
    corners = np.empty((4, 2))
    x, y = index.x0_m + tile % index.columns * TILE_M, index.y0_m + tile // index.columns * TILE_M
    for k in range(4):
        corners[k, 0] = x + (TILE_M + SLACK_M if k in (1, 2) else -SLACK_M)
        corners[k, 1] = y + (TILE_M + SLACK_M if k in (2, 3) else -SLACK_M)
    near = _walls_near(tile, index)
    return tile_faces(corners, near, index.walls, slant), tile_points(corners, near, index)


@part
def _walls_near(tile: int, index: WallIndex) -> Int32s:
    """Numbers of the walls that may be within EAR_REACH_M of a tile, ascending."""
    reach = math.ceil((EAR_REACH_M + JOIN_M) / TILE_M)
    column, row = tile % index.columns, tile // index.columns
    left, right = max(column - reach, 0), min(column + reach + 1, index.columns)
    numbers, count = np.empty(64, np.int32), 0
    for r in range(max(row - reach, 0), min(row + reach + 1, index.rows)):
        for k in range(index.start[r * index.columns + left], index.start[r * index.columns + right]):
            if count == len(numbers):
                numbers = np.concatenate((numbers, numbers))
            slot = count
            while slot > 0 and numbers[slot - 1] > index.ids[k]:
                slot -= 1
            if slot > 0 and numbers[slot - 1] == index.ids[k]:
                continue
            for later in range(count, slot, -1):
                numbers[later] = numbers[later - 1]
            numbers[slot] = index.ids[k]
            count += 1
    return numbers[:count]


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


@inline_kernel
def unit_at(x: float, y: float, axis_rad: float, index: WallIndex) -> int:
    """Tile and bearing of a receiver, as tile * BEARINGS + bearing; negative outside the grid, and for numbers that are not finite."""
    turns = axis_rad * (0.5 / math.pi)
    share = turns - math.floor(turns)
    return tile_at(x, y, index) * BEARINGS + min(int(share * BEARINGS), BEARINGS - 1) if share >= 0.0 else -1


@lean_kernel
def list_sources(count: int, unit: int, index: WallIndex, limits: Limits, block: Floats) -> int:
    """List the sources of the first `count` receivers, all in one unit [`unit_at`], without those that cannot be the first echo.

    `limits`: sources farther than a wall within the first (m), whose foot is off the axis by at most the second (a cosine), are left out, and edges
    farther than the third (m).
    WALL: foot of the perpendicular on a wall. CORNER: inside of a corner that is about square, where two reflections send sound back. EDGE: any other
    place where a wall ends or walls turn. Returns the length of the longest list. Raises LookupError where `Walls.near` has not been.
    """
    if unit < 0:
        return 0
    tile, bearing = unit // BEARINGS, unit % BEARINGS
    k = index.tile_number[tile] - 1
    if not 0 <= k < index.tabulated:
        raise LookupError("the tile has no table: Walls.near makes it")
    return list_of_unit(count, k * BEARINGS + bearing, index.walls, index.faces, index.points, limits, block)


@lean_kernel
def are_tabulated(x: Floats, y: Floats, index: WallIndex) -> bool:
    """Whether sources can be asked for at all of these places (n,)."""
    for i in range(len(x)):
        tile = tile_at(x[i], y[i], index)
        if tile >= 0 and not 0 < index.tile_number[tile] <= index.tabulated:
            return False
    return True


@lean_kernel
def echo_sources(px: float, py: float, axis_rad: float, index: WallIndex, block: Floats) -> int:
    """Unhidden echo sources within half a cone of CONE_RAD and EAR_REACH_M, nearest first, at most MOST_SOURCES; their number.

    They are in the lists of the block's first receiver [`one_receiver`]. Raises LookupError like `list_sources`.
    """
    set_receiver(block, 0, px, py, math.cos(axis_rad), math.sin(axis_rad))
    return list_sources(1, unit_at(px, py, axis_rad, index), index, (0.0, 1.0, EAR_REACH_M), block)
