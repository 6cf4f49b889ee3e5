# SPDX-License-Identifier: MIT
"""Samples of a foot IMU as arrays: numbered by their times, and tracked as the same samples in bytes are."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator

import numpy as np
import pytest

from echostep.board.calibration import RangerSettings
from echostep.errors import EchostepError
from echostep.foot.steps import FootSettings
from echostep.foot.trunk_path import GaitSettings
from echostep.odometry import FrontEnd
from echostep.path import MeasuredSegment
from echostep.ports.chunks import MTX, Chunk, portion_of
from echostep.ports.imu_samples import ImuSamples, SampleCounter
from echostep.timing.timeline import MtxTiming
from echostep.xsens import MTDATA2, encode_frame
from foot.foot_walks import walking

RATE_HZ = 100


def chunks_of(samples: ImuSamples) -> Iterator[Chunk]:
    """Messages of an MTi with the samples as 64-bit floats."""
    for counter, t_arrival_ns, force, rate in zip(*(column.tolist() for column in samples), strict=True):
        payload = struct.pack(">HBHHB3dHB3d", 0x1020, 2, counter, 0x4023, 24, *force, 0x8023, 24, *rate)
        yield Chunk(MTX, t_arrival_ns, encode_frame(MTDATA2, payload))


def front_end() -> FrontEnd:
    return FrontEnd(MtxTiming(rate_hz=RATE_HZ), RangerSettings(), FootSettings(), GaitSettings())


def hurt_walk() -> ImuSamples:
    """A walk with a gap of two seconds, numbers that no sensor measures, and a sample far too early."""
    t, accel, gyro = walking(20, RATE_HZ)
    t = np.where(t > 8.0, t + 2.0, t)
    accel[300, 1], gyro[400, 2], t[500] = math.nan, 1e3, t[100]
    return SampleCounter(RATE_HZ).of(t, accel, gyro)


@pytest.mark.parametrize("size", [1, 37, 100_000])
def test_arrays_are_tracked_as_their_bytes_are_to_the_last_bit(size: int) -> None:
    samples, by_bytes, by_arrays = hurt_walk(), front_end(), front_end()
    expected = by_bytes.process(portion_of(list(chunks_of(samples))))
    found = []
    for k in range(0, len(samples.counter), size):
        part = slice(k, k + size)
        found += by_arrays.process_samples(
            ImuSamples(samples.counter[part], samples.t_arrival_ns[part], samples.accel[part], samples.gyro[part])
        )
    assert repr(found) == repr(expected)
    assert sum(isinstance(piece, MeasuredSegment) for piece in found) > 20
    assert by_arrays.foot_source.counts == by_bytes.foot_source.counts
    assert by_arrays.foot_source.counts.not_finite == by_arrays.foot_source.counts.out_of_range == 1


def test_a_gap_in_the_times_is_a_gap_in_the_counter() -> None:
    numbering = SampleCounter(RATE_HZ)
    zeros = np.zeros((4, 3))
    first = numbering.of(np.array([5.0, 5.0101, 5.0102, 5.05]), zeros, zeros)
    assert first.counter.tolist() == [0, 1, 5]
    assert first.t_arrival_ns.tolist() == [0, 10_100_000, 50_000_000]
    assert numbering.of(np.array([5.05, 660.37, 4.0, 660.38]), zeros, zeros).counter.tolist() == [1, 2]
    assert numbering.left_out == 3


def test_other_shapes_and_times_that_are_no_numbers_are_refused() -> None:
    numbering, zeros = SampleCounter(RATE_HZ), np.zeros((2, 3))
    with pytest.raises(EchostepError, match=r"must be \(n,\) and \(n, 3\)"):
        numbering.of(np.zeros(2), zeros[:, :2], zeros)
    with pytest.raises(EchostepError, match="t_s is not a number"):
        numbering.of(np.array([0.0, math.nan]), zeros, zeros)
