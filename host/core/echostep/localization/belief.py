# SPDX-License-Identifier: MIT
"""The belief: how probable each hypothesis of the trunk's place is.

In: for each cloud, logs of its density of the last echoes over the density without a plan (`echoes.unplanned`), and of its share crossing no wall.
Out: probabilities. Owns their logarithms.

Hypotheses: the trunk is in one of the clouds; where a search has not found it yet; `elsewhere` in this building, with the density without a plan; in
another building than the plan's. Bayes' rule compares them by predictive density [Bar-Shalom et al. 2001, ch. 11]. A search of the building takes the
mass of `elsewhere`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np

from echostep.localization.grid.search import Search
from echostep.localization.particles.cloud import Cloud
from echostep.localization.settings import UNPLANNED_DOOR
from echostep.particles.limits import PROBABLE, SURE
from echostep.plan import Pose

# Assumed, not measured.
PLAN_FITS = 0.99  # prior probability that the plan is the building's
# Mean lengths of the path on which a cloud predicts the echoes, and on which none does. In this building until one goes wrong (a turn that is
# measured badly: once in 1.8 km of simulated soak), and until a search has found (95 % within 40 m); in another while parts are alike (wings, levels)
HERE_M, ANOTHER_M = (2000.0, 13.0), (30.0, 60.0)
WRONG_PER_M = 2e-5  # probability that the trunk leaves all clouds on a metre of the path (carried, a door that is no door): once in 50 km
# Power of the echoes' densities: their errors are alike on a longer path than the one on which they count as one (plan, sway, speed of sound)
TEMPER = 0.3
CROSSED_M = 4.0  # from one way through a wall, within which another is through the same one; path of a cloud through it
# Log of the share of a cloud that finds no other way, below which it went through a wall: one edge of a door leaves more
THROUGH = math.log(1 / 100)
# Log of the share that no wall has cut off on CROSSED_M, above which walls only gather a cloud: the jambs of a door
EDGE = math.log(1 / 2)
LEAST = 1e-4  # probability of a cloud below which it ends
LEAST_LOG_ODDS = -700.0  # whose exponential is a number


class CrossedWalls:
    """Walls of the plan that a cloud has crossed as a whole: each is charged once.

    A wall that cuts off an edge of the cloud is not charged: it narrows the cloud, whether that is right or wrong.
    """

    def __init__(self) -> None:
        self._crossed: list[Pose] = []
        self._log_passed = 0.0  # of the last CROSSED_M

    def charge(self, at: Pose, path_m: float, log_passed: float) -> float:
        """Log-evidence of a cloud that has moved by `path_m` to `at`; `log_passed`: log of the share that crossed no wall."""
        if any(
            was.level == at.level and math.hypot(was.x_m - at.x_m, was.y_m - at.y_m) < CROSSED_M
            for was in self._crossed
        ):
            self._log_passed = 0.0
            return 0.0
        self._log_passed = self._log_passed * math.exp(-path_m / CROSSED_M) + log_passed
        if self._log_passed > EDGE:
            return 0.0
        if self._log_passed < THROUGH:
            self._crossed.append(at)
        return log_passed


Place = TypeVar("Place", Cloud, Search)


@dataclass(slots=True, eq=False)
class Hypothesis(Generic[Place]):
    """The trunk is in this cloud, or where this search may find it. `log_weight`: of its probability.

    `crossed`: walls that the cloud has crossed. `doubts`: log-odds that ranges to beacons of each teammate have taken from it. `table`: the same
    cloud on a grid, while a search is compared with it: by the range table, too.
    """

    cloud: Place
    log_weight: float
    crossed: CrossedWalls = field(default_factory=CrossedWalls)
    doubts: dict[str, float] = field(default_factory=dict)
    table: Search | None = None


AnyHypothesis = Hypothesis[Cloud] | Hypothesis[Search]


class Belief:
    """Log-weights of the hypotheses and of `elsewhere`, which sum to 1, and the log-odds of their building against another.

    `clouds`: of places that are stated or were found, the tracked one first. `search`: of those that are not found yet.
    """

    def __init__(self, cloud: Cloud | None, prior: float, plan_fits: float) -> None:
        """Prior probabilities: that the trunk is in the cloud, without which a search has to begin; that the plan is the building's."""
        self.clouds = [] if cloud is None else [Hypothesis(cloud, _log(prior))]
        self.search: Hypothesis[Search] | None = None
        self.searches_begun = 0
        self.log_elsewhere = 0.0 if cloud is None else _log(1.0 - prior)
        self._log_odds = _log(plan_fits) - _log(1.0 - plan_fits)
        # Probability that a hypothesis predicts the echoes, in this building and in another
        self._well = 1.0 if cloud is None else prior, _mean_share(ANOTHER_M)

    @property
    def hypotheses(self) -> list[AnyHypothesis]:
        """All that have a place, the tracked one first: a search is tracked where there is no cloud."""
        return [*self.clouds] if self.search is None else [*self.clouds, self.search]

    @property
    def parts(self) -> list[Cloud | Search]:
        """The clouds with their tables, and the search."""
        tables = [each.table for each in self.clouds if each.table is not None]
        return [*(each.cloud for each in self.hypotheses), *tables]

    @property
    def tracked(self) -> AnyHypothesis:
        """The first of all."""
        return self.hypotheses[0]

    @property
    def plan_fits(self) -> float:
        """Probability that the plan is the building's."""
        return 1.0 / (1.0 + math.exp(-max(self._log_odds, LEAST_LOG_ODDS)))

    def probability(self, each: AnyHypothesis) -> float:
        """Probability that the trunk is there; if the plan is SURE to be the building's, conditional on that."""
        fits = self.plan_fits
        return math.exp(each.log_weight) * (1.0 if fits >= SURE else fits)

    @property
    def right(self) -> float:
        """Probability that the trunk is in the tracked cloud."""
        return self.probability(self.tracked)

    @property
    def is_searching(self) -> bool:
        """Whether the building is searched, or was, and a rival of the tracked cloud was found."""
        return self.search is not None or len(self.clouds) > 1

    @property
    def is_doubted(self) -> bool:
        """Whether the trunk is probably in no hypothesis, if the plan fits."""
        return math.exp(self.log_elsewhere) > PROBABLE

    def normalise(self) -> float:
        """Scale the weights to the sum 1; returns the logarithm of their sum before."""
        total = float(np.logaddexp.reduce([self.log_elsewhere, *(each.log_weight for each in self.hypotheses)]))
        for each in self.hypotheses:
            each.log_weight -= total
        self.log_elsewhere -= total
        return total

    def judge_plan(self, path_m: float = 0.0) -> None:
        """Normalise; the sum of the weights before is evidence for the plan.

        `path_m`: length of the path on which they were changed. A plan that fits has clouds that predict the echoes nearly always, and soon again;
        another building's plan has them where it is alike. So the plan is judged by a hidden Markov model of two states for each [Rabiner 1989].
        """
        total = self.normalise()
        here, log_here = _predicted(self._well[0], HERE_M, path_m, total)
        there, log_there = _predicted(self._well[1], ANOTHER_M, path_m, total)
        self._well = here, there
        self._log_odds += log_here - log_there

    def weigh_clouds(self, evidence: Sequence[tuple[float, float]]) -> None:
        """Multiply each cloud by its density of pings over the density without a plan, and by the share that crossed no wall, given as logarithms.

        The plan's errors are common to all clouds: among these a density counts as among particles, and their mean as that of one cloud.
        """
        before = [each.log_weight for each in self.clouds]
        after = [log_weight + log_pings for log_weight, (log_pings, _) in zip(before, evidence, strict=True)]
        log_mean = float(np.logaddexp.reduce(after) - np.logaddexp.reduce(before)) if before else 0.0
        for each, log_weight, (_, log_passed) in zip(self.clouds, after, evidence, strict=True):
            each.log_weight = log_weight - (1.0 - TEMPER) * log_mean + max(log_passed, UNPLANNED_DOOR)

    def weigh_search(self, log_pings: float) -> None:
        """Multiply the search by its density of pings over the density without a plan that is as inexact, given as a logarithm."""
        if self.search is not None:
            self.search.log_weight += TEMPER * log_pings

    def weigh_heights(self, log_means: Sequence[float]) -> None:
        """Multiply the hypotheses by the mean factors of their heights, given as logarithms, relative to the greatest: they carry no information
        about the plan.
        """
        for each, log_mean in zip(self.hypotheses, log_means, strict=True):
            each.log_weight += log_mean - max(log_means)

    def leave(self, share: float) -> None:
        """Move this share of each hypothesis's weight to `elsewhere`."""
        for each in self.hypotheses:
            self._move(each, share)

    def begin_search(self, search: Search, log_pings: float) -> None:
        """Let a search begin elsewhere; `log_pings`: log of its density of the path that it has searched over the density without a plan.

        It replaces an earlier search that has found nothing.
        """
        self.searches_begun += 1
        if self.search is not None:
            self._move(self.search, 1.0)
        self.search = Hypothesis(search, self.log_elsewhere + min(TEMPER * log_pings, 0.0))
        self.log_elsewhere = -math.inf
        self.judge_plan()

    def find(self, found: Sequence[tuple[Cloud, float]]) -> None:
        """The search is over if it has found clouds, each with its share of the search. The rest stays elsewhere."""
        if self.search is not None and found:
            self.clouds += [Hypothesis(cloud, self.search.log_weight + _log(share)) for cloud, share in found]
            self.search.log_weight += _log(1.0 - sum(share for _, share in found))
            self.end(self.search)

    def merge(self, rival: Hypothesis[Cloud]) -> None:
        """A rival is where the tracked cloud is."""
        self.tracked.log_weight = float(np.logaddexp(self.tracked.log_weight, rival.log_weight))
        self.clouds.remove(rival)

    def prune(self) -> None:
        """Track the likeliest cloud, and end improbable hypotheses."""
        self.clouds.sort(key=lambda each: -each.log_weight)
        for each in reversed(self.hypotheses):
            if each.log_weight < math.log(LEAST) and len(self.hypotheses) > 1:
                self.end(each)

    def end(self, each: AnyHypothesis) -> None:
        """End a hypothesis: the trunk is elsewhere."""
        self._move(each, 1.0)
        self.clouds = [cloud for cloud in self.clouds if cloud is not each]
        if self.search is each:
            self.search = None
            for cloud in self.clouds:
                cloud.table = None

    def raise_to(self, each: AnyHypothesis, least: float) -> None:
        """Raise the probability of a hypothesis, if the plan fits, to at least `least`."""
        was = math.exp(each.log_weight)
        if was < least:
            each.log_weight = _log(least) - _log(1.0 - least) + _log(1.0 - was)
            self.normalise()

    def _move(self, each: AnyHypothesis, share: float) -> None:
        self.log_elsewhere = float(np.logaddexp(self.log_elsewhere, each.log_weight + _log(share)))
        each.log_weight += _log(1.0 - share)


def _mean_share(lengths_m: tuple[float, float]) -> float:
    return lengths_m[0] / (lengths_m[0] + lengths_m[1])


def _predicted(well: float, lengths_m: tuple[float, float], path_m: float, log_ratio: float) -> tuple[float, float]:
    """The probability that a cloud predicts the echoes after a move, and the log of the measurements' density over the density without a plan.

    `well`: the probability before; `lengths_m`: mean lengths of the path with and without such a cloud; `log_ratio`: of the density with one.
    """
    stays = math.exp(-path_m * (1.0 / lengths_m[0] + 1.0 / lengths_m[1]))
    well = stays * well + (1.0 - stays) * _mean_share(lengths_m)
    log_density = float(np.logaddexp(log_ratio + _log(well), _log(1.0 - well)))
    return math.exp(log_ratio + _log(well) - log_density), log_density


def _log(probability: float) -> float:
    return math.log(probability) if probability > 0.0 else -math.inf
