"""A stride and its flags, and the settings and counts of their estimator.

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
    EDGE = enum.auto()  # the beginning or the end of a walk: not a whole stride
    STANDING = enum.auto()
    UNSEEN = enum.auto()  # in place or sideways: the length is not known
    BACKWARD = enum.auto()  # the length is not known
    STAIRS_UP = enum.auto()
    STAIRS_DOWN = enum.auto()
    SLOW = enum.auto()
    FAST = enum.auto()
    TURNING = enum.auto()
    GAP = enum.auto()  # samples were missing


@dataclass(frozen=True, slots=True)
class Stride:
    """The hips went `length_m` forward and `rise_m` up from `t_start_s` to `t_end_s`; `length_sd_m` holds for this stride alone.

    `scale_sd`: relative standard deviation of the scale that all strides of this wearer share; not in `length_sd_m`.
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
        """Mean speed."""
        return self.length_m / (self.t_end_s - self.t_start_s) if self.t_end_s > self.t_start_s else 0.0


@dataclass(frozen=True, slots=True)
class StrideSettings:
    """The wearer's `segments`; `calibrated`: their scale was found by a walk of known length."""

    segments: LegLengths = field(default_factory=LegLengths)
    calibrated: bool = False


@dataclass(slots=True)
class LegCounts:
    """Samples that came; `impossible` (not finite or beyond any leg) and `not_later` ones were skipped."""

    samples: int = 0
    impossible: int = 0
    not_later: int = 0
    gaps: int = 0


def distance_sd_m(strides: Iterable[Stride]) -> float:
    """Standard deviation of the sum of lengths: scale errors add linearly, the others by squares."""
    each = list(strides)
    alike = sum(s.length_m * s.scale_sd for s in each)
    return math.sqrt(alike**2 + sum(s.length_sd_m**2 for s in each))
