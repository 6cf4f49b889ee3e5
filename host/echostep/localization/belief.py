# SPDX-License-Identifier: MIT
"""The probabilities that a cloud is right and that the plan is the building's, from how well a cloud predicts the echoes.

In: a cloud; of each ping the log of its density under the cloud and without it (`echoes.unplanned`); what becomes of searches. Out: probabilities.
Owns their log-odds, and where a believed cloud went through a wall.

A hidden Markov model of two states, right and wrong [Rabiner 1989, forward algorithm]. If the cloud is right, echoes have the density that it
predicts. If it is wrong, the wearer is anywhere: then a view goes on as it was, or changes to any in the building. So a cloud gains
nothing by predicting that a corridor goes on, but by predicting where it ends. On every metre a right cloud may become wrong (carried, a wall that
is not on the plan, a door that is a wall): WRONG_PER_M.

On the plan of another building a search finds nothing, or a place that the next echoes reject; a stated start is rejected, and the search finds none
near it; a believed cloud goes through walls. Each is FAILS as probable if the plan fits as if it does not. Echoes that a cloud predicts confirm the
plan slowly: parts of two buildings are alike for ALIKE_M.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from echostep.arrays import Floats
from echostep.localization.particles.cloud import Cloud
from echostep.localization.settings import UNPLANNED_DOOR
from echostep.plan.model import Pose

# Assumed, not measured.
WRONG_PER_M = 2e-5  # probability that a right cloud becomes wrong on a metre of the path: once in 50 km
STATED = 0.99  # prior probability of a stated start
# Of a ping's log-ratio, below which it is no evidence: an error of one standard deviation that stays along a wall (plan, sway, speed of sound)
# counts against the cloud only, since the density without a plan adapts to it
STAYS = 0.5
# Log-odds are kept between these: a wrong cloud that becomes right is believed again within some metres
LEAST_LOG_ODDS, MOST_LOG_ODDS = -6.0, 12.0
# Of the plan; assumed, not measured.
PLAN_FITS = 0.99  # prior
FAILS = 0.05  # unknown starts are found within FOUND_WITHIN_M; stated ones are wrong about as often as plans
GRAZED = 0.2  # of a wall on a plan that states an error: its end is in the way of a right cloud by as much, on 100 m once or so
FAR = 0.4  # the same for a rejected start that is found elsewhere: one in a hundred is so far off, half of the wrong plans have a place alike
FOUND_WITHIN_M = 40.0  # path on which an unknown start is found on one level
ALIKE_M = 30.0  # path on which a place on a wrong plan predicts the echoes, in the mean (20 to 50 m were seen): symmetric wings, levels
MOST_FITS = 0.9995  # greatest probability: one wall that was never built leaves a confirmed plan at its prior
EARLY_M = 20.0  # path on which a cloud is rejected that was wrong from the first
START_ERROR_M = 5.0  # from a start that was rejected, within which a place makes it an error of the start: a room
# From one way through a wall, within which another is through the same one; path on which a cloud goes through
CROSSED_M = 4.0
# Log of the share of a cloud that finds no other way, below which it went through a wall: one edge of a door leaves more
THROUGH = math.log(1 / 100)
# Probabilities that a cloud is right; assumed, not measured.
DOUBTED = 0.5  # of the tracked one, below which a search begins
AGREED = 0.95  # of the tracked one and of the search about it, above which a search ends
BELIEVED = 0.99  # of the tracked one, above which the plan supports it
UNSTATED = 0.7  # prior of any other start, if the plan fits: the cloud has not yet predicted echoes
# At most of the tracked one, while a search that disagrees with it is young: one search in five loses the true place by chance
UNDECIDED = 0.8
FOUND = 0.95  # of the search's, once it is in one place, above which it is tracked
REJECTED = 0.003  # of the search's, below which it begins anew: a doorway costs a right one a factor of twenty
WIDE_DOUBTED = 0.05  # of a stated start that has not contracted yet, below which a search begins: echoes are weak evidence for a wide cloud
REFUTED = -5.0  # log-odds of a doubted cloud below which it was wrong, even if a search agrees with it later
ALIKE_NATS = 8.0  # of evidence that a wrong place gains by being alike, before a search has found another
EVIDENCE_M = 20.0  # path on which a search has to predict echoes before it counts against the tracked one
ELSEWHERE = 0.05  # weight of a search near the tracked cloud, below which it disagrees with the tracked cloud
LEVEL_M = 20.0  # added to FOUND_WITHIN_M for each level more: levels are often alike but for their doors


def log_odds(probability: float) -> float:
    """Of a probability below 1."""
    return math.log(probability / (1.0 - probability))


def probability_of(log_odds: float) -> float:
    """The inverse."""
    return 1.0 / (1.0 + math.exp(-log_odds))


def beyond_errors_that_stay(log_ratio: Floats, power: Floats) -> Floats:
    """Evidence (k,) of pings for a cloud: their log-ratios, reduced towards 0 by what a persistent error explains.

    `power` (k,): that of the ping, times the probability that the view is as planned: a hidden view has no such errors.
    """
    return np.asarray(np.sign(log_ratio) * np.maximum(np.abs(log_ratio) - STAYS * power, 0.0))


class Plausibility:
    """Log-odds of right against wrong: of one cloud, or of the plan."""

    def __init__(self, prior: float) -> None:
        self.log_odds = log_odds(prior)

    @property
    def probability(self) -> float:
        """That the cloud is right."""
        return probability_of(self.log_odds)

    def add(self, log_ratio: float) -> None:
        """One observation: the log of its density if right over that if wrong."""
        self.log_odds = min(max(self.log_odds + log_ratio, LEAST_LOG_ODDS), MOST_LOG_ODDS)

    def update(self, log_ratio: Floats, log_passed: float, path_m: float) -> None:
        """Pings on a path of this length, each with the log of its density under the cloud over its density without it, both to its power.

        `log_passed`: log of the share of the cloud that crossed no wall on it.
        """
        for value in [max(log_passed, UNPLANNED_DOOR), *log_ratio.tolist()]:
            self.add(value)
        self._forget(WRONG_PER_M * path_m)

    def limit(self, most: float) -> None:
        """Let the probability be at most `most`."""
        self.log_odds = min(self.log_odds, log_odds(most))

    def raise_to(self, least: float) -> None:
        """Let the probability be at least `least`."""
        self.log_odds = max(self.log_odds, log_odds(least))

    def doubt(self, share: float) -> None:
        """Move this share of the probability of right to wrong."""
        self._forget(share)

    def _forget(self, share: float) -> None:
        right = self.probability * (1.0 - share)
        self.log_odds = log_odds(right)


def away_m(one: Pose, other: Pose) -> float:
    """Distance of two places on one level; infinite on different ones."""
    if one.level != other.level:
        return math.inf
    return math.hypot(other.x_m - one.x_m, other.y_m - one.y_m)


class PlanVerdict:
    """`probability` that the plan fits, given the outcomes reported so far: clouds confirmed or doubted, searches, crossed walls."""

    def __init__(self, plan_sd_m: float = 0.0) -> None:
        """`plan_sd_m`: error of the walls' positions that the plan states."""
        self._log_through = math.log(FAILS if plan_sd_m == 0.0 else GRAZED)
        self._fits = Plausibility(PLAN_FITS)
        self._crossed: list[Pose] = []
        self._log_passed = 0.0  # of a believed cloud on the last CROSSED_M, log of the share that went through no wall
        self._start_rejected = False
        self._taken = 0.0  # log-odds that the last rejection took

    @property
    def probability(self) -> float:
        """That the plan is the building's."""
        return self._fits.probability

    def confirm(self, path_m: float) -> None:
        """Count for the plan: a cloud was believed on this length of path."""
        self._gain(path_m / ALIKE_M)

    def fail_search(self) -> None:
        """Count against the plan: a search has found nothing, or a wrong place."""
        self._fits.add(math.log(FAILS))

    def reject_start(self, path_m: float) -> None:
        """A stated start is doubted after this length of path."""
        self._start_rejected = True
        self._reject(path_m)

    def reject_found(self, late_m: float) -> None:
        """The place that a search has found is doubted, `late_m` of path after a search should have found."""
        self._reject(late_m)

    def agree(self) -> None:
        """A search agrees with the cloud that was doubted, so that was right."""
        self._gain(self._taken)
        self._forget_rejection()

    def find(self, after_m: float, off_m: float) -> None:
        """A search has found a place after this length of path, so far off the cloud that was doubted.

        Soon and near, it was the stated start that was a little wrong.
        """
        if self._start_rejected:
            self._gain(self._taken if after_m < EARLY_M and off_m < START_ERROR_M else math.log(FAR))
        self._log_passed = 0.0
        self._forget_rejection()

    def pass_walls(self, at: Pose, path_m: float, log_passed: float) -> float:
        """A believed cloud has moved so far to this place; `log_passed`: log of the share that crossed no wall. Returns the evidence for the cloud.

        If hardly any of it found another way, the plan is wrong there. That counts once per wall, and is no evidence about the cloud afterwards.
        """
        if self._has_crossed(at):
            self._log_passed = 0.0
            return 0.0
        self._log_passed = self._log_passed * math.exp(-path_m / CROSSED_M) + log_passed
        if self._log_passed < THROUGH:
            self._crossed.append(at)
            self._fits.add(self._log_through)
        return log_passed

    def _has_crossed(self, at: Pose) -> bool:
        return any(away_m(was, at) <= CROSSED_M for was in self._crossed)

    def _reject(self, path_m: float) -> None:
        """Count against the plan that a cloud is doubted which was wrong from the first, if this path is short enough for that."""
        self._taken = -math.log(FAILS) if path_m < EARLY_M else 0.0
        self._gain(-self._taken)

    def _forget_rejection(self) -> None:
        self._start_rejected, self._taken = False, 0.0

    def _gain(self, log_odds: float) -> None:
        self._fits.add(log_odds)
        self._fits.limit(MOST_FITS)


