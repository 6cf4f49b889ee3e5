# SPDX-License-Identifier: MIT
"""Which leg wears the gyros, by the twist of the trunk; sums of strides.

In: the strides of a recorded leg, the trunk's heading. Out: the strides of the trunk; the standard deviation of a distance. Owns the twist's size.

In a turn the outer leg goes farther than the trunk. The pelvis turns forward with the leg that lands [Perry 1992], so the twist of the belt over a
stride distinguishes the legs. Both legs are equally likely before it is seen; the more it lies within the twist that a belt has by chance, the nearer
the result is to the middle of the trunk.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from echostep.arrays import Floats
from echostep.legs.stride import Flag, Stride

HALF_PELVIS_M = 0.09  # of a leg from the middle of the trunk, as in `WearerSettings`
# Phase after mid swing at which the pelvis is turned farthest: between the strike (0.18, half of the swing) and the other foot's toe off
# (0.30), until which the pelvis is carried on. Four legs of two people have it at 0.29 to 0.37, the simulated ones at the strike.
LANDS, TWIST_POINTS = 0.25, 50
TWIST_RAD = math.radians(3.0)  # either way: 4 degrees of the pelvis [Perry 1992], less the part that a belt misses
PERSON_SD_RAD = math.radians(1.5)  # of it from person to person and by the belt's seat, assumed
STRIDE_SD_RAD = math.radians(3.0)  # of it from stride to stride, before that is seen, assumed
LEAST_STRIDE_M = 0.5  # of a stride whose pelvis turns visibly
STRAIGHT_RAD = math.radians(15.0)  # largest turn of a stride that shows it: a turn hides the twist


def distance_sd_m(strides: Iterable[Stride]) -> float:
    """Standard deviation (m) of the sum of lengths: independent errors add in squares, errors of the scale linearly.

    So do errors of strides whose length is unknown: strides sideways, backward or on the knees are alike.
    """
    each = list(strides)
    unknown = [bool(s.flags & (Flag.UNSEEN | Flag.BACKWARD)) for s in each]
    common = sum(s.length_m * s.scale_sd for s in each)
    blind = sum(s.length_sd_m for s, blind in zip(each, unknown, strict=True) if blind)
    own = sum(s.length_sd_m**2 for s, blind in zip(each, unknown, strict=True) if not blind)
    return math.sqrt(common**2 + blind**2 + own)


def about_trunk(strides: tuple[Stride, ...], t_s: Floats, heading: Floats) -> tuple[Stride, ...]:
    """The strides of the trunk instead of this leg's hip, which goes farther on the outside of a turn and less far inside."""
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

    `heading` (n,): of the trunk at `t_s` (n,), rad, positive to the left. The odds follow from two normal distributions about +-TWIST_RAD.
    """
    # In these the pelvis turns visibly
    seen = [s for s in strides if s.length_m > LEAST_STRIDE_M and not s.flags & (Flag.EDGE | Flag.GAP)]
    twists = np.array([_twist(stride, t_s, heading) for stride in seen])
    twists = twists[np.isfinite(twists)]
    if not len(twists):
        return 0.0
    mean = float(twists.mean())
    stride_variance = (STRIDE_SD_RAD**2 + float(((twists - mean) ** 2).sum())) / len(twists)
    variance = PERSON_SD_RAD**2 + stride_variance / len(twists)
    return -HALF_PELVIS_M * math.tanh(TWIST_RAD * mean / variance)


def _twist(stride: Stride, t_s: Floats, heading: Floats) -> float:
    """Amplitude (rad) of the trunk's twist in a stride, to the left where a right leg lands; NaN in a turn.

    A stride begins at mid swing, so the pelvis is turned to the left at about LANDS of the stride when the leg is the right one.
    """
    phase = np.linspace(0.0, 1.0, TWIST_POINTS)
    angle = np.interp(stride.t_start_s + phase * (stride.t_end_s - stride.t_start_s), t_s, heading)
    if abs(angle[-1] - angle[0]) > STRAIGHT_RAD:
        return math.nan
    wave = np.cos(2.0 * np.pi * (phase - LANDS))
    twist = angle - np.linspace(angle[0], angle[-1], len(angle))
    return 2.0 * float((twist * (wave - wave.mean())).mean())
