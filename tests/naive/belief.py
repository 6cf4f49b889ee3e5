# SPDX-License-Identifier: MIT
"""The belief as probabilities that are added up, without logarithms.

In: likelihood ratios. Out: probabilities. Owns them: of each cloud and of elsewhere in the building; of this building and another, each with a cloud
that predicts the echoes and without one.
"""

from __future__ import annotations

import math

ELSEWHERE = "elsewhere"
THIS, ANOTHER = "this", "another"


class NaiveBelief:
    """`place`: probability of each place if the plan fits; `building`: of each building, with a cloud that predicts and without. Both sum to 1."""

    def __init__(self, prior: float, plan_fits: float, lengths_m: dict[str, tuple[float, float]]) -> None:
        self.place = {"tracked": prior, ELSEWHERE: 1.0 - prior}
        self._lengths_m = lengths_m
        alike = lengths_m[ANOTHER][0] / sum(lengths_m[ANOTHER])
        self.building = {
            (THIS, True): plan_fits * prior,
            (THIS, False): plan_fits * (1.0 - prior),
            (ANOTHER, True): (1.0 - plan_fits) * alike,
            (ANOTHER, False): (1.0 - plan_fits) * (1.0 - alike),
        }

    @property
    def plan_fits(self) -> float:
        """Probability of this building."""
        return self.building[THIS, True] + self.building[THIS, False]

    def weigh(self, ratios: dict[str, float], path_m: float = 0.0) -> None:
        """Multiply by the ratio of each density to that without a plan, on so much path."""
        new = {name: value * ratios.get(name, 1.0) for name, value in self.place.items()}
        total = sum(new.values())
        self.place = {name: value / total for name, value in new.items()}
        for where, (with_m, without_m) in self._lengths_m.items():
            self._move(where, with_m, without_m, path_m)
            self.building[where, True] *= total
        every = sum(self.building.values())
        self.building = {key: value / every for key, value in self.building.items()}

    def _move(self, where: str, with_m: float, without_m: float, path_m: float) -> None:
        """In each of many short pieces of the path a share of both states changes to the other: the limit of it."""
        both = self.building[where, True] + self.building[where, False]
        end = both * with_m / (with_m + without_m)
        left = (self.building[where, True] - end) * math.exp(-path_m / with_m) * math.exp(-path_m / without_m)
        self.building[where, True], self.building[where, False] = end + left, both - end - left

    def leave(self, share: float) -> None:
        """Clouds lose this share to elsewhere."""
        for name in self.place.keys() - {ELSEWHERE}:
            self.place[ELSEWHERE] += share * self.place[name]
            self.place[name] *= 1.0 - share

    def begin_search(self, ratio: float) -> None:
        """What is elsewhere becomes a search, with this ratio on the path that it has searched, which counts only against it."""
        self.place["search"] = self.place.pop("search", 0.0) + self.place[ELSEWHERE]
        self.place[ELSEWHERE] = 0.0
        self.weigh({"search": min(ratio, 1.0)})
