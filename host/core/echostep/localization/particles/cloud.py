# SPDX-License-Identifier: MIT
"""The cloud: the trunk's position as weighted particles on the plan.

In: moves of the trunk in the walk frame, with the pings on them. Out: a `Cloud` whose moments are the estimate. Owns the particles; draws from the
generator that it is given. Only the filter's kernels go from the walk frame to the map.

A particle is (x, y) on the sheet of levels, `turn` = rotation walk -> map, `scale` = true length / measured length. In a building
of several levels it also has a height `z` and an offset `lag` of the height by pressure.
Weights are logarithms.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import ClassVar, NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.echoes.likelihood import EchoModel
from echostep.echoes.reweighting import CloudModel, MoveProgress, propagate_and_reweight
from echostep.elementary import cos, exp, sin
from echostep.height.levels import (
    ClimbSettings,
    HeightArrays,
    HeightChange,
    change_levels,
    level_change_model,
    set_levels_by_pressure,
)
from echostep.localization.particles.particles import GATHERED_REST, Particles, kld_size, log_mode_weight
from echostep.localization.particles.start import Start
from echostep.localization.settings import CloudSettings
from echostep.particles.arrays import DrawnPoses, Move, PingBatch
from echostep.particles.kernels import NOISE_BEND, effective_size, systematic
from echostep.walls.echo_sources import Walls
from echostep.walls.floor import NO_FLOOR, Floor
from echostep.walls.index import NO_WALLS, WallIndex, crossings
from echostep.walls.level_sheet import LevelSheet, level_of

SCATTERED = 10 / 3  # times the least size above which a cloud is roughened: a gathered one is never that large
START_SIZE = 6_000  # least particles at the start: enough of them in the tails of its distribution (`start`)
LEAST_LEVEL = 0.01  # probability of a level that counts among those on which the trunk may be, assumed
# Particles of a second pass (about a second for 40 m), and roughening (m, rad) of the places tried again: a coarse place is off by this much
PASSING, PASSING_ROUGH = 5_000, (0.5, math.radians(2.0))
# Bend of a particle's way beyond the segment's bend, as a share of it: none to two arcs of a circle: a person turns on the spot, or walks
# round the end of a wall more sharply than an arc
BENDS = (-1.0, 3.0)


class Evidence(NamedTuple):
    """How well a cloud predicted a segment: log of each ping's mean likelihood before its update (k,), and log of the weight that walls left."""

    log_pings: Floats
    log_path: float


def cloud_about(
    settings: CloudSettings, start: Start, walk_heading_rad: float, rng: np.random.Generator, sheet: LevelSheet | None = None,
    climbing: ClimbSettings | None = None, floor: Floor = NO_FLOOR, walls: WallIndex = NO_WALLS,
) -> Cloud:  # fmt: skip
    """The cloud of a start. `walk_heading_rad`: the trunk's heading in the walk frame at the start; without `sheet` there is one level.

    `floor`: for a start that is anywhere. `walls`: a start lies on one side of them.
    """
    x_m, y_m, heading, log_weight = start.draw(settings.largest, floor, sheet, rng, walls)
    z_m = sheet.height_m[level_of(x_m, sheet)] if sheet else np.zeros(len(x_m))
    lag_m = np.full(len(x_m), 0.0 if start.air is None else start.air.zero_m)
    poses = DrawnPoses(x_m, y_m, heading - walk_heading_rad, z_m, lag_m)
    cloud = Cloud(poses, settings, rng, sheet, start.lag_variance, climbing or ClimbSettings())
    cloud.shrink(log_weight)
    return cloud


