"""What a record says about the building and the day: storeys that nobody told, stays on floors, metres climbed.

In: `Pressures`, `Floors`. Out: heights of storeys, `Stay`s, the sums. Owns nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from echostep.altitude import Altitude, BarometerSettings, Heights, Pressures
from echostep.errors import EchostepError
from echostep.floors import Floors

Floats = NDArray[np.float64]

MOVING_P = 0.5
SHORTEST_STAY_S, LEVEL_S = 4.0, 3.0
SAME_STOREY_M, LOWEST_STOREY_M = 1.2, 2.0
FEWEST_HZ = 10.0


@dataclass(frozen=True, slots=True)
class Stay:
    """On a floor from one time to another."""

    floor: int
    from_s: float
    to_s: float


def thinned(samples: Pressures) -> tuple[Pressures, NDArray[np.int64]]:
    """Means of neighbours, ten a second at most, and which mean each sample is part of."""
    rate = 1.0 / float(np.median(np.diff(samples.t_s)))
    many = max(1, int(np.ceil(rate / FEWEST_HZ - 0.1)))
    group = np.arange(len(samples.t_s)) // many
    count = np.bincount(group)

    def mean(column: Floats) -> Floats:
        return np.asarray(np.bincount(group, column) / count)

    temperature = None if samples.temperature_c is None else mean(samples.temperature_c)
    return Pressures(mean(samples.t_s), mean(samples.pressure_pa), temperature), group


def find_storeys(samples: Pressures, settings: BarometerSettings) -> Floats:
    """Heights (k,) above the lowest storey of all those where the wearer stayed; raises EchostepError when he stayed on one only.

    Each way between two stays leads to a storey that is known by its height, or to a new one; the heights are then those that fit all ways best.
    """
    heights = Altitude(settings).look_back(samples)
    rises = _rises(heights)
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
    if len(known) < 2:
        raise EchostepError("heights: the record shows one storey only: give the heights as --heights 0,3.5,7")
    table, wanted = np.zeros((len(ways) + 1, len(known))), np.zeros(len(ways) + 1)
    for row, (a, b, rise) in enumerate(ways):
        table[row, a], table[row, b], wanted[row] = -1.0, 1.0, rise
    table[-1, 0] = 1.0
    found = np.sort(np.linalg.lstsq(table, wanted, rcond=None)[0])
    apart = np.concatenate([[True], np.diff(found) >= LOWEST_STOREY_M])
    return np.round(found[apart] - found[0], 2)


def _rises(heights: Heights) -> list[float]:
    """Metres between each two neighbouring stays: what moved between level stretches."""
    level = heights.moving < MOVING_P
    edges = np.flatnonzero(np.diff(np.concatenate([[0], level.astype(np.int8), [0]])))
    stays = [(a, b) for a, b in edges.reshape(-1, 2).tolist() if heights.t_s[b - 1] - heights.t_s[a] >= SHORTEST_STAY_S]
    found = []
    for (_, leaves), (arrives, ends) in zip(stays, stays[1:], strict=False):
        before = heights.height_m[leaves - 1]
        settled = np.searchsorted(heights.t_s[:ends], heights.t_s[arrives] + LEVEL_S)
        found.append(float(np.median(heights.height_m[arrives : max(settled, arrives + 1)]) - before))
    return [rise for rise in found if abs(rise) > SAME_STOREY_M]


def stays(floors: Floors) -> list[Stay]:
    """Times on each floor in their order; a floor that is only passed on the way does not count, the same floor again goes on."""
    still = floors.up + floors.down < MOVING_P
    found: list[Stay] = []
    at = np.where(still, floors.floor, -1)
    edges = np.flatnonzero(np.diff(at, prepend=-2, append=-2))
    for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        floor, t0, t1 = int(at[a]), float(floors.t_s[a]), float(floors.t_s[b - 1])
        if floor < 0 or (t1 - t0 < SHORTEST_STAY_S and a > 0 and b < len(at)):
            continue
        if found and found[-1].floor == floor:
            t0 = found.pop().from_s
        found.append(Stay(floor, t0, t1))
    return found


def climbed_m(heights_m: Floats, visited: list[Stay]) -> tuple[float, float]:
    """Metres up and metres down between the stays, by the storeys' heights."""
    rises = np.diff([heights_m[stay.floor] for stay in visited])
    return float(rises[rises > 0].sum()), float(-rises[rises < 0].sum())


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
