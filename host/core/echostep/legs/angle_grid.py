# SPDX-License-Identifier: MIT
"""Angles of thigh, shank and trunk on a regular grid, integrated from gyro samples.

In: time and rates of thigh, shank and belt, at 50 to 500 Hz. Out: angles since the first sample, every 1 / GRID_HZ. Owns the grid and the counts of
samples.
"""

from __future__ import annotations

import enum
import math

import numpy as np

from echostep.arrays import Floats
from echostep.legs.stride import LegCounts
from echostep.legs.swing_detection import GRID_HZ

LONGEST_GAP_S = 0.25  # integrated over: a quarter of a stride
FASTEST_RAD_S = 35.0  # a larger rate is impossible: nearly twice a sprinter's shank


class GridSample(enum.Enum):
    """How the grid uses a sample."""

    TAKEN = enum.auto()
    SKIPPED = enum.auto()
    AFTER_GAP = enum.auto()  # not integrated: the grid must be restarted at it


class AngleGrid:
    """`thigh`, `shank`, `yaw`: angles (rad) at `time(k)`; the signs are the sensors' own. A missing rate of the belt (NaN) counts as no turn."""

    def __init__(self) -> None:
        self.thigh: list[float] = []
        self.shank: list[float] = []
        self.yaw: list[float] = []
        self.counts = LegCounts()
        self.last_s = -math.inf
        self._rates = (0.0, 0.0, 0.0)  # of the newest sample
        self._turned = (0.0, 0.0, 0.0)  # up to that sample
        self._origin_s = 0.0

    def __len__(self) -> int:
        return len(self.thigh)

    @property
    def columns(self) -> tuple[list[float], list[float], list[float]]:
        """Angles of thigh, shank and trunk."""
        return self.thigh, self.shank, self.yaw

    def time(self, k: int) -> float:
        """Time (s) of a grid index."""
        return self._origin_s + k / GRID_HZ

    def add(self, t_s: float, thigh: float, shank: float, belt: float) -> GridSample:
        """Integrate to one sample and interpolate the angles on the grid."""
        self.counts.samples += 1
        if not abs(thigh) < FASTEST_RAD_S or not abs(shank) < FASTEST_RAD_S or not math.isfinite(t_s):
            self.counts.impossible += 1
            return GridSample.SKIPPED
        if not self.thigh:
            self.restart(t_s, thigh, shank, belt)
            return GridSample.TAKEN
        if t_s <= self.last_s:
            self.counts.not_later += 1
            return GridSample.SKIPPED
        if t_s - self.last_s > LONGEST_GAP_S:
            self.counts.gaps += 1
            return GridSample.AFTER_GAP
        self._integrate(t_s, (thigh, shank, _turn(belt)))
        return GridSample.TAKEN

    def restart(self, t_s: float, thigh: float, shank: float, belt: float) -> None:
        """Begin again at this sample, with all angles 0."""
        self.last_s, self._origin_s, self._turned = t_s, t_s, (0.0, 0.0, 0.0)
        self._rates = (thigh, shank, _turn(belt))
        self.thigh, self.shank, self.yaw = [0.0], [0.0], [0.0]

    def _integrate(self, t_s: float, rates: tuple[float, float, float]) -> None:
        t0, half = self.last_s, 0.5 * (t_s - self.last_s)
        a0, b0, c0 = self._turned
        a1, b1, c1 = (a + half * (x + y) for a, x, y in zip(self._turned, self._rates, rates, strict=True))
        while (grid_s := self._origin_s + len(self.thigh) / GRID_HZ) <= t_s:
            share = (grid_s - t0) / (t_s - t0)
            self.thigh.append(a0 + share * (a1 - a0))
            self.shank.append(b0 + share * (b1 - b0))
            self.yaw.append(c0 + share * (c1 - c0))
        self.last_s, self._rates, self._turned = t_s, rates, (a1, b1, c1)

    def rates(self, begin: int = 0) -> Floats:
        """Rates (n, 2) of thigh and shank between the grid points from `begin` on."""
        return np.diff(np.column_stack([self.thigh[begin:], self.shank[begin:]]), axis=0) * GRID_HZ

    def drop(self, k: int) -> None:
        """Forget the first k grid points; later indices are smaller by k."""
        del self.thigh[:k], self.shank[:k], self.yaw[:k]
        self._origin_s += k / GRID_HZ


def _turn(belt: float) -> float:
    """The belt's rate, 0 where it is missing or impossible."""
    return belt if abs(belt) < FASTEST_RAD_S else 0.0
