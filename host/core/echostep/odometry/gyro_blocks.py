# SPDX-License-Identifier: MIT
"""Gyro blocks: the board's gyro samples in blocks of equal size, as the leg odometry takes them.

In: board frames with their times. Out: `GyroBlock`s, each with the index of the message that fills it. Owns the samples of the unfinished block.
"""

from __future__ import annotations

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.board.calibration import GyroSettings, ImuSettings, compass_headings, gyro_rates
from echostep.board.frames import Frames
from echostep.board.messages import Compass, Gyros
from echostep.board.tilt_compass import TiltCompass
from echostep.legs.trunk_path import GyroBlock
from echostep.timing.timeline import Times

BLOCK = 20  # samples: a tenth of a second at 200 Hz
COLUMNS = 6  # t_s, thigh, calf, belt, compass, message index
T_S, MESSAGE_INDEX = 0, 5
EARLIER = -1  # message index of a sample of an earlier portion


class GyroBlocks:
    """Cuts gyro samples into blocks of BLOCK, counted from the first sample; each sample carries the compass reading since the sample before."""

    def __init__(self, gyro: GyroSettings, belt: ImuSettings) -> None:
        self._gyro = gyro
        self._rows = np.empty((0, COLUMNS))  # of the unfinished block
        self._compass = np.nan  # heading read since the last sample, rad
        self._tilt_compass = TiltCompass(belt)

    def cut(self, frames: Frames, times: Times) -> list[tuple[int, GyroBlock]]:
        """The blocks that are full, each with the index of the message that fills it."""
        rows = np.concatenate([self._rows, self._timed_rows(frames, times)])
        count = len(rows) // BLOCK
        self._rows = rows[count * BLOCK :].copy()
        self._rows[:, MESSAGE_INDEX] = EARLIER
        *columns, message_index = rows[: count * BLOCK].reshape(count, BLOCK, COLUMNS).transpose(2, 0, 1)
        blocks = (GyroBlock(*block) for block in zip(*columns, strict=True))
        return list(zip(message_index[:, -1].astype(np.int64).tolist(), blocks, strict=True))

    def _timed_rows(self, frames: Frames, times: Times) -> Floats:
        """Rows (n, COLUMNS) of the gyro samples that have a time."""
        sample_row, samples = frames.rows(Gyros)
        compass_row, headings = self._headings(frames)
        compass = np.full(len(sample_row) + 1, np.nan)  # by the sample that follows the reading
        compass[0] = self._compass
        compass[np.searchsorted(sample_row, compass_row)] = headings
        self._compass = compass[-1]
        rows = np.column_stack(
            [
                times.board_s[sample_row],
                gyro_rates(samples, self._gyro),
                compass[:-1],
                times.board_message_index[sample_row],
            ]
        )
        return rows[~np.isnan(rows[:, T_S])]

    def _headings(self, frames: Frames) -> tuple[Ints, Floats]:
        """Row of the frame (n,) and heading (n,) of each reading of a compass or a magnetometer, in order."""
        bearing_row, bearings = frames.rows(Compass)
        field_row, headings = self._tilt_compass.headings(frames)
        row = np.concatenate([bearing_row, field_row])
        order = np.argsort(row, kind="stable")
        return row[order], np.concatenate([compass_headings(bearings), headings])[order]
