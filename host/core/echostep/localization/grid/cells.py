# SPDX-License-Identifier: MIT
"""The cells of a building on the sheet of levels: the ranges to expect in each, and the walls between two cells.

In: walls, their floor, the table of expected ranges. Out: `GridCells`, plain arrays for kernels. Owns nothing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Int32s, Ints
from echostep.echoes.range_table import UNKNOWN, Entries, RangeTable
from echostep.height.levels import UpperLevels
from echostep.jit import kernel
from echostep.walls.floor import CELL_M
from echostep.walls.index import WallIndex, crosses_wall
from echostep.walls.level_sheet import LevelSheet, connector_at, level_of, level_on_sheet

OUTSIDE_M = 10.0  # width of the ground about the floor that a search covers, assumed
EAST_WALL, NORTH_WALL, CLOSED = 1, 2, 4  # bits of `barrier`
NO_CONNECTOR = -1

Bytes = np.ndarray[tuple[int], np.dtype[np.uint8]]
Shorts = np.ndarray[tuple[int], np.dtype[np.int16]]


class GridCells(NamedTuple):
    """Cells of CELL_M in rows of `columns` from (x0_m, y0_m) on; each array is (cells,) unless stated otherwise, all rows one after the other.

    `barrier`: bits EAST_WALL, NORTH_WALL: a wall lies between the middles of the cell and of its neighbour; CLOSED: no trunk can be there (edge of
    the grid, air beside an upper level). `connector`: number of the connector that holds it. `level` (columns,): level of each column. `row`: its
    column of `expected` (SECTORS, floor), or UNKNOWN.
    """

    x0_m: float
    y0_m: float
    columns: int
    barrier: Bytes
    connector: Shorts
    level: Ints
    row: Int32s
    expected: Entries

    def cell_of(self, x_m: Floats, y_m: Floats) -> Int32s:
        """The cell (n,) of each place on the sheet, -1 beyond the grid."""
        column, line = np.floor((x_m - self.x0_m) / CELL_M), np.floor((y_m - self.y0_m) / CELL_M)
        rows = len(self.row) // self.columns
        within = (column >= 0) & (column < self.columns) & (line >= 0) & (line < rows)
        return np.where(within, line * self.columns + column, -1.0).astype(np.int32)


def grid_cells(walls: WallIndex, table: RangeTable, sheet: LevelSheet | None, upper: UpperLevels | None) -> GridCells:
    """The cells of a floor and of the ground within OUTSIDE_M of it; `upper`: levels beside which there is air."""
    around = math.ceil(OUTSIDE_M / CELL_M)
    row = np.pad(table.row, around, constant_values=UNKNOWN)
    rows, columns = row.shape
    x0, y0 = table.x0_m - around * CELL_M, table.y0_m - around * CELL_M
    x: Floats = x0 + (np.arange(columns, dtype=np.float64) + 0.5) * CELL_M
    y: Floats = y0 + (np.arange(rows, dtype=np.float64) + 0.5) * CELL_M
    barrier = _barriers(x0, y0, row, walls).ravel()
    level, connector = np.zeros(columns, np.int64), np.full(len(barrier), NO_CONNECTOR, np.int16)
    if sheet is not None and len(sheet.height_m) > 1:
        level = level_of(x, sheet)
        _lay_connectors(x, y, connector, sheet)
    if upper is not None:
        loss = upper.log_loss(np.tile(x, rows), np.repeat(y, columns), 1.0)
        if loss is not None:
            barrier[loss < 0.0] |= CLOSED
    edge = np.ones((rows, columns), np.bool_)
    edge[1:-1, 1:-1] = False
    barrier[edge.ravel()] |= CLOSED
    return GridCells(x0, y0, columns, barrier, connector, level, row.ravel(), np.ascontiguousarray(table.expected.T))


@kernel
def _barriers(x0: float, y0: float, row: Int32s, walls: WallIndex) -> np.ndarray[tuple[int, int], np.dtype[np.uint8]]:
    """The walls to the east and to the north of each cell's middle."""
    rows, columns = row.shape
    barrier = np.zeros((rows, columns), np.uint8)
    for r in range(rows):
        for c in range(columns):
            x, y = x0 + (c + 0.5) * CELL_M, y0 + (r + 0.5) * CELL_M
            if crosses_wall(x, y, x + CELL_M, y, walls):
                barrier[r, c] |= EAST_WALL
            if crosses_wall(x, y, x, y + CELL_M, walls):
                barrier[r, c] |= NORTH_WALL
    return barrier


@kernel
def _lay_connectors(x: Floats, y: Floats, connector: Shorts, sheet: LevelSheet) -> None:
    """Write the connector that holds the middle of each cell; `x` (columns,), `y` (rows,) on the sheet."""
    for c in range(len(x)):
        level = level_on_sheet(x[c], sheet)
        for r in range(len(y)):
            connector[r * len(x) + c] = connector_at(x[c] - level * sheet.pitch_m, y[r], level, sheet)
