# SPDX-License-Identifier: MIT
"""The rival of every stand: the trunk moved, and no step was measured. Carried, pushed, ridden, or a foot's sensor that lies.

In: `MeasuredSegment`s in order of time. Out: the same; where the rival wins, as segments that were not observed. Owns its odds in this stand, and what
each ranger heard at its begin.

One hypothesis, one update: per second it may begin; a foot that is off the floor for longer than a step takes is carried, or laid over the other knee;
each ranger compares what it hears with what it heard when the stand began. A passer-by is nearer and goes again; a way along a wall changes nothing; what is farther than before
was not there. A wearer whose rangers have fallen silent has no witness, so his claim decays with time.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from echostep.particles.limits import PROBABLE, WALKER_M_S
from echostep.path import UNOBSERVED_SD_M, MeasuredSegment, PathSegment

# Assumed, not measured. Rates (1/s) at which such a way begins: with a witness, and where the rangers have fallen silent
BEGINS_PER_S, UNSEEN_PER_S = 1e-4, 0.02
PRIOR = 1e-4  # that it begins with the stand
BASE_S = 1.0  # of a stand, in which the rangers hear what is there
MOST_M = 3.0  # standard deviation per axis of a way that a cloud follows
ALIKE_M = 0.15  # error of an echo, sway and a slight turn of the body
ALOFT = 8.0  # log-likelihood ratio of a foot that stays off the floor
# Log-likelihood ratios of half a second of a ranger: moved / stood
AS_BEFORE = math.log(0.8 / 0.95)  # a wall goes on
NEARER = math.log(0.2 / 0.12)  # a passer-by, a cupboard
FARTHER = math.log(0.2 / 0.03)  # a door that somebody opens, a corner


class UnmeasuredWay:
    """Call `weighed` with every segment."""

    def __init__(self) -> None:
        self._has_heard, self._step = False, 0
        self._begin_anew(math.inf)

    def _begin_anew(self, t_s: float) -> None:
        """A step was measured: what was, is over."""
        self.probability = PRIOR
        self._begin_s = self._spread_s = t_s  # of the stand; up to which the trunk has been spread
        self._base: tuple[list[float], list[float]] = ([], [])
        self._last = [math.nan, math.nan]
        self._is_aloft = False

    def weighed(self, measured: MeasuredSegment) -> MeasuredSegment:
        """Update the probability; the segment, or one that was not observed where the trunk has probably moved."""
        segment = measured.segment
        before, self._step = self._step, segment.step
        if (segment.unobserved or segment.step != before) and not segment.aloft:
            self._begin_anew(segment.t1_s)
            return measured
        self._begin_s, self._spread_s = min(self._begin_s, segment.t0_s), min(self._spread_s, segment.t0_s)
        heard = [measured.range_m[(measured.ranger == k) & (measured.range_m > 0.0)] for k in (0, 1)]
        speaks = any(len(ranges) for ranges in heard)
        self._has_heard = self._has_heard or speaks
        per_s = UNSEEN_PER_S if self._has_heard and not speaks else BEGINS_PER_S
        begun = self.probability + (1.0 - self.probability) * -math.expm1(-per_s * (segment.t1_s - segment.t0_s))
        log_ratio = ALOFT if segment.aloft and not self._is_aloft else 0.0
        self._is_aloft = segment.aloft and segment.step == before
        for k, ranges in enumerate(heard):
            if len(ranges):
                log_ratio += self._compared(k, float(np.median(ranges)), segment.t1_s - self._begin_s < BASE_S)
        odds = math.exp(log_ratio) * begun / (1.0 - begun)
        self.probability = min(max(odds / (1.0 + odds), PRIOR), 1.0 - PRIOR)
        return replace(measured, segment=self._spread(segment)) if self.has_moved else measured

    @property
    def has_moved(self) -> bool:
        """Whether the trunk has probably moved since the last measured step."""
        return self.probability > PROBABLE

    def _compared(self, ranger: int, range_m: float, is_base: bool) -> float:
        """Log-likelihood ratio of what a ranger hears in a piece of the stand."""
        base, last_m = self._base[ranger], self._last[ranger]
        self._last[ranger] = range_m
        if is_base or not base:
            base.append(range_m)
            return 0.0
        if min(abs(range_m - b) for b in base) < ALIKE_M:
            return AS_BEFORE
        if abs(range_m - last_m) < ALIKE_M:
            return 0.0
        return FARTHER if range_m > max(base) else NEARER

    def _spread(self, segment: PathSegment) -> PathSegment:
        """Any way up to a walker's speed since the stand began, whatever the foot measured; beyond MOST_M the building is searched."""
        before_m, after_m = (min(WALKER_M_S * (t_s - self._begin_s), MOST_M) for t_s in (self._spread_s, segment.t1_s))
        sd_m = math.sqrt(after_m**2 - before_m**2)
        if sd_m <= UNOBSERVED_SD_M:
            return replace(segment, dx_m=0.0, dy_m=0.0, sd_m=0.0)
        self._spread_s = segment.t1_s
        return replace(segment, dx_m=0.0, dy_m=0.0, sd_m=sd_m)
