# SPDX-License-Identifier: MIT
"""The small faults of a first day: rangers that wake late, fall silent, are dead or missing, a body beside the wearer; no board.

In: a walk as the filter gets it. Out: the same with other pings. Owns nothing.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from echostep.arrays import Floats
from echostep.path import MeasuredSegment
from echostep_studies.bench.echo_changes import LEFT, RIGHT, changed, one_ranger
from echostep_studies.bench.walks import SimulatedWalk

PASSER_M, PASSER_S = 0.5, 3.0  # distance of a body beside the wearer, and for how long


def silent(first: int, count: int, walk: SimulatedWalk) -> SimulatedWalk:
    """The pings from number `first` on hear nothing, `count` of them."""
    numbers = itertools.count()

    def ranges(s: MeasuredSegment) -> Floats:
        number = np.array([next(numbers) for _ in s.t_s])
        return np.where((number >= first) & (number < first + count), np.nan, s.range_m)

    return changed(walk, ranges)


def silent_in_the_middle(walk: SimulatedWalk) -> SimulatedWalk:
    """Ten pings in the middle of the walk hear nothing."""
    return silent(sum(len(s.t_s) for s in walk.segments) // 2, 10, walk)


def passer_by(walk: SimulatedWalk) -> SimulatedWalk:
    """A body answers on the left of the wearer at the start."""
    until_s = walk.segments[0].segment.t0_s + PASSER_S
    return changed(
        walk, lambda s: np.where((s.ranger == LEFT) & (s.t_s < until_s), np.fmin(s.range_m, PASSER_M), s.range_m)
    )


def dead_ranger(walk: SimulatedWalk) -> SimulatedWalk:
    """The right ranger hears nothing from the start on."""
    return changed(walk, lambda s: np.where(s.ranger == RIGHT, np.nan, s.range_m))


def foot_alone(walk: SimulatedWalk) -> SimulatedWalk:
    """There is no board."""
    return replace(walk, segments=tuple(s.without_pings for s in walk.segments))


FAULTS: dict[str, Callable[[SimulatedWalk], SimulatedWalk]] = {
    "": lambda walk: walk,
    "/silent-3": partial(silent, 0, 3),
    "/silent-20": partial(silent, 0, 20),
    "/silent-middle": silent_in_the_middle,
    "/passer-by": passer_by,
    "/dead-ranger": dead_ranger,
    "/one-ranger": one_ranger,
    "/foot-alone": foot_alone,
}
