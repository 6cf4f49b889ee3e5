"""What a record says about the building and the day: storeys that nobody told, stays on floors, metres climbed.

In: `Pressures`, `Floors`. Out: heights of storeys, `Stay`s, the sums. Owns nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.barometer.altitude import AirColumn, Altitude, BarometerSettings, Heights, Pressures, noise_of
from echostep.barometer.floor_filter import CLOSEST_M, FloorFilter, Floors
from echostep.barometer.vertical_model import CLAIMED
from echostep.errors import EchostepError

Way = tuple[int, int, float]  # from one storey to another, and metres up

MOVING_P = 0.5
SHORTEST_STAY_S, SHORTEST_END_S, SETTLES_S, LEVEL_S = 4.0, 1.0, 3.0, 8.0
MOST_ROUNDS, SETTLED_M = 4, 0.02
PASSED_S, PASSED_P = 2.0, 0.8  # so short, or so probably on the way, is a stay on a storey that is known
EDGE_S = 1.5  # of a stay, which may be part of the way
SHIFTS_M = 3.0  # more is no pressure of the building
DRIFTS_S = 120.0  # of stays that show the drift
NOISE_TIMES_S, SMOOTH_PA = (0.5, 1.0), 0.02
SAME_STOREY_M, LOWEST_STOREY_M = 1.2, 2.0
FEWEST_HZ = 10.0


@dataclass(frozen=True, slots=True)
class Stay:
    """On a floor from one time to another."""

    floor: int
    from_s: float
    to_s: float


def thinned(samples: Pressures) -> tuple[Pressures, Ints]:
    """Means of neighbours, ten a second at most, and which mean each sample is part of."""
    rate = 1.0 / float(np.median(np.diff(samples.t_s)))
    many = max(1, int(np.ceil(rate / FEWEST_HZ - 0.1)))
    group = np.arange(len(samples.t_s)) // many
    count = np.bincount(group)

    def mean(column: Floats) -> Floats:
        return np.asarray(np.bincount(group, column) / count)

    temperature = None if samples.temperature_c is None else mean(samples.temperature_c)
    return Pressures(mean(samples.t_s), mean(samples.pressure_pa), temperature), group


def noise_of_record(samples: Pressures, few: Pressures) -> float:
    """Noise (Pa, 1 sd) of the thinned samples `few`, as large as it must be were each one's its own.

    Errors that last, as those of coarse steps and of a filter in the sensor, are seen in means over longer times.
    """
    steps = np.diff(np.unique(samples.pressure_pa))
    steps = steps[steps > SMOOTH_PA]
    found = max(noise_of(few.pressure_pa), 0.5 * float(np.median(steps)) if len(steps) else 0.0)
    rate = 1.0 / float(np.median(np.diff(few.t_s)))
    for seconds in NOISE_TIMES_S:
        many = round(seconds * rate)
        whole = len(few.t_s) // many * many if many > 1 else 0
        if whole >= 5 * many > 0:
            found = max(found, math.sqrt(many) * noise_of(few.pressure_pa[:whole].reshape(-1, many).mean(axis=1)))
    return found


def find_storeys(samples: Pressures, settings: BarometerSettings) -> Floats:
    """Heights (k,) above the lowest storey of all those where the wearer stayed; raises EchostepError when he stayed on one only.

    Each way between two stays leads to a storey that is known by its height, or to a new one; the heights are then those that fit all ways best.
    With these storeys the stays are found anew, and the heights by what pressure says at both ends of each way, until nothing changes.
    """
    ways = _first_ways(_rises(Altitude(settings).smooth(samples)))
    heights = _apart(_fitted(ways, np.zeros(len({name for way in ways for name in way[:2]}) or 1)))
    claimed, used = AirColumn(settings).rows(samples)
    for _ in range(MOST_ROUNDS if len(heights) > 1 else 0):
        before = heights
        visited = stays(FloorFilter(heights, settings).smooth(samples), PASSED_S, PASSED_P)
        heights = _apart(_fitted(_ways(visited, samples.t_s[used], claimed[:, CLAIMED]), before))
        if before[-1] - heights[-1] > SHIFTS_M:  # stays that he had are lost
            heights = before
        if len(heights) == len(before) and np.abs(heights - before).max() < SETTLED_M:
            break
    if len(heights) < 2:
        raise EchostepError("heights: the record shows one storey only: give the heights as --heights 0,3.5,7")
    return np.round(heights, 2)


def _first_ways(rises: list[float]) -> list[Way]:
    """Ways between storeys, numbered as they are met, out of rises between stays."""
    known, ways, here = [0.0], [], 0
    for rise in rises:
        at = known[here] + rise
        there = int(np.argmin(np.abs(np.array(known) - at)))
        if abs(known[there] - at) > SAME_STOREY_M:
            there = len(known)
            known.append(at)
        if there != here:
            ways.append((here, there, rise))
        here = there
    return ways


def _ways(visited: list[Stay], t_s: Floats, claimed_m: Floats) -> list[Way]:
    """Ways between stays, with the rise that pressure claims between the seconds before one and after the other, less the weather's drift."""

    def level(from_s: float, to_s: float) -> tuple[float, float]:
        seconds = (t_s >= from_s) & (t_s <= to_s)
        seconds[np.abs(t_s - 0.5 * (from_s + to_s)).argmin()] = True
        return float(t_s[seconds].mean()), float(np.median(claimed_m[seconds]))

    def inner(stay: Stay) -> tuple[float, float]:
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


