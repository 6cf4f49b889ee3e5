# SPDX-License-Identifier: MIT
"""The foot board: frames of its port -> samples of the foot's motion sensor.

In: bytes of the port. Out: samples in SI units with the ticks of the board's clock. Owns the reader, the board's reports about itself, the counts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.board.calibration import ImuSettings, foot_axes
from echostep.board.frames import BoardReader
from echostep.board.messages import BoardHealth, Configuration, Foot, FootHealth, Identity, Parts, Status
from echostep.board.reports import BoardReports

_REPORTS = (Identity, Configuration, Status, BoardHealth, Parts, FootHealth)


class FootFrames(NamedTuple):
    """Samples (n,): `ticks` of the foot board's clock; `accel` m/s2, `gyro` rad/s (n, 3) in the part's axes; `end` of each in the bytes just fed."""

    ticks: Ints
    accel: Floats
    gyro: Floats
    end: Ints


class FootBoardReader:
    """Samples of a byte stream; malformed frames are counted and raise no error."""

    def __init__(self, errors: ImuSettings | None = None) -> None:
        """`errors`: errors of the part; None if it was not calibrated."""
        self._errors = errors or ImuSettings()
        self.reader = BoardReader()
        self.reports = BoardReports()
        self.samples = 0

    @property
    def lost(self) -> int:
        """Frames that never came, and samples that the board could not read in time."""
        health = self.reports.foot
        return self.reader.counts.lost + (0 if health is None else health.missed)

    def feed(self, received: bytes) -> FootFrames:
        """Samples completed by these bytes; raises StaleFirmwareError when the board has another schema."""
        frames = self.reader.frames(received)
        for report in frames.each(_REPORTS):
            self.reports.add(report)
        frame_row, samples = frames.rows(Foot)
        self.samples += len(samples)
        rates, forces = foot_axes(samples)
        return FootFrames(
            samples["ticks"].astype(np.int64),
            self._errors.true_forces(forces),
            self._errors.true_rates(rates),
            frames.end[frame_row],
        )
