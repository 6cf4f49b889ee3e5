# SPDX-License-Identifier: MIT
"""A simulated day in one dimension: corridors, stairs with landings, lifts with doors.

In: the building's storeys, stairs, lift or both, a seeded generator. Out: times, true heights, gait, when in a stairwell or lift shaft. Owns the
speeds of stairs and lifts: 0.2 to 0.35 m/s upward of a stair's vertical [Fruin 1971], lifts of 1 to 2 m/s with 0.8 to 1.2 m/s2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from echostep.arrays import Bools, Floats

RATE_HZ = 50.0
FLIGHTS = 2
LANDING_S = (1.0, 2.5)
CORRIDOR_S = (20.0, 90.0)
DOORS_S = (3.0, 7.0)
PASSED_FLOOR_S = (2.0, 4.0)


@dataclass(frozen=True, slots=True)
class VerticalMove:
    """`t_s`, `height_m` (n,) of the trunk above the lowest floor that is walked on, `walking`, `in_shaft` (n,): on stairs or in a lift."""

    t_s: Floats
    height_m: Floats
    walking: Bools
    in_shaft: Bools


def climb(
    heights_m: Sequence[float],
    seconds: float,
    rng: np.random.Generator,
    ways: Literal["stairs", "lift", "both"] = "both",
) -> VerticalMove:
    """A walk of `seconds` about the building from a random floor, at 50 Hz; each stay ends with a way to another floor."""
    floor = int(rng.integers(len(heights_m)))
    pieces: list[tuple[Floats, bool, bool]] = []
    left = seconds
    while left > 0.0:
        stay = rng.uniform(*CORRIDOR_S)
        walks = rng.random() < 0.7
        pieces.append((np.full(round(stay * RATE_HZ), heights_m[floor]), walks, False))
        by_lift = ways == "lift" or (ways == "both" and rng.random() < 0.5)
        others = [k for k in range(len(heights_m)) if k != floor and (by_lift or abs(k - floor) <= 2)]
        to = int(rng.choice(others))
        pieces += _ride(heights_m[floor], heights_m[to], rng) if by_lift else _stairs(heights_m, floor, to, rng)
        floor = to
        left = seconds - sum(len(h) for h, _, _ in pieces) / RATE_HZ
    n = round(seconds * RATE_HZ)
    height = np.concatenate([h for h, _, _ in pieces])[:n]
    walking = np.concatenate([np.full(len(h), w) for h, w, _ in pieces])[:n]
    shaft = np.concatenate([np.full(len(h), s) for h, _, s in pieces])[:n]
    return VerticalMove(np.arange(n) / RATE_HZ, height, walking, shaft)


def _stairs(
    heights_m: Sequence[float], floor: int, to: int, rng: np.random.Generator
) -> list[tuple[Floats, bool, bool]]:
    """Flights and landings, and a few steps on each floor that is passed."""
    way, parts = (1 if to > floor else -1), []
    speed = rng.uniform(0.2, 0.35) * (1.0 if way > 0 else 1.15)
    for k in range(floor, to, way):
        low, high = heights_m[k], heights_m[k + way]
        for flight in range(FLIGHTS):
            a, b = (low + (high - low) * (flight + end) / FLIGHTS for end in (0, 1))
            own = speed * rng.uniform(0.9, 1.1)
            parts.append((np.linspace(a, b, max(2, round(abs(b - a) / own * RATE_HZ))), True, True))
            level = LANDING_S if flight < FLIGHTS - 1 else PASSED_FLOOR_S
            parts.append((np.full(round(rng.uniform(*level) * RATE_HZ), b), True, True))
    return parts


def _ride(a: float, b: float, rng: np.random.Generator) -> list[tuple[Floats, bool, bool]]:
    """In, doors, the ride with trapezoidal speed, doors, out."""
    top, gain = rng.uniform(1.0, 2.0), rng.uniform(0.8, 1.2)
    way = abs(b - a)
    top = min(top, math.sqrt(way * gain))
    ramp = top / gain
    t = np.arange(round((way / top + ramp) * RATE_HZ)) / RATE_HZ
    end = way / top + ramp
    s = np.where(
        t < ramp, 0.5 * gain * t**2,
        np.where(t < end - ramp, top * (t - 0.5 * ramp), way - 0.5 * gain * np.maximum(end - t, 0.0) ** 2),
    )  # fmt: skip
    before, after = (round(rng.uniform(*DOORS_S) * RATE_HZ) for _ in range(2))
    return [
        (np.full(before, a), False, True),
        (a + math.copysign(1.0, b - a) * s, False, True),
        (np.full(after, b), False, True),
    ]
