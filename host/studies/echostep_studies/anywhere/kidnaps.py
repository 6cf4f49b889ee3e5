# SPDX-License-Identifier: MIT
"""Kidnaps: displacements of the wearer that the filter does not measure.

In: a `SimulatedWalk`. Out: the remaining segments, and the time from which the filter can recover. Owns nothing.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from echostep.path import MeasuredSegment, PathSegment
from echostep_studies.bench.walks import SimulatedWalk, T, Z

RIDES_M = 1e-4  # change of height between two rows of the truth in a moving lift
DOORS_S = 3.0  # for which the wearer stands in the lift before and after the ride
Kidnapped = tuple[SimulatedWalk, float]


def carried(walk: SimulatedWalk, from_m: float, over_m: float) -> Kidnapped:
    """Carried over a part of the way: the foot measures that it stands, and no ping comes."""
    begin_s, end_s = walk.time_at(from_m), walk.time_at(from_m + over_m)
    before, after = _cut(walk, begin_s, end_s)
    last, following = before[-1].segment, after[0].segment
    stands = PathSegment(
        last.t1_s, following.t0_s, 0.0, 0.0, last.heading1_rad, following.heading0_rad, 0.0, 0.0, last.step,
        last.anchor_sd_m, 0.0, following.rise_sd_m,
    )  # fmt: skip
    none = MeasuredSegment(stands, np.empty(0), np.empty(0, np.int64), np.empty(0))
    return replace(walk, segments=(*before, none, *after)), following.t0_s


def off_in_lift(walk: SimulatedWalk) -> Kidnapped:
    """Board and tracker are off during a ride: it goes on where it was, and the heights by pressure restart at their last value."""
    before, after, rise_m = _ride(walk)
    zeroed = tuple(replace(s, height_m=s.height_m - rise_m, barometer_starts=1) for s in after)
    return replace(walk, segments=(*before, *zeroed)), after[0].segment.t0_s


def asleep_in_lift(walk: SimulatedWalk) -> Kidnapped:
    """The laptop sleeps during a ride: the heights by pressure go on."""
    before, after, _ = _ride(walk)
    return replace(walk, segments=(*before, *after)), after[0].segment.t0_s


def _ride(walk: SimulatedWalk) -> tuple[tuple[MeasuredSegment, ...], tuple[MeasuredSegment, ...], float]:
    """The segments before and after the ride in the lift, and how far up it leads."""
    rides = np.flatnonzero(np.abs(np.diff(walk.truth[:, Z])) > RIDES_M)
    begin_s, end_s = float(walk.truth[rides[0], T]) - DOORS_S, float(walk.truth[rides[-1] + 1, T]) + DOORS_S
    rise_m = float(walk.truth[rides[-1] + 1, Z] - walk.truth[rides[0], Z])
    return *_cut(walk, begin_s, end_s), rise_m


def restarted(walk: SimulatedWalk, from_m: float) -> Kidnapped:
    """Only the segments after a part of the way: a tracker that begins there."""
    begin_s = walk.time_at(from_m)
    _, after = _cut(walk, begin_s, begin_s)
    return replace(walk, segments=after), after[0].segment.t0_s


def _cut(
    walk: SimulatedWalk, begin_s: float, end_s: float
) -> tuple[tuple[MeasuredSegment, ...], tuple[MeasuredSegment, ...]]:
    """Segments that end before `begin_s`, and segments that begin after `end_s`."""
    before = tuple(s for s in walk.segments if s.segment.t1_s <= begin_s)
    return before, tuple(s for s in walk.segments if s.segment.t0_s >= end_s)
