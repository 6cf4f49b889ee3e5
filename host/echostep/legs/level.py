# SPDX-License-Identifier: MIT
"""Angles of thigh and shank against the vertical at one moment, which gyros do not measure: a Kalman filter of what is usual.

In: the angles while standing, and their mean over a stride. Out: `Level`. Owns the filter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

# By reason, where no source is named.
STANDING_RAD = (0.0, math.radians(-3.0))  # thigh, shank: the weight is in front of the ankles
MEAN_RAD = (math.radians(7.0), math.radians(-14.2))  # over a stride, by the curves of `kinematics`
STANDING_SD_RAD = math.radians(4.0)  # of people who stand; a foot is often a little ahead
BRIEF_SD_RAD, BRIEF_S = math.radians(12.0), 1.0  # of a shorter rest: it may be one between two steps, legs apart
MEAN_SD_RAD = math.radians(
    8.0
)  # of people's mean angles [offsets of sagittal angles: Kadaba 1990], which all strides share
STRIDE_SD_RAD = math.radians(1.5)  # growth in a stride: soft tissue
UNKNOWN_SD_RAD = math.radians(20.0)  # before anything is known


@dataclass(frozen=True, slots=True)
class Level:
    """`thigh`, `shank`: angles (rad, forward positive) at grid index `index`, both with this variance (rad2)."""

    thigh: float = 0.0
    shank: float = 0.0
    index: int = 0
    variance: float = UNKNOWN_SD_RAD**2

    def moved(self, thigh: float, shank: float, index: int, drift: float) -> Level:
        """The level at a later index, where integration finds these angles; `drift`: variance (rad2) of what the gyros' errors have added."""
        return Level(thigh, shank, index, self.variance + STRIDE_SD_RAD**2 + drift)

    def corrected(self, off: tuple[float, float], sd: float) -> Level:
        """Kalman update by the differences `off` (thigh, shank) of the usual angles from those found, with this sd."""
        gain = self.variance / (self.variance + sd * sd)
        return Level(
            self.thigh + gain * off[0], self.shank + gain * off[1], self.index, (1.0 - gain) * self.variance
        )  # fmt: skip

    def standing(self, rest_s: float) -> Level:
        """The level after a rest of this duration."""
        sd = STANDING_SD_RAD if rest_s > BRIEF_S else BRIEF_SD_RAD
        return self.corrected((STANDING_RAD[0] - self.thigh, STANDING_RAD[1] - self.shank), sd)
