# SPDX-License-Identifier: MIT
"""Angles.

In: radians. Out: radians. Owns nothing.
"""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np

from echostep.arrays import Floats

Angle = TypeVar("Angle", float, Floats)


def wrap(angle_rad: Angle) -> Angle:
    """The same angle, or angles, in [-pi, pi)."""
    return (angle_rad + math.pi) % (2.0 * math.pi) - math.pi


def mean_angle(angle_rad: Floats, weight: Floats) -> float:
    """Direction of the weighted sum (rad) of unit vectors with these angles (n,)."""
    return math.atan2(float(weight @ np.sin(angle_rad)), float(weight @ np.cos(angle_rad)))
