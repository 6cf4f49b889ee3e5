# SPDX-License-Identifier: MIT
"""One measurement of an MT as plain Python numbers.

In: nothing. Out: `MtSample`. Owns nothing.
"""

from __future__ import annotations

from typing import NamedTuple

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


class MtSample(NamedTuple):
    """Counter (u16), accel m/s2, gyro rad/s, mag in units of the earth's field (sensor frame); quaternion w x y z (sensor -> MT world)."""

    counter: int
    accel: Vector
    gyro: Vector
    mag: Vector
    quaternion: Quaternion
