# SPDX-License-Identifier: MIT
"""Evaluation of a whole record of pressures: unknown heights of the floors, stays on floors, metres climbed.

In: `Pressures`, `Floors`. Out: heights of the floors, `Stay`s, sums, a description. Owns nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats, Ints, spans
from echostep.errors import EchostepError
from echostep_studies.barometer.altitude import Heights, Pressures, heights_above_start, noise_of, observations
from echostep_studies.barometer.floor_filter import CLOSEST_M, Floors, smooth_floors
from echostep_studies.barometer.vertical_model import CLAIMED

Change = tuple[int, int, float]  # of floor: index before, index after, rise (m)

# The source of these limits is not recorded.
MOVING_P = 0.5  # probability of changing floors from which a sample is not part of a stay
SHORTEST_STAY_S = 4.0
SHORTEST_END_S = 1.0  # the same for the first and the last stay of a record
SETTLES_S = 3.0  # of an arrival; the median height over it is compared with that before the departure
LEVEL_S = 8.0  # at either end of a stay, for the pressure's height there
MOST_ROUNDS = 4  # of stays and heights found in turn
SETTLED_M = 0.02  # largest change of the heights in the last round
PASSED_S, PASSED_P = 2.0, 0.8  # shortest stay and probability of changing floors once the heights are known roughly
EDGE_S = 1.5  # left out at either end of a stay, as it may belong to the change of floors
SHIFTS_M = 3.0  # a round that lowers the highest floor by more is undone
DRIFTS_S = 120.0  # total time of stays from which the weather's drift is computed
NOISE_TIMES_S = (0.5, 1.0)  # over which means show slow errors
SMOOTH_PA = 0.02  # steps between readings up to this are not quantization
SAME_STOREY_M = 1.2  # a smaller difference of heights is the same floor
LOWEST_STOREY_M = 2.0  # a floor without changes is kept if it is so far from all others
THINNED_HZ = 10.0  # highest rate after thinning
FEWEST_MEANS = 5  # for a noise
SURE_P = 0.9  # median probability from which the floor is stated without a warning


@dataclass(frozen=True, slots=True)
class Stay:
    """Time on one floor, given by its index."""

    floor: int
    from_s: float
    to_s: float


def thinned(samples: Pressures) -> tuple[Pressures, Ints]:
    """Means of neighbouring samples, at most THINNED_HZ, and the index of each sample's mean (n,)."""
    rate = 1.0 / float(np.median(np.diff(samples.t_s)))
    many = max(1, int(np.ceil(rate / THINNED_HZ - 0.1)))
    group = np.arange(len(samples.t_s)) // many
    count = np.bincount(group)

    def mean(column: Floats) -> Floats:
        return np.asarray(np.bincount(group, column) / count)

    temperature = None if samples.temperature_c is None else mean(samples.temperature_c)
    return Pressures(mean(samples.t_s), mean(samples.pressure_pa), temperature), group


def noise_of_record(samples: Pressures, few: Pressures) -> float:
    """Standard deviation (Pa) of independent noise on the thinned samples `few` that covers all errors of the record.

    Quantization and a filter in the sensor make errors that last; they are estimated from means over NOISE_TIMES_S.
    """
    steps = np.diff(np.unique(samples.pressure_pa))
    steps = steps[steps > SMOOTH_PA]
    noise_pa = max(noise_of(few.pressure_pa), 0.5 * float(np.median(steps)) if len(steps) else 0.0)
    rate = 1.0 / float(np.median(np.diff(few.t_s)))
    for seconds in NOISE_TIMES_S:
        many = round(seconds * rate)
        whole = len(few.t_s) // many * many if many > 1 else 0
        if whole >= FEWEST_MEANS * many > 0:
            noise_pa = max(noise_pa, math.sqrt(many) * noise_of(few.pressure_pa[:whole].reshape(-1, many).mean(axis=1)))
    return noise_pa


def find_storeys(samples: Pressures, noise_pa: float) -> Floats:
    """Heights (k,) above the lowest floor of all floors with a stay; raises EchostepError for a single floor.

    1. Rises between stays give changes of floor: the floor after a change is a known one of the same height, or a new one.
    2. Least squares over all changes gives the heights.
    3. The floor filter with these heights gives the stays; the pressures at the ends of stays give the rises; repeat from 2 until nothing changes.
    """
    changes = _first_changes(_rises(heights_above_start(samples, noise_pa)))
    heights = _apart(_fitted(changes, np.zeros(len({index for change in changes for index in change[:2]}) or 1)))
    claimed_m = observations(samples, noise_pa)[:, CLAIMED]
    for _ in range(MOST_ROUNDS if len(heights) > 1 else 0):
        before = heights
        visited = stays(smooth_floors(samples, heights, noise_pa), PASSED_S, PASSED_P)
        heights = _apart(_fitted(_changes(visited, samples.t_s, claimed_m), before))
        if before[-1] - heights[-1] > SHIFTS_M:  # stays were lost
            heights = before
        if len(heights) == len(before) and np.abs(heights - before).max() < SETTLED_M:
            break
    if len(heights) < 2:
        raise EchostepError("heights: the record shows one storey only: give the heights as --heights 0,3.5,7")
    return np.round(heights, 2)


