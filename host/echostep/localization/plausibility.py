# SPDX-License-Identifier: MIT
"""The probability that the wearer is where a cloud says, from how well the cloud foretells the echoes.

In: of each ping the log of its density under the cloud and without it (`background`). Out: a probability. Owns the log-odds.

A hidden Markov model of two states, right and wrong [Rabiner 1989, forward algorithm]. If the cloud is right, echoes have the density that it
foretells. If it is wrong, the wearer is anywhere: then a view goes on as it was, or changes to any in the building (`background`). So a cloud gains
nothing by foretelling that a corridor goes on, but by foretelling where it ends. On every metre a right cloud may become wrong (carried, a wall that
is not on the plan, a door that is a wall): WRONG_PER_M.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats

# All by reason.
WRONG_PER_M = 2e-5  # probability that a right cloud becomes wrong on a metre of the path: once in 50 km
UNPLANNED_DOOR = -6.0  # log-probability (1 in 400) that a way leads through a wall of the plan all the same
STATED = 0.99  # prior probability of a stated start
# Of a ping's log-ratio, up to which it tells nothing: an error of one standard deviation that stays along a wall (plan, sway, speed of sound) is the
# cloud's alone, for a rival that follows the wall learns it
STAYS = 0.5
LEAST, MOST = (
    -6.0,
    12.0,
)  # log-odds are kept between these: a wrong cloud that becomes right is believed again within some metres


def log_odds(probability: float) -> float:
    """Of a probability below 1."""
    return math.log(probability / (1.0 - probability))


def probability_of(log_odds: float) -> float:
    """The inverse."""
    return 1.0 / (1.0 + math.exp(-log_odds))


def beyond_errors_that_stay(log_ratio: Floats, power: Floats) -> Floats:
    """What the log-ratios of pings (k,) tell of a cloud: nothing up to what errors that stay explain, less by that beyond.

    `power` (k,): that of the ping, times the probability that the view is as planned: a hidden one has no such errors.
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
        self.log_odds = min(max(self.log_odds + log_ratio, LEAST), MOST)

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
