# SPDX-License-Identifier: MIT
"""The likeliest places of the trunk by a cloud.

In: a cloud's places and weights. Out: `LikelyPlace`, the likeliest first. Owns nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.jit import kernel, part
from echostep.particles.limits import ROOM_M

# Assumed, not measured.
MOST_PLACES = 5  # likely places that are listed
LEAST_PROBABILITY = 0.02  # probability of a place that is listed
SQUARE_M = 1.0  # side of a square, doubled until there are at most MOST_SQUARES
MOST_SQUARES = 1_000_000  # memory: 8 MB


@dataclass(frozen=True, slots=True)
class LikelyPlace:
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


class _Particles(NamedTuple):
    """n places in the map (m), each with its level, heading (rad), and the number of its square."""

    x_m: Floats
    y_m: Floats
    level: Ints
    heading_rad: Floats
    square: Ints


def hypotheses(x_m: Floats, y_m: Floats, level: Ints, heading_rad: Floats, weight: Floats) -> tuple[LikelyPlace, ...]:
    """At most MOST_PLACES likely places of particles (n,) by their weights; each takes those near the heaviest square that is left."""
    particles = _Particles(x_m, y_m, level, heading_rad, _squares(x_m, y_m, level))
    left = weight.copy()
    mass = np.asarray(np.bincount(particles.square, left), np.float64)
    places: list[LikelyPlace] = []
    while len(places) < MOST_PLACES:
        probability, x, y, on, square_m2, east, north = _take(int(mass.argmax()), particles, left, mass)
        if probability < LEAST_PROBABILITY:
            break
        sd_m = math.sqrt(max(0.5 * square_m2, 0.0))
        places.append(LikelyPlace(probability, x, y, int(on), sd_m, math.atan2(north, east)))
    return tuple(sorted(places, key=lambda h: -h.probability))


def _squares(x_m: Floats, y_m: Floats, level: Ints) -> Ints:
    """Number (n,) of the square of each place, below MOST_SQUARES."""
    side_m = SQUARE_M
    while True:
        east, north = np.floor(x_m / side_m), np.floor(y_m / side_m)
        east, north = east - east.min(), north - north.min()
        columns, rows = east.max() + 1.0, north.max() + 1.0
        if columns * rows * (level.max() + 1) <= MOST_SQUARES:
            return np.asarray((level * rows + north) * columns + east, np.int64)
        side_m *= 2.0


@kernel
def _take(
    heaviest: int, particles: _Particles, left: Floats, mass: Floats
) -> tuple[float, float, float, float, float, float, float]:
    """Take particles within ROOM_M of the middle of a square out of `left` (n,) and `mass` (squares,), if they have LEAST_PROBABILITY in all.

    Returns their weight, mean x and y, level, mean square of the distance from there, and the mean of their unit vectors.
    """
    x, y, level, heading, square = particles
    at_x, at_y, on_level = _middle(heaviest, particles, left)
    total, mean_x, mean_y = 0.0, 0.0, 0.0
    for i in range(len(x)):
        if level[i] == on_level and _is_near(x[i] - at_x, y[i] - at_y):
            total += left[i]
            mean_x += left[i] * x[i]
            mean_y += left[i] * y[i]
    if total < LEAST_PROBABILITY:
        return total, at_x, at_y, float(on_level), 0.0, 0.0, 0.0
    mean_x, mean_y = mean_x / total, mean_y / total
    spread, east, north = 0.0, 0.0, 0.0
    for i in range(len(x)):
        if left[i] > 0.0 and level[i] == on_level and _is_near(x[i] - at_x, y[i] - at_y):
            spread += left[i] * ((x[i] - mean_x) ** 2 + (y[i] - mean_y) ** 2)
            east += left[i] * math.cos(heading[i])
            north += left[i] * math.sin(heading[i])
            mass[square[i]] -= left[i]
            left[i] = 0.0
    return total, mean_x, mean_y, float(on_level), spread / total, east / total, north / total


@part
def _middle(heaviest: int, particles: _Particles, left: Floats) -> tuple[float, float, int]:
    """Mean place and level of the particles left in a square."""
    total, x_m, y_m, on_level = 0.0, 0.0, 0.0, -1
    for i in range(len(left)):
        if particles.square[i] == heaviest and left[i] > 0.0:
            total += left[i]
            x_m += left[i] * particles.x_m[i]
            y_m += left[i] * particles.y_m[i]
            on_level = particles.level[i]
    return x_m / total, y_m / total, on_level


@part
def _is_near(dx_m: float, dy_m: float) -> bool:
    return dx_m * dx_m + dy_m * dy_m < ROOM_M * ROOM_M
