# SPDX-License-Identifier: MIT
"""Angles of thigh and shank against the vertical: the integrated rates, less the gyros' errors, from a level that gyros do not measure.

In: the grid of integrated rates, signs, moments of standing, beginnings and ends of strides. Out: angles between two grid indices. Owns the
gyros' errors and the level.

Gyros do not measure the angles at one moment: a Kalman filter, `SwingAngles`, estimates them from the angles while standing and their mean
over a stride.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from echostep.arrays import Floats
from echostep.legs.angle_grid import AngleGrid
from echostep.legs.gyro_bias import GyroBias
from echostep.legs.swing_detection import GRID_HZ, heel_strike_index
from echostep.legs.walking_bout import climbs

# Assumed, not measured, where no source is named.
STANDING_RAD = (0.0, math.radians(-3.0))  # thigh, shank: the weight is in front of the ankles
MEAN_RAD = (math.radians(7.0), math.radians(-14.2))  # over a stride, from the curves of `kinematics`
STANDING_SD_RAD = math.radians(4.0)  # of standing persons; a foot is often a little ahead
BRIEF_SD_RAD, BRIEF_S = math.radians(12.0), 1.0  # of a shorter rest: it may be one between two steps, legs apart
# Of people's mean angles [offsets of sagittal angles: Kadaba 1990], which all strides share
MEAN_SD_RAD = math.radians(8.0)
STRIDE_SD_RAD = math.radians(1.5)  # growth in a stride: soft tissue
UNKNOWN_SD_RAD = math.radians(20.0)  # before anything is known
Signs = tuple[float, float]
# Of the change of a mean angle from stride to stride, and at the first stride of a walk, whose first swing is smaller, assumed.
CLOSURE_SD_RAD, FIRST_CLOSURE_SD_RAD = math.radians(1.5), math.radians(5.0)
# Of the rate of a standing leg over a window of rest, due to sway; windows overlap seven times, so the sd of one is the root of 7 times 0.7 deg/s.
REST_SD_RAD_S = math.radians(1.9)
UPRIGHT_RANGE_RAD = math.radians(74.0)  # range of the shank in a usual stride, from the curves of `kinematics`


@dataclass(frozen=True, slots=True)
class SwingAngles:
    """`thigh`, `shank`: angles (rad, forward positive) at grid index `index`, both with this variance (rad2)."""

    thigh: float = 0.0
    shank: float = 0.0
    index: int = 0
    variance: float = UNKNOWN_SD_RAD**2

    def moved(self, thigh: float, shank: float, index: int, drift: float) -> SwingAngles:
        """The level at a later index, where integration finds these angles; `drift`: variance (rad2) added by the gyros' errors."""
        return SwingAngles(thigh, shank, index, self.variance + STRIDE_SD_RAD**2 + drift)

    def corrected(self, off: tuple[float, float], sd: float) -> SwingAngles:
        """Kalman update by the differences `off` (thigh, shank) of the usual angles from the angles found, with this sd."""
        gain = self.variance / (self.variance + sd * sd)
        return SwingAngles(
            self.thigh + gain * off[0], self.shank + gain * off[1], self.index, (1.0 - gain) * self.variance
        )  # fmt: skip

    def standing(self, rest_s: float) -> SwingAngles:
        """The level after a rest of this duration."""
        sd = STANDING_SD_RAD if rest_s > BRIEF_S else BRIEF_SD_RAD
        return self.corrected((STANDING_RAD[0] - self.thigh, STANDING_RAD[1] - self.shank), sd)


class StrideMean:
    """Mean angles (thigh, shank, yaw) of a stride between two grid indices; `first`: whether it is the first of a walk."""

    def __init__(self, begin: int, end: int, grid: AngleGrid, *, first: bool) -> None:
        self.begin, self.end, self.first = begin, end, first
        self.angles = tuple(math.fsum(column[begin:end]) / (end - begin) for column in grid.columns)


