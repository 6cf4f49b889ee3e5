# SPDX-License-Identifier: MIT
"""Which floor: the stays of a recorded barometer on the levels of a building, and the way between them.

In: `HeightRecord`, heights of the levels. Out: `Floors`: floor, its probability and the height at each sample. Owns nothing.

A hypothesis is a start and a level for each stay, or none: a rest on a landing. A rise between two stays that does not fit the levels costs what
it costs in the tracker, `pressure_cost`; of hypotheses with the same start and the same last stay on a level the likeliest remains. All are compared
at the end of the record, so an unknown start is resolved by the whole walk. Between stays the floor is the one nearest to the height.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from echostep.arrays import Floats, Ints
from echostep.height.levels import ClimbSettings, drift_m, level_change_model, pressure_cost
from echostep_app.offline.floors.stays import AIR_SD_M, NEAR, HeightRecord, Stay

CLIMBING = ClimbSettings()
TIED = 0.9  # of the best floor's probability: then the lowest of them is named
# Assumed, as those of the stays
SCALE = 0.02  # of a rise: temperature of the air, stack effect
REST, REST_S = 2.0, 20.0  # log-weight that a rest on a landing costs, and the time in which it costs 1 more
BEYOND_M = 1.0  # above the highest level and below the lowest: there no landing is
UNLIKELY, MOST = 15.0, 300  # hypotheses are dropped that cost so much more than the best; most that are kept
NEGLIGIBLE_P = 1e-3
UNCLEAR_M = 0.15  # from the middle between two levels: there the floor stays what it was
SMOOTH_S = 2.0  # to either side, over which the height on the way is a median


@dataclass(frozen=True, slots=True)
class Floors:
    """At samples (n,): `floor`, the most probable index into `heights_m` (k,), its `probability`, and `height_m` in their frame."""

    t_s: Floats
    heights_m: Floats
    floor: Ints
    probability: Floats
    height_m: Floats


class Hypothesis(NamedTuple):
    """`cost`: log-weight lost so far; `start`: the first level; `stay`, `level`: the last stay on a level; `before`: the hypothesis until then."""

    cost: float
    start: int
    stay: int
    level: int
    before: Hypothesis | None


def record_floors(t_s: Floats, record: HeightRecord, heights_m: Floats, start: int | None = None) -> Floors:
    """Floors at samples (n,), each by the whole record; `start`: index of the first floor, where it is known."""
    hypotheses = _hypotheses(record, heights_m, start)
    weight = np.exp(hypotheses[0].cost - np.array([each.cost for each in hypotheses]))
    weight /= weight.sum()
    here = np.arange(len(record.t_s))
    probability, height_m = np.zeros((len(here), len(heights_m))), np.zeros(len(here))
    for w, hypothesis in zip(weight.tolist(), hypotheses, strict=True):
        if w > NEGLIGIBLE_P:
            floor, above_m = _way(record, heights_m, hypothesis)
            probability[here, floor] += w
            height_m += w * above_m
    total = probability[0].sum()
    floor = np.argmax(probability >= TIED * probability.max(axis=1, keepdims=True), axis=1)
    at, sure = record.segment, probability[here, floor] / total
    return Floors(t_s, heights_m, floor[at], sure[at], np.interp(t_s, record.t_s, height_m / total))


def _hypotheses(record: HeightRecord, heights_m: Floats, start: int | None) -> list[Hypothesis]:
    """The likely hypotheses at the end of the record, the best one first."""
    likely = [Hypothesis(0.0, k, 0, k, None) for k in range(len(heights_m)) if start in (None, k)]
    for stay in range(1, len(record.stays)):
        best: dict[tuple[int, int, int], Hypothesis] = {}
        for hypothesis in likely:
            for after in _successors(record, heights_m, hypothesis, stay):
                state = after.start, after.stay, after.level
                if state not in best or after.cost < best[state].cost:
                    best[state] = after
        ranked = sorted(best.values(), key=lambda each: each.cost)
        likely = [each for each in ranked[:MOST] if each.cost < ranked[0].cost + UNLIKELY]
    return likely


def _successors(record: HeightRecord, heights_m: Floats, here: Hypothesis, stay: int) -> Iterator[Hypothesis]:
    """The hypothesis after one more stay: on one of the two nearest levels, or on a landing; after a gust on the same level."""
    last, next_ = record.stays[here.stay], record.stays[stay]
    if record.gust[stay] and here.stay == stay - 1:
        yield Hypothesis(here.cost, here.start, stay, here.level, here)
        return
    rise_m = next_.first_m - last.last_m
    height_m = heights_m[here.level] + rise_m
    drifts_m = drift_m(CLIMBING, float(record.t_s[next_.begin] - record.t_s[last.end - 1]))
    sd_m = math.hypot(CLIMBING.landing_sd_m, SCALE * rise_m, drifts_m, AIR_SD_M)
    for level in np.argsort(np.abs(heights_m - height_m), kind="stable")[:2].tolist():
        cost = pressure_cost(height_m - heights_m[level], sd_m**2, level_change_model(CLIMBING))
        yield Hypothesis(here.cost + cost, here.start, stay, level, here)
    rest = REST + float(record.t_s[next_.end - 1] - record.t_s[next_.begin]) / REST_S
    outside = not heights_m[0] - BEYOND_M < height_m < heights_m[-1] + BEYOND_M
    yield here._replace(cost=here.cost + rest + outside * CLIMBING.unlikely)


def _way(record: HeightRecord, heights_m: Floats, hypothesis: Hypothesis) -> tuple[Ints, Floats]:
    """Floor and height (m,) of a hypothesis at each segment."""
    nodes = [hypothesis]
    while nodes[-1].before is not None:
        nodes.append(nodes[-1].before)
    nodes.reverse()
    ends = [(stay.begin, stay.first_m - heights_m[node.level], stay.end - 1, stay.last_m - heights_m[node.level])
            for node in nodes for stay in (record.stays[node.stay],)]  # fmt: skip
    at, lag_m = np.array(ends).reshape(-1, 2).T
    height_m = record.height_m - np.interp(record.t_s, record.t_s[at.astype(int)], lag_m)
    step_s = float(np.median(np.diff(record.t_s))) if len(record.t_s) > 1 else SMOOTH_S
    many = int(SMOOTH_S / step_s)
    smooth_m = np.median(sliding_window_view(np.pad(height_m, many, mode="edge"), 2 * many + 1), axis=1)
    middles_m = 0.5 * (heights_m[1:] + heights_m[:-1])
    is_clear = np.abs(smooth_m[:, None] - middles_m).min(axis=1, initial=math.inf) > UNCLEAR_M
    clear = np.maximum.accumulate(np.where(is_clear, np.arange(len(smooth_m)), 0))
    floor = np.searchsorted(middles_m, smooth_m)[clear]
    for before, node in pairwise([nodes[0], *nodes]):
        last, stay = record.stays[before.stay], record.stays[node.stay]
        floor[stay.begin : stay.end] = node.level
        if before.level == node.level and _is_held(record, last, stay):
            floor[last.end : stay.begin] = node.level
    return floor, height_m


def _is_held(record: HeightRecord, last: Stay, stay: Stay) -> bool:
    """Whether the height between two stays on one level goes away from it in a gust."""
    way_m = np.abs(record.pressure_m[last.end : stay.begin] - record.pressure_m[last.end - 1])
    if not len(way_m):
        return False
    peak = last.end + int(way_m.argmax())
    return record.is_gust(slice(max(last.begin, last.end - NEAR), last.end), slice(peak, peak + 1))
