# SPDX-License-Identifier: MIT
"""The rival of every stand: the trunk moved, and no step was measured. Carried, pushed, ridden, or a foot's sensor that lies.

In: `MeasuredSegment`s in order of time. Out: the same; where the rival wins, as segments that were not observed. Owns its odds, and what each ranger
heard when the stand began.

One hypothesis, one update: it may begin in any second; a foot that is off the floor for longer than a step takes is carried; each ranger compares
what it hears with what it heard when the stand began. Where the rangers have fallen silent there is no witness, so the claim decays with time.
"""

from __future__ import annotations

import math
from dataclasses import replace

from echostep.height.height_filter import OFF_SD_M, Rises
from echostep.localization.motion import height_change
from echostep.particles.limits import PROBABLE, WALKER_M_S
from echostep.path import UNOBSERVED_SD_M, MeasuredSegment, PathSegment

# Assumed, not measured. Rates (1/s) at which such a way begins: with a witness; in a silence that the stand began with; where rangers fell silent
BEGINS_PER_S, SILENT_PER_S, UNSEEN_PER_S = 1e-4, 0.005, 0.03
PRIOR, MOST_SD = 1e-4, 10.0  # that it begins with the stand; standard deviations beyond which nothing is surer
FOLLOWED_S = 2.0  # of such a way that a cloud follows; after a longer one the building is searched
# Between two segments: nothing was received; of an unobserved segment: a walk out of the room
PAUSE_S, LONG_S = 1.0, 5.0
UNOBSERVED_DOUBT = 0.2  # probability that such a way led out of the scattered cloud
STEP_M, STEP_RAD = 0.5, 0.9  # of a step that is no shuffle; a shorter one speaks by its share squared
SILENCE_S = 1.0  # in which rangers that are not silent hear something
SHUFFLE = 0.4  # of a step: after a longer one the rangers hear something else
SETTLING_S = 0.5  # of a stand, in which the trunk still moves over the foot
ALIKE_M = 0.15  # error of an echo, sway and a slight turn of the body
# Log-likelihood ratios, moved / stood: of a foot that stays off the floor, of a step
ALOFT, STEPPED = 8.0, -2.5
# Of a ping that hears what a ranger has heard in this stand: in half a second of a way most walls go on, those of a corridor for long
AS_BEFORE = math.log(0.92 / 0.95) / 7.0
# Of two pings in a row that hear something new: a passer-by or a cupboard; an opened door or a corner
NEARER, FARTHER = math.log(0.2 / 0.12), math.log(0.2 / 0.03)