class LegAngles:
    """`bias`: errors of the gyros of thigh and shank. `level`: the angles at one grid index."""

    def __init__(self, grid: AngleGrid) -> None:
        self.bias = (GyroBias(), GyroBias())
        self.level = SwingAngles()
        self._rested = SwingAngles()  # when the standing under way began
        self._grid = grid
        self._mean: StrideMean | None = None  # of the stride before

    def between(self, signs: Signs, begin: int, end: int) -> tuple[Floats, Floats]:
        """Angles (n,) of thigh and shank at grid indices begin..end, from the level with the present biases.

        For its leak, a turn between these indices is assumed even, so that the pelvis' rotation to and fro adds nothing.
        """
        level, grid = self.level, self._grid
        indices = np.arange(begin, end + 1)
        yaw = np.linspace(grid.yaw[begin], grid.yaw[end], len(indices)) - grid.yaw[level.index]
        angles = []
        for turned, sign, bias, start in zip(
            (grid.thigh, grid.shank), signs, self.bias, (level.thigh, level.shank), strict=True
        ):
            angle = sign * (np.array(turned[begin : end + 1]) - turned[level.index])
            angles.append(start + angle - bias.value * (indices - level.index) / GRID_HZ - bias.leak * yaw)
        return angles[0], angles[1]

    def move_level(self, signs: Signs, k: int) -> None:
        """Take the level to grid index k by integration; the longer the way there and the wider the turn, the less it is known."""
        if k == self.level.index:
            return
        thigh, shank = self.between(signs, k, k)
        span_s, turn = (k - self.level.index) / GRID_HZ, self._grid.yaw[k] - self._grid.yaw[self.level.index]
        drift = max(bias.drift_variance(span_s, turn) for bias in self.bias)
        self.level = self.level.moved(float(thigh[0]), float(shank[0]), k, drift)

    def begin_rest(self, signs: Signs, k: int) -> None:
        """The leg has come to stand at grid index k."""
        self.move_level(signs, k)
        self._rested = self.level

    def learn_rest(self, signs: Signs, rates: Floats, rested_s: float, k: int) -> None:
        """Update gyros' errors and level by the mean rates (2,) of a leg that has stood for `rested_s` until grid index k."""
        for bias, sign, rate in zip(self.bias, signs, rates.tolist(), strict=True):
            bias.learn(sign * rate, REST_SD_RAD_S)
        rested = self._rested.standing(rested_s)
        self.level = SwingAngles(rested.thigh, rested.shank, k, rested.variance)

    def learn_closure(self, signs: Signs, begin: int, end: int, *, first: bool) -> None:
        """Update the gyros' errors by a stride: its mean angles equal the previous stride's, but for bias and leak.

        Mid swing is the moment of the fastest turn, so angles there scatter with its timing; means do not. The first stride of a walk (`first`)
        or after a gap has no previous stride: its angles at both ends are compared.
        """
        before, self._mean = self._mean, StrideMean(begin, end, self._grid, first=first)
        if before is None or before.end != begin:
            span_s, sd = (end - begin) / GRID_HZ, FIRST_CLOSURE_SD_RAD
            thigh, shank, yaw = ((c[end] - c[begin]) / span_s for c in self._grid.columns)
        else:
            span_s = 0.5 * (end - before.begin) / GRID_HZ
            sd = FIRST_CLOSURE_SD_RAD if before.first else CLOSURE_SD_RAD
            thigh, shank, yaw = (
                (new - old) / span_s for new, old in zip(self._mean.angles, before.angles, strict=True)
            )
        for bias, sign, rate in zip(self.bias, signs, (thigh, shank), strict=True):
            bias.learn(sign * rate, sd / span_s, yaw)

    def correct_level(self, signs: Signs, begin: int, end: int) -> None:
        """Correct the level by the mean angles of a stride; a shorter stride is nearer to standing, and on stairs the mean angles differ."""
        thigh, shank = self.between(signs, begin, end)
        strike = heel_strike_index(shank)
        phase = (np.arange(strike, len(shank)) - strike) / (len(shank) - 1)
        self.move_level(signs, begin)
        if climbs(*knees(phase, thigh[strike:], shank[strike:])):
            return
        share = min(float(np.ptp(shank)) / UPRIGHT_RANGE_RAD, 1.0)
        usual = (s + share * (m - s) for s, m in zip(STANDING_RAD, MEAN_RAD, strict=True))
        off = tuple(u - float(angle.mean()) for u, angle in zip(usual, (thigh, shank), strict=True))
        self.level = self.level.corrected((off[0], off[1]), MEAN_SD_RAD)

    def forget_level(self, k: int = 0) -> None:
        """Nothing is known of the level from grid index k on."""
        self.level = SwingAngles(index=k)
        self._mean = None

    def drop(self, k: int) -> None:
        """Forget the first k grid points."""
        if self._mean is not None:
            self._mean.begin -= k
            self._mean.end -= k
        self.level, self._rested = (replace(level, index=level.index - k) for level in (self.level, self._rested))


def knees(phase: Floats, thigh: Floats, shank: Floats) -> tuple[float, float]:
    """Flexion of the knee (rad) at the strike and half a stride later, from angles (n,) at phases (n,)."""
    strike, later = np.interp((0.02, 0.5), phase, thigh - shank).tolist()
    return strike, later
