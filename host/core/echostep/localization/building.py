# SPDX-License-Identifier: MIT
"""Data of a plan, shared by all filters on it.

In: walls, sheet of levels. Out: `Building`. Owns the walkable floor, and the tables of echoes, made when a cloud first needs them.
"""

from __future__ import annotations

import numpy as np

from echostep.arrays import Floats
from echostep.echoes.likelihood import EchoModel
from echostep.echoes.range_table import range_table_of
from echostep.echoes.unplanned import Background, background
from echostep.elementary import dot, weighted_covariance
from echostep.height.levels import UpperLevels
from echostep.localization.cloud_estimate import Moments
from echostep.localization.grid.cells import GridCells, grid_cells
from echostep.localization.particles.start import DrawnPlaces
from echostep.plan import Plan
from echostep.walls.echo_sources import Walls
from echostep.walls.floor import Floor, indoors, walkable_floor
from echostep.walls.level_sheet import LaidOutPlan, LevelSheet, level_of


class Building:
    """Data of a plan, shared by all filters on it: walls, sheet of levels, floor; tables are made when a cloud first needs them."""

    def __init__(self, walls: Walls, sheet: LevelSheet | None = None, drawn: DrawnPlaces | None = None) -> None:
        """`sheet`: None after this, if it has one level. `drawn`: how well its places are known, if it was drawn by a walk."""
        self.walls, self.drawn = walls, drawn or DrawnPlaces()
        self.sheet = sheet if sheet is not None and len(sheet.height_m) > 1 else None
        self.floor = walkable_floor(walls.index.walls)
        self.indoors = indoors(self.floor)
        self.upper_levels = (
            UpperLevels(self.floor, self.sheet) if self.sheet is not None and len(self.floor.x_m) else None
        )
        self.elsewhere = _elsewhere(self.floor, self.sheet)
        self._backgrounds: dict[EchoModel, Background] = {}
        self._cells: dict[EchoModel, GridCells] = {}

    @classmethod
    def of(cls, plan: Plan, laid_out: LaidOutPlan) -> Building:
        """The building of a plan whose levels are laid out so."""
        return cls(laid_out.walls, laid_out.sheet, DrawnPlaces(plan.levels))

    @property
    def has_walls(self) -> bool:
        """Whether the plan has walls, so that echoes carry information."""
        return len(self.walls.index.walls) > 0

    @property
    def levels(self) -> int:
        """Number of levels of the plan."""
        return 1 if self.sheet is None else len(self.sheet.height_m)

    def background(self, model: EchoModel) -> Background:
        """Density of the echoes of a wearer anywhere on the floor."""
        if model not in self._backgrounds:
            self._backgrounds[model] = background(self.walls, self.floor, model)
        return self._backgrounds[model]

    def cells(self, model: EchoModel) -> GridCells:
        """The cells of a search, with the ranges to expect in them."""
        if model not in self._cells:
            table = range_table_of(self.walls, self.floor, model)
            self._cells[model] = grid_cells(self.walls.index, table, self.sheet, self.upper_levels)
        return self._cells[model]

    def log_loss_in_air(self, x_m: Floats, y_m: Floats, path_m: float) -> Floats | None:
        """Loss of log-weight (n,) on this length of path, of particles in the air beside an upper level; None if there are none."""
        return None if self.upper_levels is None or path_m <= 0.0 else self.upper_levels.log_loss(x_m, y_m, path_m)

    def weight_outside(self, x_m: Floats, y_m: Floats, weight: Floats) -> float:
        """Weight of particles (n,) outside of the building; 0 where walls enclose no floor."""
        return 0.0 if self.indoors is None else dot(weight, ~self.indoors.holds(x_m, y_m))


def _elsewhere(floor: Floor, sheet: LevelSheet | None) -> Moments | None:
    """Moments of the floor, all levels above one another; None for a plan without a floor."""
    if not len(floor.x_m):
        return None
    x = floor.x_m if sheet is None else floor.x_m - level_of(floor.x_m, sheet) * sheet.pitch_m
    (xx, xy), (_, yy) = weighted_covariance(np.column_stack([x, floor.y_m]), np.full(len(x), 1.0 / len(x))).tolist()
    return Moments(float(x.mean()), float(floor.y_m.mean()), xx, xy, yy, 0.0, 0.0)
