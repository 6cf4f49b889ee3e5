# SPDX-License-Identifier: MIT
"""The places that fit, as a sentence: "1, 3 in North corridor 62 % · 2 in South corridor 31 %"; the numbers match the rings on the map.

In: an estimate, its hypotheses' places in words, a plan. Out: which are shown; words. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

from echostep.localization import Estimate, LikelyPlace, claims_place
from echostep.plan import Plan


def shown_places(estimate: Estimate) -> tuple[LikelyPlace, ...]:
    """The hypotheses that are listed and ringed: not a single one where the position, which has its ellipse, is claimed."""
    is_position = len(estimate.hypotheses) == 1 and claims_place(estimate)
    return () if is_position else estimate.hypotheses


def places_text(hypotheses: Sequence[LikelyPlace], words: Sequence[str], plan: Plan) -> str:
    """Each place once with the numbers and the probability of its hypotheses, in the order of the numbers; empty without hypotheses."""
    numbers: dict[str, list[str]] = {}
    probability: dict[str, float] = {}
    for k, (place, where) in enumerate(zip(hypotheses, words, strict=True)):
        floor = f", {plan.levels[place.level].name}" if len(plan.levels) > 1 else ""
        name = f"{where or f'x {place.x_m:.0f}, y {place.y_m:.0f} m'}{floor}"
        numbers.setdefault(name, []).append(str(k + 1))
        probability[name] = probability.get(name, 0.0) + place.probability
    texts = [f"{', '.join(numbers[name])} {name} {100.0 * share:.0f} %" for name, share in probability.items()]
    return f"places that fit: {' · '.join(texts)}" if texts else ""
