# SPDX-License-Identifier: MIT
"""The belief as probabilities that are added up, without logarithms.

In: likelihood ratios. Out: probabilities. Owns them: of each cloud, of elsewhere in the building, of another building that is alike here or is not.
"""

from __future__ import annotations

ELSEWHERE, ALIKE, UNLIKE = "elsewhere", "another, alike", "another, not alike"


class NaiveBelief:
    """`probability` of each hypothesis by its name; they sum to 1."""

    def __init__(self, prior: float, plan_fits: float, alike: float) -> None:
        another = 1.0 - plan_fits
        self.probability = {
            "tracked": prior * plan_fits,
            ELSEWHERE: (1.0 - prior) * plan_fits,
            ALIKE: alike * another,
            UNLIKE: (1.0 - alike) * another,
        }

    @property
    def another(self) -> float:
        """Probability of another building."""
        return self.probability[ALIKE] + self.probability[UNLIKE]

    def move(self, stays: float, alike: float) -> None:
        """Another building is as alike as before with the share `stays`, otherwise alike with the share `alike`."""
        p, another = self.probability, self.another
        p[ALIKE] = stays * p[ALIKE] + (1.0 - stays) * alike * another
        p[UNLIKE] = another - p[ALIKE]

    def weigh(self, ratios: dict[str, float]) -> None:
        """Multiply by the ratio of each density to that without a plan; another building that is alike has the density of this one."""
        p, fits = self.probability, 1.0 - self.another
        here = {name: p[name] * ratios.get(name, 1.0) for name in p.keys() - {ALIKE, UNLIKE}}
        new = here | {ALIKE: p[ALIKE] * sum(here.values()) / fits, UNLIKE: p[UNLIKE]}
        self.probability = {name: value / sum(new.values()) for name, value in new.items()}

    def leave(self, share: float) -> None:
        """Clouds lose this share to elsewhere."""
        p = self.probability
        for name in p.keys() - {ELSEWHERE, ALIKE, UNLIKE}:
            p[ELSEWHERE] += share * p[name]
            p[name] *= 1.0 - share

    def begin_search(self, ratio: float) -> None:
        """What is elsewhere becomes a search, with this ratio on the path that it has searched, which counts only against it."""
        self.probability["search"] = self.probability.pop("search", 0.0) + self.probability[ELSEWHERE]
        self.probability[ELSEWHERE] = 0.0
        self.weigh({"search": min(ratio, 1.0)})
