# SPDX-License-Identifier: MIT
"""The places that fit, as a sentence: "1, 3 in North corridor 62 % · 2 in South corridor 31 %"; the numbers match the rings on the map.

In: an estimate, its hypotheses' places in words, a plan. Out: which are shown, their numbers; words. `PlaceNumbers` owns the numbers of a walk: a
place keeps its own while it stays, so that it can be said by radio.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import count

from echostep.localization import Estimate, LikelyPlace
from echostep.plan import Plan

SAME_M = 3.0  # by which a place moves from one estimate to the next at most; assumed
KEPT_S = 10.0  # for which the number of a place that no longer fits is given to no other; assumed


def shown_places(estimate: Estimate) -> tuple[LikelyPlace, ...]:
    """The hypotheses that are listed and ringed: not a single one where the position, which has its ellipse, is claimed."""
    return () if estimate.is_one_place and estimate.claims_place else estimate.hypotheses


class PlaceNumbers:
    """`of` is called with each new estimate of a walk."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[float, LikelyPlace]] = {}  # when and where each number was used last

    def of(self, estimate: Estimate) -> tuple[int, ...]:
        """The numbers of the places that are shown: a place that was known keeps its number, the nearest first; others get free ones."""
        shown = shown_places(estimate)
        self._known = {n: seen for n, seen in self._known.items() if 0.0 <= estimate.t_s - seen[0] < KEPT_S}
        numbers: dict[int, int] = {}
        for _, k, n in sorted(self._pairs(shown)):
            if k not in numbers and n not in numbers.values():
                numbers[k] = n
        free = (n for n in count(1) if n not in self._known)
        found = tuple(numbers[k] if k in numbers else next(free) for k in range(len(shown)))
        self._known |= {n: (estimate.t_s, place) for n, place in zip(found, shown, strict=True)}
        return found

    def _pairs(self, shown: Sequence[LikelyPlace]) -> Iterator[tuple[float, int, int]]:
        """Distance, index and number of each place that may be a known one."""
        for k, place in enumerate(shown):
            for n, (_, known) in self._known.items():
                away_m = math.hypot(place.x_m - known.x_m, place.y_m - known.y_m)
                if place.level == known.level and away_m < SAME_M:
                    yield away_m, k, n


def numbered(estimate: Estimate, numbers: Sequence[int]) -> list[tuple[int, LikelyPlace]]:
    """The places that are shown with their numbers, in the order of these; without numbers by their rank."""
    shown = shown_places(estimate)
    known = numbers if len(numbers) == len(shown) else range(1, len(shown) + 1)
    return sorted(zip(known, shown, strict=True), key=lambda pair: pair[0])


def places_text(places: Sequence[tuple[int, LikelyPlace]], words: Sequence[str], plan: Plan) -> str:
    """Each place once with the numbers and the probability of its hypotheses, in the order of the numbers; empty without hypotheses."""
    numbers: dict[str, list[str]] = {}
    probability: dict[str, float] = {}
    for (number, place), where in zip(places, words, strict=True):
        floor = f", {plan.levels[place.level].name}" if len(plan.levels) > 1 else ""
        name = f"{where or f'x {place.x_m:.0f}, y {place.y_m:.0f} m'}{floor}"
        numbers.setdefault(name, []).append(str(number))
        probability[name] = probability.get(name, 0.0) + place.probability
    texts = [f"{', '.join(numbers[name])} {name} {100.0 * share:.0f} %" for name, share in probability.items()]
    return f"places that fit: {' · '.join(texts)}" if texts else ""
