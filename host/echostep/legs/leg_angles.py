# SPDX-License-Identifier: MIT
"""Angles of thigh and shank against the vertical: the integrated rates, less the gyros' errors, from a level that gyros do not measure.

In: the grid of integrated rates, signs, moments at which the leg stands, begins and ends of strides. Out: angles between two grid indices. Owns the
gyros' errors and the level.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from echostep.arrays import Floats
from echostep.legs.angle_grid import AngleGrid
from echostep.legs.gyro_bias import GyroBias
from echostep.legs.kinematics import knee_at
from echostep.legs.level import MEAN_RAD, MEAN_SD_RAD, STANDING_RAD, Level
from echostep.legs.swing_detection import GRID_HZ, heel_strike_index
from echostep.legs.walking_bout import climbs

Signs = tuple[float, float]
CLOSURE_SD_RAD = math.radians(2.5)  # of the change of an angle over a stride; by reason
# Of the rate of a standing leg over a window of rest, by sway; windows overlap seven times, so the sd of one is the root of 7 times 0.7 deg/s.
REST_SD_RAD_S = math.radians(1.9)
UPRIGHT_RANGE_RAD = math.radians(74.0)  # range of the shank in a usual stride, by the curves of `kinematics`


class LegAngles:
    """`bias`: errors of the gyros of thigh and shank. `level`: the angles at one grid index."""

    def __init__(self, grid: AngleGrid) -> None:
        self.bias = (GyroBias(), GyroBias())
        self.level = Level()
        self._rested = Level()  # when the standing under way began
        self._grid = grid

    def between(self, signs: Signs, begin: int, end: int) -> tuple[Floats, Floats]:
        """Angles (n,) of thigh and shank at grid indices begin..end, from the level with the present biases.

        A turn between these indices is taken as even for its leak, so that the pelvis' rotation to and fro adds nothing.
        """
        level, grid = self.level, self._grid
        indices = np.arange(begin, end + 1)
        yaw = np.linspace(grid.yaw[begin], grid.yaw[end], len(indices)) - grid.yaw[level.index]
        found = []
        for turned, sign, bias, start in zip(
            (grid.thigh, grid.shank), signs, self.bias, (level.thigh, level.shank), strict=True
        ):
            angle = sign * (np.array(turned[begin : end + 1]) - turned[level.index])
            found.append(start + angle - bias.value * (indices - level.index) / GRID_HZ - bias.leak * yaw)
        return found[0], found[1]

    def begin_rest(self, signs: Signs, first: int, k: int) -> None:
        """The leg has stood from grid index `first` to `k`."""
        thigh, shank = self.between(signs, first, k)
        self._rested = Level(float(thigh[-1]), float(shank[-1]), k, self.level.moved(0.0, 0.0, k).variance)

    def learn_rest(self, signs: Signs, rates: Floats, rested_s: float, k: int) -> None:
        """Update gyros' errors and level by the mean rates (2,) of a leg that has stood for `rested_s` until grid index k."""
        for bias, sign, rate in zip(self.bias, signs, rates.tolist(), strict=True):
            bias.learn(sign * rate, REST_SD_RAD_S)
        rested = self._rested.standing(rested_s)
        self.level = Level(rested.thigh, rested.shank, k, rested.variance)

    def learn_closure(self, signs: Signs, begin: int, end: int) -> None:
        """Update the gyros' errors by the change of the angles over a stride, which is 0 but for bias and leak."""
        span_s, grid = (end - begin) / GRID_HZ, self._grid
        turned = (grid.yaw[end] - grid.yaw[begin]) / span_s
        for bias, sign, angle in zip(self.bias, signs, (grid.thigh, grid.shank), strict=True):
            bias.learn(sign * (angle[end] - angle[begin]) / span_s, CLOSURE_SD_RAD / span_s, turned)

    def correct_level(self, signs: Signs, begin: int, end: int) -> None:
        """Correct the level by the mean angles of a stride; a shorter one is nearer to standing, and on stairs they are others."""
        thigh, shank = self.between(signs, begin, end)
        strike = heel_strike_index(shank)
        phase = (np.arange(strike, len(shank)) - strike) / (len(shank) - 1)
        self.level = Level(float(thigh[0]), float(shank[0]), begin, self.level.variance)
        if climbs(*knees(phase, thigh[strike:], shank[strike:])):
            return
        share = min(float(np.ptp(shank)) / UPRIGHT_RANGE_RAD, 1.0)
        usual = (s + share * (m - s) for s, m in zip(STANDING_RAD, MEAN_RAD, strict=True))
        off = tuple(u - float(angle.mean()) for u, angle in zip(usual, (thigh, shank), strict=True))
        self.level = self.level.corrected((off[0], off[1]), MEAN_SD_RAD)

    def forget_level(self, k: int = 0) -> None:
        """Nothing is known of the level from grid index k on."""
        self.level = Level(index=k)

    def drop(self, k: int) -> None:
        """Forget the first k grid points."""
        self.level, self._rested = (replace(level, index=level.index - k) for level in (self.level, self._rested))


def knees(phase: Floats, thigh: Floats, shank: Floats) -> tuple[float, float]:
    """Flexion of the knee (rad) at the strike and half a stride later, from angles (n,) at phases (n,)."""
    return knee_at(phase, thigh, shank, wanted_phase=0.02), knee_at(phase, thigh, shank, wanted_phase=0.5)
