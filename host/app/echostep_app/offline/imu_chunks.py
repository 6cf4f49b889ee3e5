# SPDX-License-Identifier: MIT
"""Samples of any foot IMU as the messages of an MTx, which a recording keeps.

In: arrays of samples. Out: chunks of MTData2 messages, one for each sample, with values as 32-bit floats. Owns nothing but the sample counter.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

from echostep.arrays import Floats
from echostep.ports.chunks import MTX, Chunk
from echostep.ports.imu_samples import SampleCounter
from echostep.xsens import MTDATA2, encode_frame

_SAMPLE = struct.Struct(">HBHHB3fHB3f")  # packets of identifier, length and value [LLCP, MTData2]
_COUNTER, _ACCEL, _GYRO = 0x1020, 0x4020, 0x8020


class ImuChunks:
    """`of` gives the chunks of each portion of samples, arriving at the times of the samples."""

    def __init__(self, rate_hz: float) -> None:
        self._counter = SampleCounter(rate_hz)

    @property
    def left_out(self) -> int:
        """Samples within the same period as the one before."""
        return self._counter.left_out

    def of(self, t_s: Floats, accel: Floats, gyro: Floats) -> Iterator[Chunk]:
        """Chunks of samples as in `SampleCounter.of`."""
        rows = (column.tolist() for column in self._counter.of(t_s, accel, gyro))
        for counter, t_arrival_ns, force, rate in zip(*rows, strict=True):
            payload = _SAMPLE.pack(_COUNTER, 2, counter, _ACCEL, 12, *force, _GYRO, 12, *rate)
            yield Chunk(MTX, t_arrival_ns, encode_frame(MTDATA2, payload))
