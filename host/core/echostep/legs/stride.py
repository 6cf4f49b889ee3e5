# SPDX-License-Identifier: MIT
"""A stride and its flags; settings and counts of the estimator.

In: nothing. Out: `Stride`, `Flag`, `StrideSettings`, `LegCounts`, and the uncertainty of a sum of strides. Owns nothing.

In a turn the outer leg goes farther than the trunk. The pelvis turns forward with the leg that lands [Perry 1992], so the twist of the belt over a
stride distinguishes the legs. Both legs are equally likely before it is seen; the more it lies within the twist that a belt has by chance, the nearer
the result is to the middle of the trunk.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from echostep.arrays import Floats
from echostep.legs.kinematics import LegLengths

# Standard deviation of the scale common to all strides: between persons whose legs are measured [14 legs of 7 people], more by that of legs which are
# not (heights differ by 0.097 m or 5.9 % in the world, legs of one height by 3 % [NCD-RisC 2016; Winter 2009]), and after a walk of 10 m of known
# length: 2.5 % by speed, and 1.6 % with which that walk is measured.
SCALE_SD, LENGTHS_SD, CALIBRATED_SD = 0.078, 0.066, 0.03
HALF_PELVIS_M = 0.09  # of a leg from the middle of the trunk, as in `WearerSettings`
# Phase after mid swing at which the pelvis is turned farthest: between the strike (0.18, half of the swing) and the other foot's toe off
# (0.30), until which the pelvis is carried on. Four legs of two people have it at 0.29 to 0.37, the simulated ones at the strike.
LANDS, TWIST_POINTS = 0.25, 50
TWIST_RAD = math.radians(3.0)  # either way: 4 degrees of the pelvis [Perry 1992], less what a belt does not follow
PERSON_SD_RAD = math.radians(1.5)  # of it from person to person and by the belt's seat, assumed
STRIDE_SD_RAD = math.radians(3.0)  # of it from stride to stride, before that is seen, assumed
LEAST_STRIDE_M = 0.5  # of a stride whose pelvis turns visibly
STRAIGHT_RAD = math.radians(15.0)  # largest turn of a stride that shows it: a turn hides the twist


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


def about_trunk(strides: tuple[Stride, ...], t_s: Floats, heading: Floats) -> tuple[Stride, ...]:
    """The strides of the trunk instead of those of this leg's hip, which goes farther on the outside of a turn and less far inside."""
    left_m = leg_left_m(strides, t_s, heading)
    if left_m == 0.0:
        return strides
    moved = []
    for stride in strides:
        h0, h1 = np.interp([stride.t_start_s, stride.t_end_s], t_s, heading)
        length = max(stride.length_m + left_m * float(h1 - h0), 0.0) if stride.length_m > 0.0 else 0.0
        moved.append(replace(stride, length_m=length))
    return tuple(moved)


def leg_left_m(strides: tuple[Stride, ...], t_s: Floats, heading: Floats) -> float:
    """Expected distance (m) of this leg to the left of the trunk, from `HALF_PELVIS_M` (left) to minus that (right), 0 where neither is likelier.

    `heading` (n,): of the trunk at `t_s` (n,), rad, positive to the left. The odds are those of two normal distributions about +-TWIST_RAD.
    """
    twists = np.array([_twist(stride, t_s, heading) for stride in strides if _shows(stride)])
    twists = twists[np.isfinite(twists)]
    if not len(twists):
        return 0.0
    mean = float(twists.mean())
    stride_variance = (STRIDE_SD_RAD**2 + float(((twists - mean) ** 2).sum())) / len(twists)
    variance = PERSON_SD_RAD**2 + stride_variance / len(twists)
    return -HALF_PELVIS_M * math.tanh(TWIST_RAD * mean / variance)


def _shows(stride: Stride) -> bool:
    """Whether the pelvis turns visibly in a stride."""
    return stride.length_m > LEAST_STRIDE_M and not stride.flags & (Flag.EDGE | Flag.GAP)


def _twist(stride: Stride, t_s: Floats, heading: Floats) -> float:
    """Amplitude (rad) of the trunk's twist in a stride, to the left where a right leg lands; NaN in a turn.

    A stride begins at mid swing, so the pelvis is turned to the left about at LANDS of it when the leg is the right one.
    """
    phase = np.linspace(0.0, 1.0, TWIST_POINTS)
    angle = np.interp(stride.t_start_s + phase * (stride.t_end_s - stride.t_start_s), t_s, heading)
    if abs(angle[-1] - angle[0]) > STRAIGHT_RAD:
        return math.nan
    wave = np.cos(2.0 * np.pi * (phase - LANDS))
    twist = angle - np.linspace(angle[0], angle[-1], len(angle))
    return 2.0 * float((twist * (wave - wave.mean())).mean())
