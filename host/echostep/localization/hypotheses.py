# SPDX-License-Identifier: MIT
"""The few places at which a cloud says that the wearer may be.

In: a cloud's places and weights. Out: `Hypothesis`, the likeliest first. Owns nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.angles import mean_angle
from echostep.arrays import Floats, Ints

# All by reason.
REACH_M = 2.5  # particles so near to the heaviest square metre are one hypothesis: a room
MOST = 5  # hypotheses that are listed
LEAST = 0.02  # probability of one that is listed


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """A place in the map (m) with its level, standard deviation (m, per axis), heading (rad) and probability."""

    probability: float
    x_m: float
    y_m: float
    level: int
    sd_m: float
    heading_rad: float

    def __str__(self) -> str:
        """Probability, x, y (m) and level, for a table: 0.58:12.3,4.5,0."""
        return f"{self.probability:.2f}:{self.x_m:.1f},{self.y_m:.1f},{self.level}"


def hypotheses(x_m: Floats, y_m: Floats, level: Ints, heading_rad: Floats, weight: Floats) -> tuple[Hypothesis, ...]:
    """At most MOST, from places (n,) in the map with weights that sum to 1. Each takes the particles near the heaviest square metre that is left."""
    square = (np.floor(x_m) - np.floor(x_m.min())) + 1e4 * (np.floor(y_m) - np.floor(y_m.min())) + 1e9 * level
    _, member = np.unique(square, return_inverse=True)
    left = weight.copy()
    found: list[Hypothesis] = []
    while len(found) < MOST:
        heaviest = int(np.bincount(member, left).argmax())
        inside = (member == heaviest) & (left > 0.0)
        if not inside.any():
            break
        w = left[inside]
        x, y, k = float(np.average(x_m[inside], weights=w)), float(np.average(y_m[inside], weights=w)), level[inside][0]
        near = (np.hypot(x_m - x, y_m - y) < REACH_M) & (level == k) & (left > 0.0)
        part = left[near]
        total = float(part.sum())
        if total < LEAST:
            break
        found.append(_hypothesis(total, x_m[near], y_m[near], int(k), heading_rad[near], part / total))
        left[near] = 0.0
    return tuple(sorted(found, key=lambda h: -h.probability))


def _hypothesis(probability: float, x: Floats, y: Floats, level: int, heading: Floats, weight: Floats) -> Hypothesis:
    mean_x, mean_y = float(weight @ x), float(weight @ y)
    variance = float(weight @ ((x - mean_x) ** 2 + (y - mean_y) ** 2))
    return Hypothesis(probability, mean_x, mean_y, level, math.sqrt(0.5 * variance), mean_angle(heading, weight))
