# SPDX-License-Identifier: MIT
"""Ellipses that hold 95 % of a normal distribution in the plane.

In: covariances. Out: `Ellipse`s, and which errors lie in them. Owns nothing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Floats

CHI2_95 = 5.991464547107979  # 95 % quantile of chi-square, two degrees of freedom


class Ellipse(NamedTuple):
    """Half axes in metres, and the angle of the longer one from x."""

    major_m: float
    minor_m: float
    angle_rad: float


def in_ellipse95(error_m: Floats, covariance_m2: Floats) -> Bools:
    """Whether errors (..., 2) lie in the 95 % ellipses of covariances (..., 3: xx, xy, yy); in one without area only its centre does, in NaN none."""
    (dx, dy), (xx, xy, yy) = np.moveaxis(error_m, -1, 0), np.moveaxis(covariance_m2, -1, 0)
    determinant = xx * yy - xy**2
    inside = yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy <= CHI2_95 * determinant
    return np.where(determinant > 0.0, inside, (determinant <= 0.0) & (dx == 0.0) & (dy == 0.0))


def ellipse95(xx_m2: float, xy_m2: float, yy_m2: float) -> Ellipse:
    """The ellipse that holds 95 % of a normal distribution with this covariance."""
    mean, half = 0.5 * (xx_m2 + yy_m2), math.hypot(0.5 * (xx_m2 - yy_m2), xy_m2)
    major, minor = (math.sqrt(max(v, 0.0) * CHI2_95) for v in (mean + half, mean - half))
    return Ellipse(major, minor, 0.5 * math.atan2(2.0 * xy_m2, xx_m2 - yy_m2))


def widening_m2(major_m: float, by_m: float) -> float:
    """Variance per axis that makes the longer half axis of a 95 % ellipse longer by so much."""
    return by_m * (2.0 * major_m + by_m) / CHI2_95