def _fitted(ways: list[Way], before_m: Floats) -> Floats:
    """Heights of the storeys of all ways, by least squares, above the lowest; one far from them that no way leads to moves with its neighbours."""
    names = sorted({name for a, b, _ in ways for name in (a, b)})
    if not names:
        return np.zeros(1)
    table, wanted = np.zeros((len(ways) + 1, len(names))), np.zeros(len(ways) + 1)
    for row, (a, b, rise) in enumerate(ways):
        table[row, names.index(a)], table[row, names.index(b)], wanted[row] = -1.0, 1.0, rise
    table[-1, 0] = 1.0
    found = np.linalg.lstsq(table, wanted, rcond=None)[0] + before_m[names[0]]
    order = np.argsort(before_m[names])
    moved = before_m + np.interp(before_m, before_m[names][order], (found - before_m[names])[order])
    passed = np.abs(moved[:, None] - found).min(axis=1) >= LOWEST_STOREY_M
    passed[names] = False
    heights = np.sort(np.concatenate([found, moved[passed]]))
    return np.asarray(heights - heights[0])


def _apart(heights_m: Floats) -> Floats:
    """Those that are a storey above the one below, the lowest at 0."""
    kept = [0.0]
    for height in heights_m.tolist():
        if height - kept[-1] >= CLOSEST_M:
            kept.append(height)
    return np.array(kept)


def _rises(heights: Heights) -> list[float]:
    """Metres between each two neighbouring stays: what moved between level stretches. At the ends of a record a second is a stay."""
    level = heights.moving < MOVING_P
    edges = np.flatnonzero(np.diff(np.concatenate([[0], level.astype(np.int8), [0]])))
    stays = [
        (a, b)
        for a, b in edges.reshape(-1, 2).tolist()
        if heights.t_s[b - 1] - heights.t_s[a] >= (SHORTEST_END_S if a == 0 or b == len(level) else SHORTEST_STAY_S)
    ]
    if len(stays) < 2:  # one way without a stay
        stays = [(0, 1), (len(level) - 1, len(level))]
    found = []
    for (_, leaves), (arrives, ends) in zip(stays, stays[1:], strict=False):
        before = heights.height_m[leaves - 1]
        settled = np.searchsorted(heights.t_s[:ends], heights.t_s[arrives] + SETTLES_S)
        found.append(float(np.median(heights.height_m[arrives : max(settled, arrives + 1)]) - before))
    return [rise for rise in found if abs(rise) > SAME_STOREY_M]


def stays(floors: Floors, shortest_s: float = SHORTEST_STAY_S, moving_p: float = MOVING_P) -> list[Stay]:
    """Times on each floor in their order; a floor that is only passed on the way does not count, the same floor again goes on."""
    still = floors.up + floors.down < moving_p
    found: list[Stay] = []
    at = np.where(still, floors.floor, -1)
    edges = np.flatnonzero(np.diff(at, prepend=-2, append=-2))
    for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        floor, t0, t1 = int(at[a]), float(floors.t_s[a]), float(floors.t_s[b - 1])
        if floor < 0 or (t1 - t0 < shortest_s and a > 0 and b < len(at)):
            continue
        if found and found[-1].floor == floor:
            t0 = found.pop().from_s
        found.append(Stay(floor, t0, t1))
    return found


def climbed_m(heights_m: Floats, visited: list[Stay]) -> tuple[float, float]:
    """Metres up and metres down between the stays, by the storeys' heights."""
    rises = np.diff([heights_m[stay.floor] for stay in visited])
    return float(rises[rises > 0].sum()), float(np.abs(rises[rises < 0]).sum())


def describe(floors: Floors) -> str:
    """Stays, metres climbed and how sure the start is, a line each."""
    visited = stays(floors)
    lines = [f"floor {s.floor} ({floors.heights_m[s.floor]:g} m): {s.from_s:.0f} to {s.to_s:.0f} s" for s in visited]
    up, down = climbed_m(floors.heights_m, visited)
    lines.append(
        f"{len(visited)} stays on {len({s.floor for s in visited})} floors; climbed {up:.1f} m up, {down:.1f} m down; {len(floors.t_s)} samples"
    )
    sure = floors.probability[np.arange(len(floors.t_s)), floors.floor]
    if float(np.median(sure)) < 0.9:
        lines.append(
            f"which floor it is, is not certain (median probability {np.median(sure):.2f}): what he climbed fits several; "
            "give the first with --start FLOOR"
        )
    return "\n".join(lines)
