# SPDX-License-Identifier: MIT
"""Weighted particles as a struct of arrays, and the values read from them.

In: arrays of n particles. Out: levels, weights, places, how many particles a cloud keeps. Owns the arrays.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.elementary import dot, exp, log, product
from echostep.height.levels import UNKNOWN_LAG_M2, Air, ClimbSettings, HeightChange, drift_m
from echostep.localization.particles.places import hypotheses
from echostep.localization.settings import CloudSettings
from echostep.particles.arrays import DrawnPoses, ParticleArrays
from echostep.particles.limits import ROOM_M
from echostep.walls.level_sheet import LevelSheet, level_of

# A cloud is gathered when less than this weight is farther than ROOM_M from its mean, assumed
GATHERED_REST = 1e-4
# Until a cloud is gathered, particles in one cell of these sizes are one mode: a doorway, a turn into a room
MODE_M, MODE_RAD = 2.0, math.radians(45.0)
LEAST_MODE = 1e-3  # weight below which a mode's particles become fewer in proportion, assumed
MOST_MODES = 1_000_000  # cells beyond which modes are not distinguished: memory
KLD_QUANTILE = 2.33  # z of 99 % [Fox 2003, eq. 7]


class PressureLag:
    """What is known of the offset of the height by pressure: `lag_variance` in m2, the same for all particles."""

    def __init__(self, lag_variance: float, climbing: ClimbSettings) -> None:
        self.lag_variance, self._climbing = lag_variance, climbing

    def forget_lag(self) -> None:
        """Make the lag unknown: the barometer may have restarted."""
        self.lag_variance = UNKNOWN_LAG_M2

    def let_lag_drift(self, pause_s: float) -> None:
        """Let the variance of the lag grow over a pause without measurements."""
        drifted_m2 = self.lag_variance + drift_m(self._climbing, pause_s) ** 2
        self.lag_variance = min(drifted_m2, UNKNOWN_LAG_M2)

    def _drift(self, change: HeightChange) -> None:
        """Let the variance of the lag grow by the time of a segment with pressure."""
        if math.isfinite(change.height_sd_m):
            self.lag_variance += self._climbing.drift_m**2 * change.span_s


class Particles(PressureLag):
    """Flat arrays of n particles on the sheet of levels; `log_weight` is normalised to a maximum of 0.

    `carried`: arrays (n, ...) of the filter's aids, resampled with the particles.
    """

    def __init__(
        self, poses: DrawnPoses, log_weight: Floats, sheet: LevelSheet | None, lag_variance: float, climbing: ClimbSettings
    ) -> None:  # fmt: skip
        """Particles of which nothing else is known. `sheet`: of several levels, or None."""
        super().__init__(lag_variance, climbing)
        self.sheet, self.log_weight = sheet, log_weight
        self.x_m, self.y_m, self.turn_rad, self.z_m, self.lag_m = poses
        self.scale, self.bend = np.ones(len(self.x_m)), np.zeros(len(self.x_m))
        self.hidden = np.zeros((2, len(self.x_m)))
        self.carried: tuple[Floats, ...] = ()

    @property
    def air(self) -> Air | None:
        """Mean and standard deviation of the lag of the height by pressure; None if it is unknown."""
        if self.sheet is None or self.lag_variance >= UNKNOWN_LAG_M2:
            return None
        weight = self.weight
        mean = dot(weight, self.lag_m)
        return Air(mean, math.sqrt(self.lag_variance + dot(weight, (self.lag_m - mean) ** 2)))

    def turn_walk_frame(self, by_rad: float) -> None:
        """Rotate all particles: the heading in the walk frame has changed while the wearer's heading on the map has not."""
        self.turn_rad = self.turn_rad + by_rad

    @property
    def level(self) -> Ints:
        """Level of each particle (n,), an index into the plan's."""
        return level_of(self.x_m, self.sheet) if self.sheet else np.zeros(len(self.x_m), np.int64)

    @property
    def map_x_m(self) -> Floats:
        """East of each particle in the map (n,), on any level."""
        return self.x_m - self.level * self.sheet.pitch_m if self.sheet else self.x_m

    @property
    def pitch_m(self) -> float:
        """How far east of the level below it each level lies on the sheet."""
        return self.sheet.pitch_m if self.sheet else 0.0

    @property
    def arrays(self) -> ParticleArrays:
        """The particles as kernels take them: these arrays, not copies."""
        return ParticleArrays(self.x_m, self.y_m, self.turn_rad, self.scale, self.log_weight)

    @property
    def weight(self) -> Floats:
        """Weights (n,) that sum to 1."""
        weight = exp(self.log_weight)
        weight /= weight.sum()
        return weight

    @property
    def hidden_share(self) -> float:
        """Probability that the view of a ranger is hidden, mean of both."""
        return float(product(self.hidden, self.weight).mean())

    @property
    def place_share(self) -> float:
        """Weight of the likeliest place, on any level; 0 if none has enough to be listed."""
        places = hypotheses(self.map_x_m, self.y_m, np.zeros(len(self.x_m), np.int64), self.turn_rad, self.weight)
        return places[0].probability if places else 0.0

    @property
    def level_shares(self) -> Floats:
        """Weight on each level of the plan (levels,)."""
        if self.sheet is None:
            return np.ones(1)
        return np.asarray(np.bincount(self.level, self.weight, len(self.sheet.height_m)), np.float64)

    def far_weight(self, x_m: Floats) -> float:
        """Weight further than ROOM_M from the mean, by x (n,) on the sheet or in the map."""
        weight = self.weight
        far = np.hypot(x_m - dot(weight, x_m), self.y_m - dot(weight, self.y_m)) > ROOM_M
        return dot(weight, far)

    def keep(self, chosen: Ints) -> None:
        """Replace the particles by the chosen ones (m,), with equal weights."""
        self.x_m, self.y_m = self.x_m[chosen], self.y_m[chosen]
        self.turn_rad, self.scale = self.turn_rad[chosen], self.scale[chosen]
        self.z_m, self.lag_m, self.bend = self.z_m[chosen], self.lag_m[chosen], self.bend[chosen]
        self.carried = tuple(each[chosen] for each in self.carried)
        self.hidden = np.ascontiguousarray(self.hidden[:, chosen])
        self.log_weight = np.zeros(len(chosen))


