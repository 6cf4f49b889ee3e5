# SPDX-License-Identifier: MIT
"""A stride and its flags; settings and counts of the estimator.

In: nothing. Out: `Stride`, `Flag`, `StrideSettings`, `LegCounts`, and the uncertainty of a sum of strides. Owns nothing.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Iterable
from dataclasses import dataclass, field

from echostep.legs.kinematics import LegLengths


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


@dataclass(slots=True)
class LegCounts:
    """Counts of samples: all; skipped as `impossible` (not finite, or beyond any leg) or `not_later`. `gaps`: times without samples."""

    samples: int = 0
    impossible: int = 0
    not_later: int = 0
    gaps: int = 0


def distance_sd_m(strides: Iterable[Stride]) -> float:
    """Standard deviation (m) of the sum of lengths: independent errors add in squares, errors of the scale linearly.

    So do those of strides whose length is unknown: strides sideways, backward or on the knees are alike.
    """
    each = list(strides)
    unknown = [bool(s.flags & (Flag.UNSEEN | Flag.BACKWARD)) for s in each]
    common = sum(s.length_m * s.scale_sd for s in each)
    blind = sum(s.length_sd_m for s, blind in zip(each, unknown, strict=True) if blind)
    own = sum(s.length_sd_m**2 for s, blind in zip(each, unknown, strict=True) if not blind)
    return math.sqrt(common**2 + blind**2 + own)
