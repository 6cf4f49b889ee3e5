# SPDX-License-Identifier: MIT
"""The belief as probabilities that are added up, without logarithms.

In: likelihood ratios. Out: probabilities. Owns them: of each cloud, of elsewhere in the building, of another building.
"""

from __future__ import annotations

ELSEWHERE, ANOTHER = "elsewhere", "another"


class NaiveBelief:
    """`probability` of each hypothesis by its name; they sum to 1."""

    def __init__(self, prior: float, plan_fits: float) -> None:
        self.probability = {
            "tracked": prior * plan_fits,
            ELSEWHERE: (1.0 - prior) * plan_fits,
            ANOTHER: 1.0 - plan_fits,
        }

    def weigh(self, ratios: dict[str, float]) -> None:
        """Multiply by the ratio of each density to that without a plan."""
        p = {name: value * ratios.get(name, 1.0) for name, value in self.probability.items()}
        self.probability = {name: value / sum(p.values()) for name, value in p.items()}

    def leave(self, share: float) -> None:
        """Clouds lose this share to elsewhere."""
        p = self.probability
        for name in p.keys() - {ELSEWHERE, ANOTHER}:
            p[ELSEWHERE] += share * p[name]
            p[name] *= 1.0 - share

    def begin_search(self, ratio: float) -> None:
        """What is elsewhere becomes a search, with this ratio on the path that it has searched."""
        self.probability["search"] = self.probability.pop("search", 0.0) + self.probability[ELSEWHERE]
        self.probability[ELSEWHERE] = 0.0
        self.weigh({"search": ratio})
