# SPDX-License-Identifier: MIT
"""Measurements of an MTx in any of its output formats.

In: a sample, an output format. Out: the payload of an MTData message. Owns nothing.
"""

from __future__ import annotations

import math
import struct

import numpy as np

from echostep.arrays import Floats
from echostep.xsens import MtSample, OutputFormat
from echostep.xsens.mtdata import (
    ACCEL,
    AUXILIARY,
    EULER,
    FIXED_12_20,
    GYRO,
    MAG,
    ORIENTATION,
    ORIENTATION_MASK,
    QUATERNION,
    RAW,
    RAW_BYTES,
    SAMPLE_COUNTER,
    STATUS,
    TEMPERATURE,
)  # fmt: skip

CELSIUS = 25.0


def pack(sample: MtSample, output: OutputFormat) -> bytes:
    """MTData payload of a measurement in any output format; what the sample does not hold is constant."""
    counter = struct.pack(">H", sample.counter & 0xFFFF) if output.settings & SAMPLE_COUNTER else b""
    if output.mode & RAW:
        return bytes(RAW_BYTES) + counter
    numbers = [CELSIUS] if output.mode & TEMPERATURE else []
    for columns, vector in ((ACCEL, sample.accel), (GYRO, sample.gyro), (MAG, sample.mag)):
        if columns in output.calibrated:
            numbers += vector
    if output.mode & ORIENTATION:
        numbers += _orientation(sample, output.settings & ORIENTATION_MASK)
    if output.settings & FIXED_12_20:
        body = struct.pack(f">{len(numbers)}i", *(round(v * 2**20) for v in numbers))
    else:
        body = struct.pack(f">{len(numbers)}f", *numbers)
    rest = output.length - len(body) - len(counter)
    assert rest == 0 or output.mode & (AUXILIARY | STATUS)
    return body + bytes(rest) + counter


def _orientation(sample: MtSample, form: int) -> list[float]:
    """Quaternion, roll pitch yaw in degrees, or the matrix column by column."""
    if form == QUATERNION:
        return list(sample.quaternion)
    r = _rotation(sample.quaternion)
    if form == EULER:
        angles = (math.atan2(r[2, 1], r[2, 2]), -math.asin(max(-1.0, min(1.0, r[2, 0]))), math.atan2(r[1, 0], r[0, 0]))
        return [math.degrees(angle) for angle in angles]
    return list(map(float, r.T.ravel()))


def _rotation(q: tuple[float, float, float, float]) -> Floats:
    w, x, y, z = q
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross
