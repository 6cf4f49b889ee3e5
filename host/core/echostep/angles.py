# SPDX-License-Identifier: MIT
"""Angles.

In: radians. Out: radians. Owns nothing.
"""

from __future__ import annotations

import math
from typing import TypeVar

from echostep.arrays import Floats

Angle = TypeVar("Angle", float, Floats)


def wrap(angle_rad: Angle) -> Angle:
    """The same angle, or angles, in [-pi, pi)."""
    return (angle_rad + math.pi) % (2.0 * math.pi) - math.pi
