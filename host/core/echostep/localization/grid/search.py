# SPDX-License-Identifier: MIT
"""The hypothesis that the trunk is anywhere: a search on a grid.

In: the input of a `Cloud`. Out: a `Cloud`, once the search has found the place. Owns the grid.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from echostep.arrays import Floats
from echostep.height.levels import ClimbSettings, HeightChange
from echostep.localization.grid.search_grid import SearchGrid
from echostep.localization.particles.cloud import Cloud
from echostep.localization.particles.particles import Particles, PressureLag
from echostep.localization.particles.start import Start
from echostep.localization.settings import CloudSettings
from echostep.particles.arrays import Move
from echostep.walls.level_sheet import LevelSheet

# Weight outside of one place below which a search has found it, on one level, and on several, there after this length of search: exact likelihoods
# discriminate between levels that are alike, and need a path to do so; assumed
FOUND_REST, LEVELS_REST, LEVELS_M = 0.03, 0.1, 10.0
TRACED_M2_RAD = 5.0  # poses that 20,000 particles fill by the sizes of `CloudSettings`: 6,000 cells
SCATTERED_SHARE = 0.8  # weight of a search that stays about its places after a move that was not observed, assumed


class Search(PressureLag):
    """`grid`: the weights of all poses. `is_on_any_level`: nothing is known of the level."""

    is_searching: ClassVar[bool] = True

    def __init__(
        self, grid: SearchGrid, start: Start, settings: CloudSettings, rng: np.random.Generator, sheet: LevelSheet | None,
        climbing: ClimbSettings,
    ) -> None:  # fmt: skip
        """`grid`: of the start."""
        super().__init__(start.lag_variance, climbing)
        self.grid, self.sheet = grid, sheet
        self._settings, self._rng = settings, rng
        self.is_on_any_level = sheet is not None and start.is_on_any_level

    @property
    def particles(self) -> Particles:
        """All states of the grid."""
        return Particles(*self.grid.every(), self.sheet, self.lag_variance, self._climbing)

    def change_levels(self, move: Move, change: HeightChange) -> float:
        """Update heights and levels after a move; returns the log of the mean factor of the weights."""
        del move  # the grid has gone with it
        if self.sheet is None:
            return 0.0
        self._drift(change)
        self.lag_variance, log_mean = self.grid.change_levels(change, self.lag_variance)
        return log_mean

    def found(self) -> Cloud | None:
        """The cloud, if the search is over: all is in one place, or in few enough for a cloud to trace."""
        rest, least_m = (FOUND_REST, 0.0) if self.sheet is None else (LEVELS_REST, LEVELS_M)
        if self.grid.path_m < least_m:
            return None
        if self.grid.densest_share(TRACED_M2_RAD) <= 1.0 - FOUND_REST and self.particles.place_share <= 1.0 - rest:
            return None
        cloud = self.draw(self._settings.largest)
        cloud.contract()
        cloud.is_on_any_level = self.is_on_any_level
        return cloud

    def draw(self, count: int) -> Cloud:
        """A cloud of so many particles."""
        poses = self.grid.draw(count, self._rng)
        return Cloud(poses, self._settings, self._rng, self.sheet, self.lag_variance, self._climbing)

    def reweight(self, log_factor: Floats) -> None:
        """Multiply the weights of all states by factors, given as logarithms (n,)."""
        self.grid.reweight(log_factor)

    def scatter(self, move: Move, change: HeightChange) -> None:
        """Begin again about the places that are reached by an unobserved move, as of a cloud."""
        cloud = self.draw(self._settings.largest)
        cloud.scatter(move, change)
        self.grid.begin_about(cloud.x_m, cloud.y_m, cloud.turn_rad, SCATTERED_SHARE)

    def turn_walk_frame(self, by_rad: float) -> None:
        """Rotate all states: the heading in the walk frame has changed while the wearer's heading on the map has not."""
        self.grid.turn_walk_frame(by_rad)
