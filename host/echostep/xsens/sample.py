"""One measurement of an MT.

In: nothing. Out: `MtSample`. Owns nothing.
"""

from __future__ import annotations

from typing import NamedTuple

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


class MtSample(NamedTuple):
    """One measurement: accel m/s2, gyro rad/s, mag in units of the earth's field, quaternion w x y z (sensor -> MT world), u16 counter."""

    counter: int
    accel: Vector
    gyro: Vector
    mag: Vector
    quaternion: Quaternion
