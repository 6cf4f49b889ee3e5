# SPDX-License-Identifier: MIT
"""The foot's samples, from the device worn on it: an MTx or a foot board.

In: portions of chunks. Out: `FootSamples`. Owns the readers of both, and which of the two is worn: the one whose first chunk came first.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.board.calibration import ImuSettings
from echostep.board.foot_board import FootBoardReader
from echostep.foot.ins import Noise
from echostep.ports.chunks import FOOT, MTX, Portion
from echostep.ports.imu_samples import ImuSamples
from echostep.xsens import MtBatch, MtxCounts, MtxReader

# Differences from an MTx, which was calibrated by its maker: cross-axis sensitivity 2 %, sensitivity within 1.5 %, zero rate within 5 deg/s (three
# sd), zero force within 65 mg (two sd) [ICM-20649 data sheet DS-000192, tables 1 and 2, as remembered: compare them with a copy].
ICM20649_NOISE = Noise(accel_share=0.01, gyro_share=0.015, accel_bias=0.3, gyro_bias=0.03, offset=0.65)


class FootSamples(NamedTuple):
    """Samples (n,): `value` of the device's clock; `accel` m/s2, `gyro` rad/s, `mag` (n, 3); `row` of the chunk that completed each."""

    value: Ints
    accel: Floats
    gyro: Floats
    mag: Floats
    row: Ints


class FootSource:
    """Call `read` with every portion."""

    def __init__(self, errors: ImuSettings) -> None:
        """`errors`: of a foot board's part."""
        self.mtx = MtxReader()
        self.board = FootBoardReader(errors)
        self.port: str | None = None  # MTX or FOOT, from the first chunk of either on

    @property
    def counts(self) -> MtxCounts:
        """Counts of the device's samples; a foot board's counts have the names of an MTx's."""
        if self.port != FOOT:
            return self.mtx.counts
        frames = self.board.reader.counts
        return MtxCounts(good=self.board.samples, bad_checksum=frames.rejected, lost=self.board.lost)

    def read(self, portion: Portion) -> FootSamples:
        """The samples that a portion completes; raises StaleFirmwareError when a foot board has another schema."""
        from_mtx, from_board = portion.of(MTX), portion.of(FOOT)
        if self.port is None and len(from_mtx.row) + len(from_board.row):
            first = [part.row[0] if len(part.row) else len(portion.port) for part in (from_mtx, from_board)]
            self.port = MTX if first[0] < first[1] else FOOT
        if self.port == FOOT:
            samples = self.board.feed(from_board.received)
            mag = np.full_like(samples.accel, np.nan)
            return FootSamples(samples.ticks, samples.accel, samples.gyro, mag, from_board.rows_of(samples.end))
        batch: MtBatch = self.mtx.feed_batch(from_mtx.received)
        return FootSamples(batch.counter, batch.accel, batch.gyro, batch.mag, from_mtx.rows_of(batch.end))

    def take(self, samples: ImuSamples) -> FootSamples:
        """Samples of another foot IMU that pass the gates of an MTx's; none where a foot board is worn."""
        self.port = self.port or MTX
        used = slice(0 if self.port == FOOT else None)
        batch = self.mtx.take(samples.counter[used], samples.accel[used], samples.gyro[used])
        return FootSamples(batch.counter, batch.accel, batch.gyro, batch.mag, batch.end)