def _first_changes(rises: list[float]) -> list[Change]:
    """Changes of floor from the rises (m) between stays; floors are numbered in the order of their first stay."""
    known, changes, here = [0.0], [], 0
    for rise in rises:
        height = known[here] + rise
        there = int(np.argmin(np.abs(np.array(known) - height)))
        if abs(known[there] - height) > SAME_STOREY_M:
            there = len(known)
            known.append(height)
        if there != here:
            changes.append((here, there, rise))
        here = there
    return changes


def _changes(visited: list[Stay], t_s: Floats, claimed_m: Floats) -> list[Change]:
    """Changes of floor between stays, by the height from pressure, `claimed_m` (n,) at `t_s` (n,), less the weather's drift.

    The rise goes from the last LEVEL_S of one stay to the first LEVEL_S of the next. The drift is that within the stays.
    """

    def level(from_s: float, to_s: float) -> tuple[float, float]:
        """Mean time and median height in a span, which holds one sample at least."""
        seconds = (t_s >= from_s) & (t_s <= to_s)
        seconds[np.abs(t_s - 0.5 * (from_s + to_s)).argmin()] = True
        return float(t_s[seconds].mean()), float(np.median(claimed_m[seconds]))

    def inner(stay: Stay) -> tuple[float, float]:
        """The stay without its edges."""
        edge = min(EDGE_S, 0.25 * (stay.to_s - stay.from_s))
        return stay.from_s + edge, stay.to_s - edge

    begins = [level(a, min(b, a + LEVEL_S)) for a, b in map(inner, visited)]
    ends = [level(max(a, b - LEVEL_S), b) for a, b in map(inner, visited)]
    drift = np.sum(np.subtract(ends, begins), axis=0) if visited else np.zeros(2)
    rate = drift[1] / drift[0] if drift[0] > DRIFTS_S else 0.0
    return [
        (a.floor, b.floor, after - before - rate * (later - sooner))
        for a, b, (sooner, before), (later, after) in zip(visited, visited[1:], ends, begins[1:], strict=False)
    ]


def _fitted(changes: list[Change], before_m: Floats) -> Floats:
    """Heights above the lowest floor, by least squares over all changes; `before_m` (k,): heights before, by index.

    A floor without a change moves as its neighbours in height do; it is dropped when it is close to another one.
    """
    indices = sorted({index for here, there, _ in changes for index in (here, there)})
    if not indices:
        return np.zeros(1)
    design, rises = np.zeros((len(changes) + 1, len(indices))), np.zeros(len(changes) + 1)
    for row, (here, there, rise) in enumerate(changes):
        design[row, indices.index(here)], design[row, indices.index(there)], rises[row] = -1.0, 1.0, rise
    design[-1, 0] = 1.0  # the first of these floors stays at its height
    fitted = np.linalg.lstsq(design, rises, rcond=None)[0] + before_m[indices[0]]
    order = np.argsort(before_m[indices])
    moved = before_m + np.interp(before_m, before_m[indices][order], (fitted - before_m[indices])[order])
    unvisited = np.abs(moved[:, None] - fitted).min(axis=1) >= LOWEST_STOREY_M
    unvisited[indices] = False
    heights = np.sort(np.concatenate([fitted, moved[unvisited]]))
    return np.asarray(heights - heights[0])


def _apart(heights_m: Floats) -> Floats:
    """The heights (sorted) that are CLOSEST_M or more above the kept one below; the lowest is 0."""
    separate = [0.0]
    for height in heights_m.tolist():
        if height - separate[-1] >= CLOSEST_M:
            separate.append(height)
    return np.array(separate)