class UnmeasuredWay:
    """Call `weighed` with every segment. `on_plan`: a trunk that left its cloud in a stand can be found again."""

    def __init__(self, *, on_plan: bool = True) -> None:
        self.probability, self._on_plan = PRIOR, on_plan
        self.away = 0.0  # probability that the trunk left its cloud in a stand or gap that has just ended
        self.pause_s, self._end_s = 0.0, math.inf  # between the last two segments; end of the last one
        self._heard_s, self._is_aloft, self._step = math.inf, False, 0  # when a ranger last heard something: never
        self._begin_s = self._spread_s = math.inf  # of the stand; up to which the trunk has been spread
        self._look_anew(math.inf)
        self._rises = Rises()

    @property
    def has_moved(self) -> bool:
        """Whether the trunk has probably moved since the last measured step."""
        return self.probability > PROBABLE

    @property
    def on_level(self) -> float:
        """Probability that the trunk is on its level, by the pressure: no lift that the plan lacks has moved it."""
        off = min(abs(self._rises.off_m) / OFF_SD_M, MOST_SD)
        return 1.0 / (1.0 + PRIOR * math.expm1(0.5 * off**2))

    def weighed(self, measured: MeasuredSegment, level_m: float = math.nan) -> MeasuredSegment:
        """Update the probabilities; the segment, or one that was not observed where the trunk has probably moved.

        `level_m`: the trunk's height in the plan by the level that is believed, NaN: none is.
        """
        segment, before = measured.segment, self.probability
        is_step, self._step = segment.step != self._step or segment.unobserved, segment.step
        odds = math.exp(self._log_ratio(measured, level_m, is_step=is_step)) * self._begun(measured)
        self.probability = min(max(odds / (1.0 + odds), PRIOR), 1.0 - PRIOR)
        self.pause_s, self._end_s = max(segment.t0_s - self._end_s, 0.0), segment.t1_s
        is_gap = self.pause_s > PAUSE_S or (segment.unobserved and segment.t1_s - segment.t0_s > LONG_S)
        self.away, stood_s = UNOBSERVED_DOUBT if is_gap else 0.0, segment.t0_s - self._begin_s
        if is_step and not self.has_moved:
            self.away = max(self.away, self._on_plan * before * (1.0 - FOLLOWED_S / max(stood_s, FOLLOWED_S)))
            self._begin_s = self._spread_s = segment.t1_s
        return replace(measured, segment=self._spread(segment)) if self.has_moved else measured

    def _begun(self, measured: MeasuredSegment) -> float:
        """Odds that such a way has begun by the end of a segment, before its evidence."""
        segment = measured.segment
        self._heard_s = segment.t1_s if (measured.range_m > 0.0).any() else self._heard_s
        silent_per_s = UNSEEN_PER_S if any(self._heard) or not len(measured.range_m) else SILENT_PER_S
        per_s = silent_per_s if segment.t1_s - self._heard_s > SILENCE_S else BEGINS_PER_S
        stood = max((1.0 - self.probability) * math.exp(-per_s * (segment.t1_s - segment.t0_s)), PRIOR)
        return (1.0 - stood) / stood

    def _log_ratio(self, measured: MeasuredSegment, level_m: float, *, is_step: bool) -> float:
        """Log-likelihood ratio of a segment: by the foot, or if it stands, by the rangers."""
        segment, was_aloft, self._is_aloft = measured.segment, self._is_aloft, measured.segment.aloft and not is_step
        way = math.hypot(segment.dx_m / STEP_M, segment.dy_m / STEP_M, segment.turn_rad / STEP_RAD)
        if is_step and way > SHUFFLE:
            self._look_anew(segment.t1_s)
        change, way_m = height_change(measured, math.nan), math.hypot(segment.dx_m, segment.dy_m)
        ratio = self._rises.update(change, way_m, measured.barometer_starts, level_m)
        ratio += ALOFT if segment.aloft and not was_aloft else 0.0
        if is_step and not segment.aloft:
            ratio += STEPPED * (1.0 if segment.unobserved else min(way, 1.0) ** 2) * math.exp(-self._rises.evidence)
        return ratio + sum(
            map(self._compared, measured.ranger.tolist(), measured.range_m.tolist(), measured.t_s.tolist())
        )

    def _look_anew(self, t_s: float) -> None:
        """From here on the rangers hear something else."""
        self._heard: tuple[list[float], list[float]] = ([], [])
        self._last, self._settled_s = [math.nan, math.nan], t_s + SETTLING_S

    def _compared(self, which: int, range_m: float, t_s: float) -> float:
        """Log-likelihood ratio of a ping of the stand; NaN: no echo."""
        heard, last_m, self._last[which] = self._heard[which], self._last[which], range_m
        if any(abs(range_m - h) < ALIKE_M for h in heard):
            return AS_BEFORE
        if not abs(range_m - last_m) < ALIKE_M:
            return 0.0
        heard.append(range_m)
        is_settled = len(heard) > 1 and t_s >= self._settled_s
        return 0.0 if not is_settled else FARTHER if range_m == max(heard) else NEARER

    def _spread(self, segment: PathSegment) -> PathSegment:
        """Any way up to a walker's speed since the stand began, whatever the foot measured; beyond FOLLOWED_S the building is searched."""
        self._begin_s, self._spread_s = min(self._begin_s, segment.t0_s), min(self._spread_s, segment.t0_s)
        before_s, after_s = (min(t_s - self._begin_s, FOLLOWED_S) for t_s in (self._spread_s, segment.t1_s))
        sd_m = WALKER_M_S * math.sqrt(after_s**2 - before_s**2)
        is_enough = sd_m > UNOBSERVED_SD_M
        self._spread_s = segment.t1_s if is_enough else self._spread_s
        return replace(segment, dx_m=0.0, dy_m=0.0, sd_m=sd_m if is_enough else 0.0)