@dataclass(slots=True)
class CloudHypothesis:
    """A cloud as a hypothesis of the trunk's place, and the probability that it is right.

    `is_stated`: it began at a stated start, so it should explain the echoes from the first on. `has_contracted`: it was contracted once; before that,
    echoes are weak evidence. `evidence_m`: length of the path on which the echoes that it predicted were evidence. `doubts`: log-odds that ranges to
    beacons of each teammate have taken from it.
    """

    cloud: Cloud
    plausibility: Plausibility
    is_stated: bool = False
    has_contracted: bool = False
    evidence_m: float = 0.0
    doubts: dict[str, float] = field(default_factory=dict)


def right_against(tracked: CloudHypothesis, search: CloudHypothesis, log_odds_before: float) -> float:
    """Probability that the tracked cloud is right while a search disagrees with it, or has found none; `log_odds_before`: when the search began."""
    log_odds, alike = tracked.plausibility.log_odds, ALIKE_NATS
    if search.evidence_m > EVIDENCE_M:
        return probability_of(log_odds - search.plausibility.log_odds)
    if search.cloud.is_searching:  # no rival yet: evidence from before the search cannot stem from likeness
        alike = min(max(log_odds - log_odds_before, 0.0), ALIKE_NATS)
    return min(probability_of(log_odds - alike), UNDECIDED)