def _rises(heights: Heights) -> list[float]:
    """Rise (m) between each two neighbouring stays, which are long stretches without vertical motion; rises within one floor are left out."""
    level = heights.moving < MOVING_P
    stays = [
        (a, b)
        for a, b in spans(level).tolist()
        if heights.t_s[b - 1] - heights.t_s[a] >= (SHORTEST_END_S if a == 0 or b == len(level) else SHORTEST_STAY_S)
    ]
    if len(stays) < 2:  # one change of floors from the first sample to the last
        stays = [(0, 1), (len(level) - 1, len(level))]
    rises = []
    for (_, leaves), (arrives, ends) in zip(stays, stays[1:], strict=False):
        before = heights.height_m[leaves - 1]
        settled = np.searchsorted(heights.t_s[:ends], heights.t_s[arrives] + SETTLES_S)
        rises.append(float(np.median(heights.height_m[arrives : max(settled, arrives + 1)]) - before))
    return [rise for rise in rises if abs(rise) > SAME_STOREY_M]


def stays(floors: Floors, shortest_s: float = SHORTEST_STAY_S, moving_p: float = MOVING_P) -> list[Stay]:
    """Stays in order of time: stretches of one floor, shorter ones left out except at the ends; neighbouring stays on the same floor are one."""
    still = floors.up + floors.down < moving_p
    merged: list[Stay] = []
    floor_or_none = np.where(still, floors.floor, -1)
    edges = np.flatnonzero(np.diff(floor_or_none, prepend=-2, append=-2))
    for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        floor, t0, t1 = int(floor_or_none[a]), float(floors.t_s[a]), float(floors.t_s[b - 1])
        if floor < 0 or (t1 - t0 < shortest_s and a > 0 and b < len(floor_or_none)):
            continue
        if merged and merged[-1].floor == floor:
            t0 = merged.pop().from_s
        merged.append(Stay(floor, t0, t1))
    return merged


def visits(floors: Floors) -> list[Stay]:
    """The stays as `floors.floor` names them at every sample, and the floors at which the way turned without a stay, in order of time.

    Floors that are only passed, or named for less than SHORTEST_STAY_S, are left out. So the rises between visits are those of `floors.floor`.
    """
    edges = np.flatnonzero(np.diff(floors.floor, prepend=-1, append=-1)).tolist()
    raw: list[tuple[Stay, bool]] = []  # and whether it is a stay
    for a, b in zip(edges[:-1], edges[1:], strict=True):
        floor, ends = int(floors.floor[a]), a == 0 or b == edges[-1]
        if still := _still(floors, a, b, SHORTEST_END_S if ends else SHORTEST_STAY_S):
            raw.append((Stay(floor, *still), True))
        elif floors.t_s[b - 1] - floors.t_s[a] >= SHORTEST_STAY_S:
            raw.append((Stay(floor, float(floors.t_s[a]), float(floors.t_s[b - 1])), False))
    merged: list[Stay] = []
    for k, (visit, stayed) in enumerate(raw):
        around = (merged[-1].floor if merged else visit.floor, raw[k + 1][0].floor if k + 1 < len(raw) else visit.floor)
        if stayed or not min(around) < visit.floor < max(around):
            merged.append(visit)
    return merged


def _still(floors: Floors, begin: int, end: int, shortest_s: float) -> tuple[float, float] | None:
    """Times of the first and the last sample of the stretches without vertical motion of at least `shortest_s` among these samples."""
    moving = np.concatenate([[True], (floors.up + floors.down)[begin:end] >= MOVING_P, [True]])
    edges = begin + np.flatnonzero(np.diff(moving)).reshape(-1, 2)
    long = [
        (floors.t_s[a], floors.t_s[b - 1]) for a, b in edges.tolist() if floors.t_s[b - 1] - floors.t_s[a] >= shortest_s
    ]
    return (float(long[0][0]), float(long[-1][1])) if long else None


def climbed_m(heights_m: Floats, visited: list[Stay]) -> tuple[float, float]:
    """Metres up and metres down between the visits, by the heights of the floors (k,)."""
    rises = np.diff([heights_m[stay.floor] for stay in visited])
    return float(rises[rises > 0].sum()), float(np.abs(rises[rises < 0]).sum())


def describe(floors: Floors) -> str:
    """Visits, metres climbed between them, and a warning when the floor is uncertain, a line each."""
    visited = visits(floors)
    lines = [
        f"floor {s.floor} ({floors.heights_m[s.floor]:g} m): {round(s.from_s, 2)} to {round(s.to_s, 2)} s"
        for s in visited
    ]
    up, down = climbed_m(floors.heights_m, visited)
    lines.append(
        f"{len(visited)} stays on {len({s.floor for s in visited})} floors; climbed {up:.1f} m up, {down:.1f} m down; {len(floors.t_s)} samples"
    )
    sure = floors.probability[np.arange(len(floors.t_s)), floors.floor]
    if float(np.median(sure)) < SURE_P:
        lines.append(
            f"which floor it is, is not certain (median probability {np.median(sure):.2f}): the climbs fit several; "
            "give the first with --start FLOOR"
        )
    return "\n".join(lines)
