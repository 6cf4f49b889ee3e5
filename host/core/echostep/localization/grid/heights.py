# SPDX-License-Identifier: MIT
"""Heights of a search: the evidence of rises and heights by pressure for each level, and for each connector there.

In: `HeightChange`s. Out: `LevelFactors`. Owns heights and offsets of the height by pressure: as in `height.levels`, but common to all states on a
level, and in a connector there, since states on the same stairs have risen by the same path.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.localization.grid.kernels import LevelFactors
from echostep.localization.height.levels import PRESSURE_TAIL, UNKNOWN_LAG_M2, ClimbSettings, HeightChange
from echostep.localization.limits import THREE_SD2
from echostep.localization.particles.start import Start
from echostep.walls.floor import CELL_M
from echostep.walls.level_sheet import LIFT, LevelSheet, end_of_connector, nearest_level


class GridHeights:
    """`lag_m` (levels,): offset of the height by pressure; `z_m` (connectors, levels): height in the plan."""

    def __init__(self, sheet: LevelSheet, climbing: ClimbSettings, start: Start) -> None:
        self._sheet, self._climbing = sheet, climbing
        self._z_m: Floats = np.tile(sheet.height_m, (len(sheet.kind), 1))
        self._lag_m: Floats = np.full(len(sheet.height_m), 0.0 if start.air is None else start.air.zero_m)

    def update(self, change: HeightChange, lag_variance: float) -> tuple[LevelFactors, float]:
        """The factors of a segment, and the variance of the offset after it, given the variance before."""
        sheet, has_pressure = self._sheet, math.isfinite(change.height_sd_m)
        variance = lag_variance + change.height_sd_m**2
        knows_lag = has_pressure and lag_variance < UNKNOWN_LAG_M2
        connectors, levels = self._z_m.shape
        loss, east = np.zeros((connectors + 1, levels)), np.zeros((connectors + 1, levels), np.int32)
        loss[0] = self._loss_by_foot(change.felt_m, change) + self._loss_by_pressure(
            change.height_m - sheet.height_m - self._lag_m, variance
        )
        z_m, lag_m, moved = np.tile(sheet.height_m, (connectors, 1)), self._lag_m.copy(), []
        for c, level in zip(*np.nonzero(sheet.serves), strict=True):
            z, beyond, height_m = self._climbed(int(c), int(level), change, knows_lag=knows_lag)
            to = nearest_level(z, c, sheet)
            innovation = height_m - z - self._lag_m[level]
            loss[c + 1, level] = self._loss_by_foot(beyond, change) + self._loss_by_pressure(innovation, variance)
            east[c + 1, level] = round((to - int(level)) * sheet.pitch_m / CELL_M)
            if to == level:
                z_m[c, level] = z
            else:
                moved.append((c, to, z, self._lag_m[level]))
        for c, to, z, lag in moved:
            z_m[c, to], lag_m[to] = z, lag
        self._z_m = z_m
        gain = lag_variance / variance if has_pressure else 0.0
        innovation = change.height_m - sheet.height_m - lag_m
        if has_pressure and not self._is_climbing(change):
            lag_m += np.where(innovation**2 < THREE_SD2 * variance, gain * innovation, 0.0)
        self._lag_m = lag_m
        return LevelFactors(np.exp(loss.min() - loss).astype(np.float32), east, -float(loss.min())), (
            1.0 - gain
        ) * lag_variance

    def of(self, level: Ints, connector: Ints) -> tuple[Floats, Floats]:
        """Heights and offsets (n,) on these levels, in these connectors."""
        z_m = np.vstack([self._sheet.height_m, self._z_m])
        return z_m[connector + 1, level], self._lag_m[level]

    def _climbed(self, c: int, level: int, change: HeightChange, *, knows_lag: bool) -> tuple[float, float, float]:
        """Height in a connector, how far it would be beyond its ends, and the height by pressure to compare it with."""
        z, margin = self._z_m[c, level], self._climbing.landing_sd_m
        if self._sheet.kind[c] != LIFT and math.isfinite(change.felt_sd_m):
            z += change.felt_m
            end = end_of_connector(z, c, margin, self._sheet)
            return end, z - end, change.height_m
        if knows_lag:
            z = end_of_connector(change.riding_m - self._lag_m[level], c, margin, self._sheet)
            return z, 0.0, change.riding_m
        return z, 0.0, change.height_m

    def _is_climbing(self, change: HeightChange) -> bool:
        return math.isfinite(change.felt_sd_m) and abs(change.felt_m) > 2.0 * self._climbing.flat_sd_m

    def _loss_by_foot(self, rise_m: float, change: HeightChange) -> float:
        """Log-weight that a measured rise costs where no rise is possible."""
        if not math.isfinite(change.felt_sd_m):
            return 0.0
        sd_m = math.hypot(self._climbing.flat_sd_m, change.felt_sd_m)
        return float(min(0.5 * (rise_m / sd_m) ** 2, self._climbing.unlikely))

    def _loss_by_pressure(self, innovation_m: Floats | float, variance: float) -> Floats:
        """Log-weight that an innovation of the height by pressure costs."""
        if math.isinf(variance):
            return np.zeros_like(innovation_m)
        loss = 2.0 * np.log1p(np.square(innovation_m) / (PRESSURE_TAIL * variance))
        return np.asarray(np.minimum(loss, self._climbing.unlikely))
