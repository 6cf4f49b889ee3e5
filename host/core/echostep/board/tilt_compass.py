# SPDX-License-Identifier: MIT
"""Headings from a magnetometer of three axes, tilt-compensated with the belt's accelerometer.

In: board frames. Out: the heading at each `Magnetic` message. Owns the specific forces of the last two seconds.

The specific force of a walking trunk averages to gravity over a stride. Its mean over the last two seconds with triangular weights (two means over a
second each: the second removes the rest of the steps) gives the vertical; the field's part across it points north [Caruso 2000,
Applications of Magnetic Sensors for Low Cost Compass Systems]. Magnetometer and belt IMU are mounted alike: x forward.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Floats, Ints
from echostep.board.calibration import LSM6DSO_M_S2, ImuSettings
from echostep.board.frames import Frames
from echostep.board.messages import MAGNETIC_INVALID, MOTION_INVALID, Magnetic, Motion
from echostep.elementary import dot

INTERVALS = 20  # of the magnetometer, two seconds: about two strides
LEVEL = np.array([0.0, 0.0, 1.0])  # vertical without an accelerometer
FULL_SCALE = 32_700  # counts: nearer to the end of the range an axis is saturated
_FORCES = [f"belt_acceleration_{axis}" for axis in "xyz"]


def heading_of(field: Floats, vertical: Floats) -> float:
    """Heading of the x axis (rad, counter-clockwise from east) from field (3,) and vertical (3,) in the same axes; NaN if they are parallel."""
    up = vertical / math.hypot(*vertical)
    north = field - dot(field, up) * up
    ahead = np.array([1.0, 0.0, 0.0]) - up[0] * up
    if not north.any() or not ahead.any():
        return math.nan
    return 0.5 * math.pi + math.atan2(dot(np.cross(north, ahead), up), dot(north, ahead))


class TiltCompass:
    """Call `headings` with the frames of each portion, in order."""

    def __init__(self, belt: ImuSettings | None = None) -> None:
        """`belt`: errors of the belt's accelerometer; None if it was not calibrated."""
        errors = belt or ImuSettings()
        self._offset, self._scale = errors.offset / LSM6DSO_M_S2, errors.scale  # counts, 1
        # Of each interval, and of the one under way: the forces' counts, and their number; integers do not depend on the portions
        self._sums: deque[NDArray[np.int64]] = deque(maxlen=INTERVALS)
        self._sum = np.zeros(4, np.int64)

    def headings(self, frames: Frames) -> tuple[Ints, Floats]:
        """Row of the frame (n,) and heading (n,) of each `Magnetic` message; NaN for a field that was not measured or is saturated."""
        motion_row, motions = frames.rows(Motion)
        magnetic_row, fields = frames.rows(Magnetic)
        forces = np.column_stack([*(motions[name] for name in _FORCES), np.ones(len(motions))]).astype(np.int64)
        forces[(forces == MOTION_INVALID).any(axis=1)] = 0
        heading_rad = np.full(len(magnetic_row), np.nan)
        begin = 0
        for k, end in enumerate(np.searchsorted(motion_row, magnetic_row).tolist()):
            self._sums.append(self._sum + forces[begin:end].sum(axis=0))
            self._sum = np.zeros_like(self._sum)
            begin = end
            heading_rad[k] = self._heading(np.array([fields[axis][k] for axis in "xyz"], np.float64))
        self._sum = self._sum + forces[begin:].sum(axis=0)
        return magnetic_row, heading_rad

    def _heading(self, counts: Floats) -> float:
        if (counts == MAGNETIC_INVALID).any() or (np.abs(counts) >= FULL_SCALE).any():
            return math.nan
        rank = np.arange(len(self._sums))
        total = (np.minimum(rank + 1, len(rank) - rank) @ np.array(self._sums)).astype(np.float64)
        force = (total[:3] - total[3] * self._offset) * self._scale
        return heading_of(counts, force if force.any() else LEVEL)
