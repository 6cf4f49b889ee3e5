# SPDX-License-Identifier: MIT
"""The hypothesis that the trunk is anywhere: a search on a grid, shown by particles that are drawn from it after each move.

In: the input of a `Cloud`. Out: a `Cloud`, once the search has found the place. Owns the grid.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from echostep.arrays import Floats
from echostep.echoes.likelihood import EchoModel
from echostep.height.levels import ClimbSettings, HeightChange
from echostep.localization.grid.search_grid import SearchGrid
from echostep.localization.particles.cloud import Cloud
from echostep.localization.particles.particles import Particles
from echostep.localization.particles.start import Start
from echostep.localization.settings import CloudSettings
from echostep.particles.arrays import Move, PingBatch
from echostep.walls.level_sheet import LevelSheet

# Weight outside of one place below which a search has found it, on one level, and on several, there after this length of search: exact likelihoods
# discriminate between levels that are alike, and need a path to do so; assumed
FOUND_REST, LEVELS_REST, LEVELS_M = 0.03, 0.1, 10.0
SHOWN = 5_000  # particles that show a search
TRACED_M2_RAD = 5.0  # poses that 20,000 particles fill by the sizes of `CloudSettings`: 6,000 cells
SCATTERED_SHARE = 0.8  # weight of a search that stays about its places after a move that was not observed, assumed


class Search(Particles):
    """`grid`: the weights of all poses. `is_on_any_level`: nothing is known of the level."""

    is_searching: ClassVar[bool] = True

    def __init__(
        self, grid: SearchGrid, start: Start, settings: CloudSettings, rng: np.random.Generator, sheet: LevelSheet | None,
        climbing: ClimbSettings,
    ) -> None:  # fmt: skip
        """`grid`: of the start."""
        super().__init__(grid.draw(SHOWN, rng), settings, rng, sheet, climbing, start.lag_variance)
        self.grid = grid
        self.is_on_any_level = sheet is not None and start.is_on_any_level

    def advance(self, move: Move, pings: PingBatch, model: EchoModel) -> float:
        """Move and weigh all states; returns the log of their density of the pings over the density without a plan."""
        return self.grid.advance(move, pings, model)

    def change_levels(self, move: Move, change: HeightChange) -> float:
        """Update heights and levels after a move; returns the log of the mean factor of the weights."""
        del move  # the grid has gone with it
        if self.sheet is None:
            return 0.0
        self._drift(change)
        self.lag_variance, log_mean = self.grid.change_levels(change, self.lag_variance)
        return log_mean

    def found(self) -> Cloud | None:
        """Show the grid as it is now; the cloud, if the search is over: all is in one place, or in few enough for a cloud to trace."""
        self._put(self.grid.draw(SHOWN, self._rng))
        rest, least_m = (FOUND_REST, 0.0) if self.sheet is None else (LEVELS_REST, LEVELS_M)
        is_found = self.grid.densest_share(TRACED_M2_RAD) > 1.0 - FOUND_REST or self.place_share > 1.0 - rest
        if self.grid.path_m < least_m or not is_found:
            return None
        cloud = self._cloud()
        cloud.contract()
        cloud.is_on_any_level = self.is_on_any_level
        return cloud

    def _cloud(self) -> Cloud:
        """As many particles as a cloud may have."""
        poses = self.grid.draw(self._settings.largest, self._rng)
        return Cloud(poses, self._settings, self._rng, self.sheet, self._climbing, self.lag_variance)

    def show_every_state(self) -> None:
        """Make the particles all states of the grid."""
        poses, log_weight = self.grid.every()
        self._put(poses)
        self.log_weight = log_weight

    def reweight(self, log_factor: Floats) -> None:
        """Multiply the weights of all states, which the particles are [`show_every_state`], by factors given as logarithms (n,)."""
        self.grid.reweight(self.log_weight + log_factor)

    def scatter(self, move: Move, change: HeightChange) -> None:
        """Begin again about the places that are reached by an unobserved move, as of a cloud."""
        cloud = self._cloud()
        cloud.scatter(move, change)
        self.grid.begin_about(cloud.x_m, cloud.y_m, cloud.turn_rad, SCATTERED_SHARE)

    def turn_walk_frame(self, by_rad: float) -> None:
        """Rotate all states: the heading in the walk frame has changed while the wearer's heading on the map has not."""
        super().turn_walk_frame(by_rad)
        self.grid.turn_walk_frame(by_rad)
