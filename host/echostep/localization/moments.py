# SPDX-License-Identifier: MIT
"""Moments of a cloud, and its weight about a place, in one pass each: a search has hundreds of thousands of particles.

In: arrays of n particles with weights that sum to 1. Out: numbers. Owns nothing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from echostep.arrays import Floats
from echostep.jit import lean_kernel
from echostep.localization.level_changes import SAME_LEVEL_M


class Moments(NamedTuple):
    """Weighted mean (m), covariance (m2), mean unit vector of the headings, and weight within two distances of the mean."""

    x_m: float
    y_m: float
    xx_m2: float
    xy_m2: float
    yy_m2: float
    east: float
    north: float
    near: float
    about: float


@lean_kernel
def moments(x_m: Floats, y_m: Floats, heading_rad: Floats, weight: Floats, near_m: float, about_m: float) -> Moments:
    """Of particles (n,) in the map."""
    x, y, east, north = 0.0, 0.0, 0.0, 0.0
    for i in range(len(weight)):
        w = weight[i]
        x += w * x_m[i]
        y += w * y_m[i]
        east += w * math.cos(heading_rad[i])
        north += w * math.sin(heading_rad[i])
    xx, xy, yy, near, about = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(len(weight)):
        w, dx, dy = weight[i], x_m[i] - x, y_m[i] - y
        square = dx * dx + dy * dy
        xx += w * dx * dx
        xy += w * dx * dy
        yy += w * dy * dy
        near += w if square < near_m * near_m else 0.0
        about += w if square < about_m * about_m else 0.0
    return Moments(x, y, xx, xy, yy, east, north, near, about)


@lean_kernel
def weight_about(
    x_m: Floats, y_m: Floats, z_m: Floats, weight: Floats, place_m: tuple[float, float, float], limit_m: tuple[float, float]
) -> tuple[float, float]:  # fmt: skip
    """Weight of the particles (n,) within each of two distances of a place in the map, and within SAME_LEVEL_M of its height."""
    near, about = 0.0, 0.0
    for i in range(len(weight)):
        if abs(z_m[i] - place_m[2]) < SAME_LEVEL_M:
            distance = math.hypot(x_m[i] - place_m[0], y_m[i] - place_m[1])
            near += weight[i] if distance < limit_m[0] else 0.0
            about += weight[i] if distance < limit_m[1] else 0.0
    return near, about