class Cloud(Particles):
    """Particles as flat arrays of n; `log_weight` is normalised to a maximum of 0.

    A cloud is scattered or contracted by its number of particles, gathered or in one place by its spread: see the properties of these names.
    `is_gathered`: since it last was scattered by an unobserved move, less than GATHERED_REST of its weight was once farther than ROOM_M from its mean
    on the sheet. `is_on_any_level`: a search has found it on several levels, between which the last metres of the path have not yet discriminated.
    """

    is_searching: ClassVar[bool] = False

    is_gathered, is_on_any_level = False, False

    def __init__(
        self, poses: DrawnPoses, settings: CloudSettings, rng: np.random.Generator, sheet: LevelSheet | None,
        lag_variance: float, climbing: ClimbSettings,
    ) -> None:  # fmt: skip
        """`sheet`: of several levels, or None. `lag_variance`: in m2."""
        super().__init__(poses, np.zeros(len(poses.x_m)), sheet, lag_variance, climbing)
        self._settings, self._rng = settings, rng
        self.scale += settings.start_scale_sd * rng.standard_normal(len(self.scale))

    @property
    def particles(self) -> Particles:
        """The cloud: a search has to make its particles."""
        return self

    states = particles

    def shrink(self, log_weight: Floats) -> None:
        """Keep as many of the first particles, which were drawn with these log-weights (n,), as a start needs."""
        count = min(max(self._wanted_size(), START_SIZE), len(self.x_m))
        self.keep(np.arange(count))
        self.log_weight = log_weight[:count]

    def contract(self) -> None:
        """Resample to the size for the spread."""
        self._resample(self.log_weight, self.log_weight, min(self._wanted_size(), self._settings.largest))

    @property
    def is_scattered(self) -> bool:
        """Whether the cloud has more than SCATTERED times its least number of particles; such a cloud is roughened."""
        return len(self.x_m) > SCATTERED * self._least_size

    @property
    def _least_size(self) -> int:
        """Least number of particles: `size` for each level with LEAST_LEVEL of the weight, since few particles would favour one level by chance."""
        if self.sheet is None:
            return self._settings.size
        return self._settings.size * int(np.count_nonzero(self.level_shares > LEAST_LEVEL))

    def propagate_and_reweight(self, move: Move, pings: PingBatch, model: EchoModel, walls: Walls) -> Evidence:
        """Propagate by a move and reweight by each ping on it, where it was triggered; resample whenever too few particles carry the weight.

        A particle that crosses a wall loses its weight. If all do, the plan or the path is wrong: the cloud continues behind the wall, wider. Returns
        how well the cloud predicted the pings and the path.
        """
        log_evidence, log_passed = np.zeros(len(pings.share)), 0.0
        turns, count = move.bend_x_m != 0.0 or move.bend_y_m != 0.0, len(self.x_m)
        # Relative to the bend of BENT of an arc
        self.bend = self._rng.uniform(*BENDS, count) if turns else np.zeros(count)
        progress, settings = MoveProgress(0.0, 0), self._settings
        cloud_model = CloudModel(settings.wall_cost, settings.resample_below, model)
        while progress.share < 1.0 or progress.ping < len(log_evidence):
            rest = 1.0 - progress.share
            noise = self._noise(move, rest)
            index = walls.near(
                self.x_m, self.y_m, rest * math.hypot(move.dx_m, move.dy_m, move.bend_x_m, move.bend_y_m)
            )
            progress, lowest, passed = propagate_and_reweight(
                self.arrays, move, noise, progress, pings, cloud_model, index, self.hidden, log_evidence
            )
            log_passed += passed
            if lowest < -0.5 * settings.wall_cost:  # every particle has crossed a wall
                self.x_m += settings.rescue_sd_m * self._rng.standard_normal(len(self.x_m))
                self.y_m += settings.rescue_sd_m * self._rng.standard_normal(len(self.x_m))
            self.resample_if_needed(index)
        return Evidence(log_evidence, log_passed)

    def change_levels(self, move: Move, change: HeightChange) -> float:
        """Update heights and levels after a move, reweight by them, and resample when too few particles carry the weight.

        Returns the log of the mean factor of the weights.
        """
        if self.sheet is None:
            return 0.0
        self._drift(change)
        noise = self._rng.standard_normal(len(self.x_m))
        heights = HeightArrays(self.z_m, self.lag_m)
        self.lag_variance, log_mean = change_levels(
            self.arrays, heights, move, noise, change, self.lag_variance, level_change_model(self._climbing), self.sheet
        )
        self.resample_if_needed()
        return log_mean

    @contextmanager
    def passing_again(self, dx_m: float, dy_m: float) -> Iterator[None]:
        """Go back to the beginning of the way of (dx, dy) in the walk frame, on every level, for a second pass with few particles."""
        settings = self._settings
        self._settings = replace(settings, largest=min(PASSING, settings.largest))
        levels = len(self.sheet.height_m) if self.sheet else 1
        # Evenly: in a cloud that is not gathered, light places have more particles than by their weight
        chosen = np.unique(np.linspace(0, len(self.x_m) - 1, max(PASSING // levels, 1)).astype(np.int64))
        log_weight = self.log_weight
        self.keep(chosen)
        self.log_weight = log_weight[chosen]
        self._roughen(*PASSING_ROUGH)
        c, s = self.scale * cos(self.turn_rad), self.scale * sin(self.turn_rad)
        self.x_m, self.y_m = self.x_m - (c * dx_m - s * dy_m), self.y_m - (s * dx_m + c * dy_m)
        self.hidden = np.zeros((2, len(self.x_m)))
        if self.sheet:
            self._lay_on_each_level(self.sheet)
        try:
            yield
        finally:
            self._settings = settings

    def _lay_on_each_level(self, sheet: LevelSheet) -> None:
        """Copy every particle to each level; the lag becomes unknown."""
        levels, log_weight = len(sheet.height_m), self.log_weight
        level = np.tile(np.arange(levels), len(self.x_m))
        self.keep(np.repeat(np.arange(len(self.x_m)), levels))
        self.log_weight = np.repeat(log_weight, levels)
        self.x_m = self.map_x_m + level * sheet.pitch_m
        self.z_m = sheet.height_m[level]
        self.forget_lag()

    def scatter(self, move: Move, change: HeightChange | None = None) -> None:
        """Spread by an unobserved move. The level follows the height by pressure, if any."""
        self.keep(systematic(exp(self.log_weight), float(self._rng.random()), self._settings.largest))
        self.is_gathered = False
        noise = self._rng.standard_normal((3, len(self.x_m)))
        self.turn_rad += move.turn_sd_rad * noise[2]
        c, s = cos(self.turn_rad), sin(self.turn_rad)
        self.x_m = self.x_m + c * move.dx_m - s * move.dy_m + move.sd_m * noise[0]
        self.y_m = self.y_m + s * move.dx_m + c * move.dy_m + move.sd_m * noise[1]
        if self.sheet and change and math.isfinite(change.height_sd_m):
            set_levels_by_pressure(self.x_m, HeightArrays(self.z_m, self.lag_m), change.height_m, self.sheet)

    def reweight(self, log_factor: Floats) -> None:
        """Multiply the weights by factors, given as logarithms (n,), and resample when too few particles carry the weight."""
        self.log_weight = self.log_weight + log_factor
        self.log_weight -= self.log_weight.max()
        self.resample_if_needed()

    def resample_if_needed(self, walls: WallIndex = NO_WALLS) -> None:
        """Systematic resampling [Kitagawa 1996] when too few particles carry the weight; roughening moves none of them through a wall.

        Until the cloud is gathered, the number of a mode's particles follows the square root of its weight, and they keep that weight: resampling
        alone would lose the lighter of two modes by chance.
        """
        weight_after = (
            np.zeros(len(self.x_m))
            if self.is_gathered
            else 0.5 * log_mode_weight(self.x_m, self.y_m, self.turn_rad, self.weight)
        )
        wanted_weight = self.log_weight - weight_after
        if effective_size(exp(wanted_weight)) >= self._settings.resample_below * len(self.x_m):
            return
        self._resample(wanted_weight, weight_after, len(self.x_m))
        count = min(self._wanted_size(), self._settings.largest)
        if count != len(self.x_m):
            self._resample(np.zeros(len(self.x_m)), self.log_weight, count)
        self.is_gathered = self.is_gathered or self.far_weight(self.x_m) < GATHERED_REST
        if self.is_scattered:
            self._roughen(self._settings.rough_m, math.radians(self._settings.rough_deg), walls)

    def _resample(self, log_wanted: Floats, log_weight: Floats, count: int) -> None:
        """Keep `count` particles with these log-probabilities (n,), each with its log-weight (n,)."""
        chosen = systematic(exp(log_wanted - log_wanted.max()), float(self._rng.random()), count)
        log_chosen = log_weight[chosen]
        self.keep(chosen)
        self.log_weight = log_chosen - log_chosen.max()

    @property
    def is_in_one_place(self) -> bool:
        """Whether the cloud is gathered, or would be if all levels lay above one another."""
        return self.is_gathered or self.far_weight(self.map_x_m) < GATHERED_REST

    def _noise(self, move: Move, share: float) -> Floats:
        """Noise of this share of a move in x, y, turn and scale of each particle, and of its bend, (5, n)."""
        s, length = self._settings, math.hypot(move.dx_m, move.dy_m)
        sd = math.hypot(move.sd_m, s.step_sd * math.sqrt(length))
        turn_sd = math.hypot(move.turn_sd_rad, math.radians(s.turn_sd_deg) * math.sqrt(length))
        noise = np.empty((5, len(self.x_m)))
        noise[:NOISE_BEND] = self._rng.standard_normal((NOISE_BEND, len(self.x_m)))
        scale_sd = math.hypot(move.scale_sd, s.scale_sd * math.sqrt(length))
        noise[:NOISE_BEND] *= np.array([[sd], [sd], [turn_sd], [scale_sd]]) * math.sqrt(share)
        noise[NOISE_BEND] = self.bend
        return noise

    def _roughen(self, rough_m: float, rough_rad: float, walls: WallIndex = NO_WALLS) -> None:
        """Add noise to a scattered cloud, so that copies of one particle try places between the few that fit [Gordon et al. 1993]."""
        noise = self._rng.standard_normal((3, len(self.x_m)))
        x_m, y_m = self.x_m + rough_m * noise[0], self.y_m + rough_m * noise[1]
        stays = crossings(self.x_m, self.y_m, x_m, y_m, walls)
        self.x_m, self.y_m = np.where(stays, self.x_m, x_m), np.where(stays, self.y_m, y_m)
        self.turn_rad += rough_rad * noise[2]

    def _wanted_size(self) -> int:
        """Size for the present spread."""
        return max(kld_size(self.x_m, self.y_m, self.turn_rad, self._settings), self._least_size)
