# SPDX-License-Identifier: MIT
"""Samples of any foot IMU in place of an MTx's, as arrays.

In: arrays of samples. Out: `ImuSamples`: each sample with a counter and an arrival time, both from its own time. Owns the time of the first sample.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.errors import EchostepError
from echostep.ports.chunks import LATEST_NS


class ImuSamples(NamedTuple):
    """Samples (n,): `counter` of 16 bits, `t_arrival_ns`, `accel` (n, 3) m/s2, `gyro` (n, 3) rad/s."""

    counter: Ints
    t_arrival_ns: Ints
    accel: Floats
    gyro: Floats


class SampleCounter:
    """Numbers samples by their times, from the first sample on: a gap in the times is a gap in the counter.

    `left_out`: samples within the same period as the one before, which are dropped.
    """

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._first_s, self._last = math.nan, -1.0
        self.left_out = 0

    def of(self, t_s: Floats, accel: Floats, gyro: Floats) -> ImuSamples:
        """From t_s (n,) s, rising; accel (n, 3) m/s2, gyro (n, 3) rad/s, body frame. Raises EchostepError for other shapes."""
        t_s, accel, gyro = (np.asarray(each, np.float64) for each in (t_s, accel, gyro))
        if t_s.ndim != 1 or accel.shape != (len(t_s), 3) or gyro.shape != (len(t_s), 3):
            raise EchostepError(f"t_s {t_s.shape}, accel {accel.shape}, gyro {gyro.shape}; must be (n,) and (n, 3)")
        if not np.isfinite(t_s).all():
            raise EchostepError("samples: t_s is not a number in some of them: leave these out")
        if math.isnan(self._first_s) and len(t_s):
            self._first_s = float(t_s[0])
        at_s = t_s - self._first_s
        count = np.rint(at_s * self._rate_hz)
        newest = np.maximum.accumulate(np.append(self._last, count))
        kept = count > newest[:-1]
        self._last = float(newest[-1])
        self.left_out += int(np.sum(~kept))
        arrival_ns = np.clip(np.rint(1e9 * at_s[kept]), 0.0, LATEST_NS).astype(np.int64)
        return ImuSamples(np.mod(count[kept], 1 << 16).astype(np.int64), arrival_ns, accel[kept], gyro[kept])
