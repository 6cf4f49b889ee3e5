# SPDX-License-Identifier: MIT
"""Both legs of one person as one track: each leg takes its scale from the mean of both.

In: `LegSamples` of two legs whose times are of one clock. Out: `LegTrack`. Owns nothing.

Each leg measures the same way, with a scale of its own, twice its own half strides. The mean of both is the way of the trunk: left and right steps
count once each, and in a turn outer and inner hip cancel. Where one leg is not seen (no samples, or a stride that it does not show), the
other leg goes on with the scale that makes both equally long where both are seen.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from echostep.arrays import Bools, Floats
from echostep.errors import EchostepError
from echostep.legs.stride import Flag, LegCounts, Stride, StrideSettings
from echostep_app.offline.leg_csv import LegSamples
from echostep_app.offline.leg_track import (
    LegTrack,
    distance_at,
    doubts,
    fused_heading,
    leg_strides,
    path_rows,
    source_of,
    with_turns,
)

LEGS_DIFFER = 0.04  # standard deviation of the ratio of a person's two legs [14 legs of 7 people]
DOUBTFUL = 3.0  # times that: not two legs of one person; assumed
STRAIGHT_S, STRAIGHT_RAD = 1.0, math.radians(15.0)  # of trunks that go straight on: about a stride; assumed
NAMES = "the first", "the other"
LEAST_M = 3.0  # seen by both legs, to compare them: two strides
Legs = tuple[tuple[Stride, ...], tuple[Stride, ...]]
UNKNOWN = Flag.UNSEEN | Flag.BACKWARD | Flag.GAP  # strides of which a leg does not know the length


def track_pair(
    first: LegSamples, other: LegSamples, settings: StrideSettings, heading_rad: float | None = None
) -> LegTrack:
    """The way of the trunk by both legs; `strides` of the first leg, and of the other where the first has no samples, with their mean length.

    Belt and compass are the first leg's, or the other's if the first has none. Raises EchostepError for times that do not overlap.
    """
    if min(first.t_s[-1], other.t_s[-1]) <= max(first.t_s[0], other.t_s[0]):
        raise EchostepError("the two legs have no time in common: their times must be of the same clock")
    trunk = first if first.has_heading else other
    first, other = (_with_belt(leg, trunk) for leg in (first, other))
    estimates = [leg_strides(leg, settings) for leg in (first, other)]
    legs = estimates[0][0], estimates[1][0]
    t_s = np.union1d(first.t_s, other.t_s)
    moves = np.array([np.diff(distance_at(t_s, strides)) for strides in legs])
    seen = np.array([_seen(t_s, leg, strides) for leg, strides in zip((first, other), legs, strict=True)])
    idle = np.array([_idle(t_s, legs[0], legs[1]), _idle(t_s, legs[1], legs[0])])
    seen &= ~idle
    angles, heading_notes = fused_heading(trunk, legs[0] if trunk is first else legs[1], heading_rad)
    heading = np.interp(t_s, trunk.t_s, angles[:, 0])
    ratio, notes = _ratio(moves[:, seen.all(axis=0) & _straight(t_s, heading)].sum(axis=1))
    alone = seen.any(axis=0) & ~seen.all(axis=0)
    distance = _summed((np.where(alone, seen * ratio[:, None], 0.5) * moves).sum(axis=0))
    differ = 0.0 if settings.calibrated else LEGS_DIFFER
    strides = with_turns(_joint_strides(t_s, distance, seen, legs, differ), t_s, heading)
    resting = np.array(NAMES)[idle.any(axis=1)]
    loose = (f"the sensors of {name} leg rest during a walk: are they worn?" for name in resting)
    notes = (*notes, *loose, *heading_notes, *doubts(strides))
    counts = LegCounts(*(getattr(estimates[0][1], k) + getattr(estimates[1][1], k) for k in LegCounts.__slots__))
    return LegTrack(path_rows(t_s, distance, heading), strides, counts, source_of(trunk), float(angles[-1, 1]), notes)


def _with_belt(leg: LegSamples, trunk: LegSamples) -> LegSamples:
    """The leg with the belt rate of the other one, if it has no belt rate."""
    if not np.isnan(leg.belt).all() or np.isnan(trunk.belt).all():
        return leg
    inside = (leg.t_s >= trunk.t_s[0]) & (leg.t_s <= trunk.t_s[-1])
    return replace(leg, belt=np.where(inside, np.interp(leg.t_s, trunk.t_s, trunk.belt), np.nan))


def _seen(t_s: Floats, leg: LegSamples, strides: tuple[Stride, ...]) -> Bools:
    """Whether the leg measures the way between each two times (n - 1,)."""
    middle = 0.5 * (t_s[:-1] + t_s[1:])
    seen = (middle > leg.t_s[0]) & (middle < leg.t_s[-1])
    return seen & ~_within(middle, [s for s in strides if s.flags & UNKNOWN])


def _idle(t_s: Floats, strides: tuple[Stride, ...], others: tuple[Stride, ...]) -> Bools:
    """Whether this leg has no stride between each two times (n - 1,) while the other leg goes a whole one, which no leg does."""
    middle = 0.5 * (t_s[:-1] + t_s[1:])
    stands = ~_within(middle, [s for s in strides if Flag.STANDING not in s.flags])
    begun = _summed(stands.astype(np.float64))
    whole = [s for s in others if s.length_m > 0.0 and Flag.EDGE not in s.flags]
    spans = [np.searchsorted(middle, [s.t_start_s, s.t_end_s]) for s in whole]
    moving = [s for s, (a, b) in zip(whole, spans, strict=True) if b > a and begun[b] - begun[a] == b - a]
    return _within(middle, moving)


def _within(times: Floats, strides: Sequence[Stride]) -> Bools:
    """Whether each time (n,) is in one of these strides."""
    within = np.zeros(len(times), np.bool_)
    for stride in strides:
        within[slice(*np.searchsorted(times, [stride.t_start_s, stride.t_end_s]))] = True
    return within


def _straight(t_s: Floats, heading: Floats) -> Bools:
    """Whether the trunk goes straight on between each two times (n - 1,): in a turn the outer leg goes farther."""
    middle = 0.5 * (t_s[:-1] + t_s[1:])
    turned = np.interp(middle + 0.5 * STRAIGHT_S, t_s, heading) - np.interp(middle - 0.5 * STRAIGHT_S, t_s, heading)
    straight: Bools = np.abs(turned) < STRAIGHT_RAD
    return straight


def _ratio(common_m: Floats) -> tuple[Floats, tuple[str, ...]]:
    """Factors (2,) that make both legs as long as their mean, from their ways (2,) where both are seen and go straight on, and notes."""
    if common_m.min() < LEAST_M:
        return np.ones(2), ("too short a way is seen by both legs to compare them",)
    off = float(common_m[1] / common_m[0]) - 1.0
    note = f"the other leg measures {abs(off):.1%} {'more' if off > 0.0 else 'less'}"
    if abs(off) > DOUBTFUL * LEGS_DIFFER:
        note += f": two legs of a person differ by {LEGS_DIFFER:.0%}, is a sensor loose?"
    return common_m.mean() / common_m, (note,)


def _joint_strides(t_s: Floats, distance: Floats, seen: Bools, legs: Legs, differ: float) -> tuple[Stride, ...]:
    """Strides of the first leg, and of the other before and after them, with the lengths (m) and the uncertainty of both.

    A stride that either leg shows has no unknown length any more. Independent errors of two legs halve in squares; so do errors of their scales, by
    which they `differ` (sd).
    """
    strides = _in_order(*legs)
    times = np.array([(s.t_start_s, s.t_end_s) for s in strides]).reshape(-1, 2)
    lengths = _between(times, t_s, distance)
    shown_s = np.array([_between(times, t_s, _summed(row * np.diff(t_s))) for row in seen])
    shows = shown_s > 0.5 * np.diff(times, axis=1).T
    spreads = [
        tuple(replace(s, length_m=s.length_sd_m**2) for s in leg) for leg in legs
    ]  # m2, by the strides' own errors
    variances = np.array([_between(times, t_s, distance_at(t_s, spread)) for spread in spreads])
    joint = []
    for k, stride in enumerate(strides):
        legs_showing = int(shows[:, k].sum())
        if not legs_showing:
            joint.append(replace(stride, length_m=float(lengths[k])))
            continue
        sd = math.sqrt(float(variances[shows[:, k], k].sum())) / legs_showing
        scale_sd = math.sqrt(stride.scale_sd**2 - 0.25 * differ**2) if legs_showing == 2 else stride.scale_sd
        flags = stride.flags & ~UNKNOWN
        joint.append(replace(stride, length_m=float(lengths[k]), length_sd_m=sd, scale_sd=scale_sd, flags=flags))
    return tuple(joint)


def _in_order(first: tuple[Stride, ...], other: tuple[Stride, ...]) -> tuple[Stride, ...]:
    """The strides of the first leg, and the other's before and after them."""
    if not first:
        return other
    begin_s, end_s = first[0].t_start_s, first[-1].t_end_s
    before = (replace(s, t_end_s=min(s.t_end_s, begin_s)) for s in other if s.t_start_s < begin_s)
    after = (replace(s, t_start_s=max(s.t_start_s, end_s)) for s in other if s.t_end_s > end_s)
    return (*before, *first, *after)


def _between(times: Floats, t_s: Floats, grown: Floats) -> Floats:
    """By how much a quantity (n,) at `t_s` (n,) grows between pairs of times (m, 2)."""
    differences: Floats = np.diff(np.interp(times, t_s, grown), axis=1)[:, 0]
    return differences


def _summed(pieces: Floats) -> Floats:
    """Sums (n,) of the pieces (n - 1,) up to each time."""
    return np.concatenate([[0.0], np.cumsum(pieces)])
