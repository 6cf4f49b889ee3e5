# SPDX-License-Identifier: MIT
"""The foot board: frames of its port -> samples of the foot's motion sensor.

In: bytes of the port. Out: samples in SI units with the ticks of the board's clock. Owns the reader, the board's reports about itself, the counts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Floats, Ints
from echostep.board.calibration import ImuSettings, foot_axes
from echostep.board.frames import BoardReader
from echostep.board.messages import BoardHealth, Configuration, Foot, FootHealth, Identity, Parts, Status
from echostep.board.reports import BoardReports

MOST_M_S2 = 294.3  # 30 g, the part's range
MOST_STEP = np.repeat([28.0, 125.0], 3)  # rad/s, m/s2 from sample to sample behind its low passes; assumed
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
        self.samples = self.spikes = 0  # believed, and not
        self._newest = self._believed = np.empty((0, 6))  # at most one row: sample, believed sample

    @property
    def lost(self) -> int:
        """Frames that never came, samples that the board could not read in time, and such as no foot can have."""
        health = self.reports.foot
        return self.reader.counts.lost + self.spikes + (0 if health is None else health.missed)

    def feed(self, received: bytes) -> FootFrames:
        """Samples completed by these bytes; raises StaleFirmwareError when the board has another schema."""
        frames = self.reader.frames(received)
        for report in frames.each(_REPORTS):
            self.reports.add(report)
        frame_row, samples = frames.rows(Foot)
        values = np.hstack(foot_axes(samples))
        good = self._good(values)
        self.samples += int(np.sum(good))
        return FootFrames(
            samples["ticks"][good].astype(np.int64),
            self._errors.true_forces(values[good, 3:]),
            self._errors.true_rates(values[good, :3]),
            frames.end[frame_row[good]],
        )

    def _good(self, values: Floats) -> Bools:
        """Whether each sample (n, 6), rates and forces, is within the range, and near the one before or the last believed one: wrong bits are not."""
        good: Bools = np.abs(values[:, 3:]).max(axis=1, initial=0.0) <= MOST_M_S2
        steps = np.abs(np.diff(values, axis=0, prepend=self._newest if len(self._newest) else values[:1]))
        for k in ((steps > MOST_STEP).any(axis=1) & good).nonzero()[0]:
            believed = np.concatenate([self._believed, values[:k][good[:k]]])[-1:]
            good[k] = (np.abs(values[k] - believed) <= MOST_STEP).all()
        self._newest = np.concatenate([self._newest, values])[-1:]
        self._believed = np.concatenate([self._believed, values[good]])[-1:]
        self.spikes += int(np.sum(~good))
        return good
