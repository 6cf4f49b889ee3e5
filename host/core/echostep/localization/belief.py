# SPDX-License-Identifier: MIT
"""The belief: how probable each hypothesis of the trunk's place is.

In: for each cloud, logs of its density of the last echoes over the density without a plan (`echoes.unplanned`), and of its share crossing no wall.
Out: probabilities. Owns their logarithms.

Hypotheses: the trunk is in a cloud, tracked or searching; `elsewhere` in this building, with the density without a plan; in another building than
the plan's. Bayes' rule compares them by predictive density [Bar-Shalom et al. 2001, ch. 11]. A search of the building takes the mass of `elsewhere`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from echostep.height.levels import HeightChange
from echostep.localization.grid.search import Search
from echostep.localization.particles.cloud import Cloud
from echostep.localization.settings import UNPLANNED_DOOR
from echostep.particles.arrays import Move
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
BY_CHANCE = 0.3  # of a search's mass, that stays elsewhere when it has found a place: a table is no exact likelihood
CROSSED_M = 4.0  # from one way through a wall, within which another is through the same one; path of a cloud through it
# Log of the share of a cloud that finds no other way, below which it went through a wall: one edge of a door leaves more
THROUGH = math.log(1 / 100)
# Log of the share that no wall has cut off on CROSSED_M, above which walls only gather a cloud: the jambs of a door
EDGE = math.log(1 / 2)
LEAST = 1e-4  # probability of a cloud below which it ends
LEAST_LOG_ODDS = -700.0  # whose exponential is a number


@dataclass(slots=True)
class CloudHypothesis:
    """The trunk is in this cloud. `log_weight`: of its probability.

    `table`: the same cloud on a grid, while a search on a grid is compared with it: by the range table, too. `doubts`: log-odds that
    ranges to beacons of each teammate have taken from it.
    """

    cloud: Cloud | Search
    log_weight: float
    table: Search | None = None
    doubts: dict[str, float] = field(default_factory=dict)

    def weigh(self, log_pings: float, log_passed: float) -> None:
        """Multiply by the density of pings over the density without a plan, given as logarithms, and by the share that crossed no wall."""
        self.log_weight += TEMPER * log_pings + max(log_passed, UNPLANNED_DOOR)

    def change_levels(self, move: Move, change: HeightChange) -> float:
        """Update heights and levels after a move; returns the log of the mean factor of the weights."""
        if self.table is not None:
            self.table.change_levels(move, change)
        return self.cloud.change_levels(move, change)


class CrossedWalls:
    """Walls of the plan that the tracked cloud has crossed as a whole: each is charged once.

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


class Belief:
    """Log-weights of the clouds' hypotheses and of `elsewhere`, which sum to 1, and the log-odds of their building against another."""

    def __init__(self, cloud: Cloud | Search, prior: float, plan_fits: float) -> None:
        """Prior probabilities: that the trunk is in the first cloud, if it is in this building; that the plan is the building's."""
        self.tracked = CloudHypothesis(cloud, _log(prior))
        self.search: CloudHypothesis | None = None
        self.searches_begun = 0
        self.log_elsewhere = _log(1.0 - prior)
        self._log_odds = _log(plan_fits) - _log(1.0 - plan_fits)
        # Probability that a cloud predicts the echoes, in this building and in another
        self._well = prior, _mean_share(ANOTHER_M)

    @property
    def clouds(self) -> list[CloudHypothesis]:
        """The hypotheses that have a cloud."""
        return [self.tracked] if self.search is None else [self.tracked, self.search]

    @property
    def parts(self) -> list[Cloud | Search]:
        """The clouds, and the table of one that has one."""
        return [part for each in self.clouds for part in (each.cloud, each.table) if part is not None]

    @property
    def plan_fits(self) -> float:
        """Probability that the plan is the building's."""
        return 1.0 / (1.0 + math.exp(-max(self._log_odds, LEAST_LOG_ODDS)))

    def probability(self, each: CloudHypothesis | None) -> float:
        """Probability that the trunk is in this cloud, 0 if None; if the plan is SURE to be the building's, conditional on that."""
        fits = self.plan_fits
        return 0.0 if each is None else math.exp(each.log_weight) * (1.0 if fits >= SURE else fits)

    @property
    def right(self) -> float:
        """Probability that the trunk is in the tracked cloud."""
        return self.probability(self.tracked)

    @property
    def is_searching(self) -> bool:
        """Whether the building is searched, or was, and a rival of the tracked cloud was found."""
        return self.search is not None or self.tracked.cloud.is_searching

    @property
    def is_doubted(self) -> bool:
        """Whether the trunk is probably in no cloud, if the plan fits."""
        return math.exp(self.log_elsewhere) > PROBABLE

    def normalise(self) -> float:
        """Scale the weights to the sum 1; returns the logarithm of their sum before."""
        total = float(np.logaddexp.reduce([self.log_elsewhere, *(each.log_weight for each in self.clouds)]))
        for each in self.clouds:
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

    def weigh_heights(self, log_means: list[float]) -> None:
        """Multiply the clouds by the mean factors of their heights, given as logarithms, relative to the greatest: they carry no information about
        the plan.
        """
        for each, log_mean in zip(self.clouds, log_means, strict=True):
            each.log_weight += log_mean - max(log_means)

    def leave(self, share: float) -> None:
        """Move this share of each cloud's weight to `elsewhere`."""
        for each in self.clouds:
            self._move(each, share)

    def begin_search(self, cloud: Search, log_pings: float) -> None:
        """Let a cloud search elsewhere; `log_pings`: log of its density of the path that it has searched over the density without a plan.

        It replaces an earlier search that has found nothing.
        """
        self.searches_begun += 1
        if self.search is not None:
            self._move(self.search, 1.0)
        if self.tracked.cloud.is_searching:
            self._move(self.tracked, 1.0)
        begun = CloudHypothesis(cloud, self.log_elsewhere + min(TEMPER * log_pings, 0.0))
        if self.tracked.cloud.is_searching:
            self.tracked, self.search = begun, None
        else:
            self.search = begun
        self.log_elsewhere = -math.inf
        self.judge_plan()

    def find(self, each: CloudHypothesis, found: Cloud) -> None:
        """A search has found a place; from then on it and the tracked cloud are compared by traced echoes."""
        each.cloud = found
        self._move(each, BY_CHANCE)
        self.tracked.table = None

    def merge(self) -> None:
        """The search is where the tracked cloud is."""
        if self.search is not None:
            self.tracked.log_weight = float(np.logaddexp(self.tracked.log_weight, self.search.log_weight))
            self.search = None

    def prune(self) -> None:
        """Track a likelier place that a search has found, and end an improbable cloud."""
        if self.search is None:
            return
        lead = self.search.log_weight - self.tracked.log_weight
        if lead > 0.0 and (not self.search.cloud.is_searching or self.tracked.log_weight < math.log(LEAST)):
            self.tracked, self.search = self.search, self.tracked
        if self.search.log_weight < math.log(LEAST):
            self._move(self.search, 1.0)
            self.search, self.tracked.table = None, None

    def raise_to(self, each: CloudHypothesis, least: float) -> None:
        """Raise the probability of a cloud, if the plan fits, to at least `least`."""
        was = math.exp(each.log_weight)
        if was < least:
            each.log_weight = _log(least) - _log(1.0 - least) + _log(1.0 - was)
            self.normalise()

    def _move(self, each: CloudHypothesis, share: float) -> None:
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
