# SPDX-License-Identifier: MIT
"""Samples of any foot IMU as an MTx would send them: the one way in for files, recordings and arrays.

In: arrays of samples. Out: chunks of MTData2 messages, one for each sample. Owns the time of the first sample.
A chunk arrives at the time of its sample, counted from the first; a gap in the times is a gap in the counter.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.ports.chunks import MTX, Chunk
from echostep.xsens import MTDATA2, encode_frame

_SAMPLE = struct.Struct(">HBHHB3fHB3f")  # packets of identifier, length and value [LLCP, MTData2]
_COUNTER, _ACCEL, _GYRO = 0x1020, 0x4020, 0x8020


class ImuChunks:
    """`of` gives the chunks of each portion of samples. `left_out`: samples within the same period as the one before."""

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._first_s, self._last = float("nan"), -1
        self.left_out = 0

    def of(self, t_s: Floats, accel: Floats, gyro: Floats) -> Iterator[Chunk]:
        """Chunks of samples: t_s (n,) s, rising; accel (n, 3) m/s2, gyro (n, 3) rad/s, body frame. Raises EchostepError for other shapes."""
        t_s, accel, gyro = (np.asarray(each, np.float64) for each in (t_s, accel, gyro))
        if t_s.ndim != 1 or accel.shape != (len(t_s), 3) or gyro.shape != (len(t_s), 3):
            raise EchostepError(f"t_s {t_s.shape}, accel {accel.shape}, gyro {gyro.shape}; must be (n,) and (n, 3)")
        if not np.isfinite(t_s).all():
            raise EchostepError("samples: t_s is not a number in some of them: leave these out")
        if np.isnan(self._first_s) and len(t_s):
            self._first_s = float(t_s[0])
        for at_s, force, rate in zip((t_s - self._first_s).tolist(), accel.tolist(), gyro.tolist(), strict=True):
            count = round(at_s * self._rate_hz)
            if count <= self._last:
                self.left_out += 1
                continue
            self._last = count
            payload = _SAMPLE.pack(_COUNTER, 2, count & 0xFFFF, _ACCEL, 12, *force, _GYRO, 12, *rate)
            yield Chunk(MTX, round(1e9 * at_s), encode_frame(MTDATA2, payload))
