# SPDX-License-Identifier: MIT
"""Which places are inside the building.

In: its walkable floor. Out: for places on the sheet, whether they are indoors. Owns a grid.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echostep.arrays import Bools, Floats
from echostep.walls.floor import CELL_M, Floor

WALL_CELLS = 2  # cells about an indoor one that count as indoors: those under the walls, half a metre


@dataclass(frozen=True, slots=True)
class Indoors:
    """A grid of cells from (`west_m`, `south_m`) on, with a margin of cells that are outside: `inside` (rows, columns)."""

    west_m: float
    south_m: float
    inside: Bools

    def holds(self, x_m: Floats, y_m: Floats) -> Bools:
        """Whether places (n,) are indoors."""
        rows, columns = self.inside.shape
        column = np.clip(np.floor((x_m - self.west_m) / CELL_M), 0, columns - 1).astype(np.int64)
        row = np.clip(np.floor((y_m - self.south_m) / CELL_M), 0, rows - 1).astype(np.int64)
        held: Bools = self.inside[row, column]
        return held


def indoors(floor: Floor) -> Indoors | None:
    """The cells of a floor that walls enclose, and those under adjacent walls; None if walls enclose none."""
    x_m, y_m = floor.x_m[floor.enclosed], floor.y_m[floor.enclosed]
    return inside_grid(x_m, y_m) if len(x_m) else None


def inside_grid(x_m: Floats, y_m: Floats) -> Indoors:
    """The grid of cells with these centres (n,), n > 0, and of the cells under adjacent walls."""
    margin = WALL_CELLS + 1
    west_m, south_m = (float(v.min()) - (margin + 0.5) * CELL_M for v in (x_m, y_m))
    column, row = (np.rint((v - low) / CELL_M - 0.5).astype(np.int64) for v, low in ((x_m, west_m), (y_m, south_m)))
    inside = np.zeros((int(row.max()) + margin + 1, int(column.max()) + margin + 1), np.bool_)
    inside[row, column] = True
    for axis in (0, 1):  # the margin holds what goes round
        inside = np.logical_or.reduce([np.roll(inside, by, axis) for by in range(-WALL_CELLS, WALL_CELLS + 1)])
    return Indoors(west_m, south_m, inside)
