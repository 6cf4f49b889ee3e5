# SPDX-License-Identifier: MIT
"""A stride and its flags; settings and counts of the estimator.

In: nothing. Out: `Stride`, `Flag`, `StrideSettings`, `LegCounts`. Owns nothing.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, field

from echostep.legs.kinematics import LegLengths

# Standard deviation of the scale common to all strides: between persons whose legs are measured [14 legs of 7 people], the additional one if they are
# not (heights differ by 0.097 m or 5.9 % in the world, legs of one height by 3 % [NCD-RisC 2016; Winter 2009]), and after a walk of 10 m of known
# length: 2.5 % by speed, and 1.6 % from the measurement of that walk.
SCALE_SD, LENGTHS_SD, CALIBRATED_SD = 0.078, 0.066, 0.03


class Flag(enum.Flag):
    """Properties of a stride."""

    NONE = 0
    EDGE = enum.auto()  # beginning or end of a walk: not a whole stride
    STANDING = enum.auto()
    UNSEEN = enum.auto()  # in place or sideways: the length is unknown
    BACKWARD = enum.auto()  # the length is unknown
    STAIRS_UP = enum.auto()
    STAIRS_DOWN = enum.auto()
    SLOW = enum.auto()
    FAST = enum.auto()
    TURNING = enum.auto()
    GAP = enum.auto()  # samples were missing


@dataclass(frozen=True, slots=True)
class Stride:
    """Travel of the hips from `t_start_s` to `t_end_s`: `length_m` forward, `rise_m` up; `length_sd_m`: independent error of this stride.

    `scale_sd`: relative standard deviation of the scale common to all strides of the wearer; not included in `length_sd_m`.
    """

    t_start_s: float
    t_end_s: float
    length_m: float
    length_sd_m: float
    scale_sd: float
    rise_m: float = 0.0
    flags: Flag = Flag.NONE

    @property
    def speed_m_s(self) -> float:
        """Mean speed; 0 for a stride without duration."""
        return self.length_m / (self.t_end_s - self.t_start_s) if self.t_end_s > self.t_start_s else 0.0


@dataclass(frozen=True, slots=True)
class StrideSettings:
    """`segments`: lengths of the wearer's leg. `calibrated`: whether their scale is from a walk of known length."""

    segments: LegLengths = field(default_factory=LegLengths)
    calibrated: bool = False

    @property
    def scale_sd(self) -> float:
        """Relative standard deviation of the scale of all strides."""
        if self.calibrated:
            return CALIBRATED_SD
        return SCALE_SD if self.segments.measured else math.hypot(SCALE_SD, LENGTHS_SD)


@dataclass(slots=True)
class LegCounts:
    """Counts of samples: all; skipped as `impossible` (not finite, or beyond any leg) or `not_later`. `gaps`: times without samples."""

    samples: int = 0
    impossible: int = 0
    not_later: int = 0
    gaps: int = 0
