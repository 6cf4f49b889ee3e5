# SPDX-License-Identifier: MIT
"""Heights of a search: the evidence of rises and heights by pressure for each level, and for each connector there.

In: `HeightChange`s. Out: `LevelFactors`. Owns heights and offsets of the height by pressure: as in `height.levels`, but common to all states on a
level, and in a connector there, since states on the same stairs have risen by the same path.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.elementary import exp
from echostep.height.levels import (
    UNKNOWN_LAG_M2,
    ClimbSettings,
    HeightChange,
    climb,
    level_change_model,
    pressure_cost,
    rise_cost,
)
from echostep.localization.grid.kernels import LevelFactors
from echostep.localization.particles.start import Start
from echostep.particles.limits import THREE_SD2
from echostep.walls.floor import CELL_M
from echostep.walls.level_sheet import LevelSheet, nearest_level


class GridHeights:
    """`lag_m` (levels,): offset of the height by pressure; `z_m` (connectors, levels): height in the plan."""

    def __init__(self, sheet: LevelSheet, climbing: ClimbSettings, start: Start) -> None:
        self._sheet, self._model = sheet, level_change_model(climbing)
        self._z_m: Floats = np.tile(sheet.height_m, (len(sheet.kind), 1))
        self._lag_m: Floats = np.full(len(sheet.height_m), 0.0 if start.air is None else start.air.zero_m)

    def update(self, change: HeightChange, lag_variance: float) -> tuple[LevelFactors, float]:
        """The factors of a segment, and the variance of the offset after it, given the variance before."""
        sheet, model, variance = self._sheet, self._model, lag_variance + change.height_sd_m**2
        knows_lag = math.isfinite(variance) and lag_variance < UNKNOWN_LAG_M2
        connectors, levels = self._z_m.shape
        cost, east = np.zeros((connectors + 1, levels)), np.zeros((connectors + 1, levels), np.int32)
        innovation_m = change.height_m - sheet.height_m - self._lag_m
        cost[0] = rise_cost(change.felt_m, change, model)
        cost[0] += [pressure_cost(off_m, variance, model) for off_m in innovation_m.tolist()]
        z_m, lag_m, moved = np.tile(sheet.height_m, (connectors, 1)), self._lag_m.copy(), []
        for c, level in zip(*np.nonzero(sheet.serves), strict=True):
            lag = self._lag_m[level]
            z, beyond, height_m = climb(self._z_m[c, level], lag, change.felt_m, c, knows_lag, change, model, sheet)
            to = nearest_level(z, c, sheet)
            cost[c + 1, level] = rise_cost(beyond, change, model) + pressure_cost(height_m - z - lag, variance, model)
            east[c + 1, level] = round((to - int(level)) * sheet.pitch_m / CELL_M)
            if to == level:
                z_m[c, level] = z
            else:
                moved.append((c, to, z, lag))
        for c, to, z, lag in moved:
            z_m[c, to], lag_m[to] = z, lag
        self._z_m = z_m
        gain = lag_variance / variance if math.isfinite(variance) else 0.0
        if math.isinf(change.felt_sd_m) or abs(change.felt_m) <= 2.0 * model.flat_sd_m:
            innovation_m = change.height_m - sheet.height_m - lag_m
            lag_m += np.where(innovation_m**2 < THREE_SD2 * variance, gain * innovation_m, 0.0)
        self._lag_m = lag_m
        factors = LevelFactors(exp(cost.min() - cost).astype(np.float32), east, -float(cost.min()))
        return factors, (1.0 - gain) * lag_variance

    def of(self, level: Ints, connector: Ints) -> tuple[Floats, Floats]:
        """Heights and offsets (n,) on these levels, in these connectors."""
        z_m = np.vstack([self._sheet.height_m, self._z_m])
        return z_m[connector + 1, level], self._lag_m[level]