def log_mode_weight(x_m: Floats, y_m: Floats, turn_rad: Floats, weight: Floats) -> Floats:
    """Log of the weight (n,) of all particles in the same cell of MODE_M, MODE_M and MODE_RAD; at least LEAST_MODE."""
    east, north = np.floor((x_m - x_m.min()) / MODE_M), np.floor((y_m - y_m.min()) / MODE_M)
    sectors = round(2.0 * math.pi / MODE_RAD)
    sector = np.floor(turn_rad / MODE_RAD).astype(np.int64) % sectors
    columns, rows = int(east.max()) + 1, int(north.max()) + 1
    if columns * rows > MOST_MODES:
        return np.zeros(len(x_m))
    cell = (east.astype(np.int64) * rows + north.astype(np.int64)) * sectors + sector
    mass = np.bincount(cell, weight)
    return log(np.maximum(mass, LEAST_MODE))[cell]


def kld_size(x_m: Floats, y_m: Floats, turn_rad: Floats, settings: CloudSettings) -> int:
    """Size for the spread of particles (n,), from the number of cells that hold some [Fox 2003, eq. 7]; 0 where all are in one."""
    cells = np.floor(x_m / settings.cell_m)
    cells += 1e6 * np.floor(y_m / settings.cell_m)
    cells += 1e12 * np.floor(turn_rad / math.radians(settings.cell_deg))
    cells.sort()
    k = np.count_nonzero(cells[1:] != cells[:-1])
    if k < 1:
        return 0
    part = 2.0 / (9.0 * k)
    return int(k / (2.0 * settings.kld) * (1.0 - part + math.sqrt(part) * KLD_QUANTILE) ** 3)
