# SPDX-License-Identifier: MIT
"""The angle that the belt has turned: the integral of its gyro's rate, as far as it is unbroken.

In: blocks of samples in order of time. Out: the angle at a time of the last KEPT_S. Owns these angles. Positive: counter-clockwise from above.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from echostep.arrays import Floats

GAP_S = 0.05  # ten samples; a longer gap may hide a turn, assumed
KEPT_S = 30.0  # longest standing from which a bias is measured


class BeltAngle:
    """Call `add` with blocks in order of time."""

    def __init__(self) -> None:
        self.since_s = math.inf  # when the unbroken record begins
        self._rate = self._t_s = math.nan  # of the last sample
        self._angle = 0.0
        self._kept: deque[tuple[Floats, Floats]] = deque()  # times and angles of each block, with the sample before it

    def add(self, t_s: Floats, rate_rad_s: Floats) -> None:
        """A block of samples (n,). A block with a missing sample, or with equal samples only (a dead gyro), is left out."""
        if not np.isfinite([t_s, rate_rad_s]).all() or (rate_rad_s == rate_rad_s[0]).all():
            return
        times, rates = t_s, rate_rad_s
        if goes_on := 0.0 < t_s[0] - self._t_s <= GAP_S:
            times, rates = np.concatenate([[self._t_s], t_s]), np.concatenate([[self._rate], rate_rad_s])
        steps_s = times[1:] - times[:-1]
        is_unbroken = steps_s.min() > 0.0 and steps_s.max() <= GAP_S
        if not (goes_on and is_unbroken):
            self._begin(float(t_s[0]))
        if not is_unbroken:
            return
        turned = np.concatenate([[0.0], np.cumsum(0.5 * steps_s * (rates[1:] + rates[:-1]))])
        self._kept.append((times, self._angle + turned))
        self._t_s, self._rate, self._angle = float(times[-1]), float(rates[-1]), self._angle + float(turned[-1])
        while self._kept[0][0][-1] < self._t_s - KEPT_S:
            self._kept.popleft()

    @property
    def oldest_s(self) -> float:
        """Time of the oldest angle; infinite without angles."""
        return float(self._kept[0][0][0]) if self._kept else math.inf

    def angle_rad(self, t_s: float) -> float | None:
        """The angle (not wrapped) at a time; None if it is not known (yet)."""
        for times, angles in reversed(self._kept):
            if times[0] <= t_s <= times[-1]:
                return float(np.interp(t_s, times, angles))
        return None

    def _begin(self, t_s: float) -> None:
        """Begin an unbroken record at a time."""
        self._kept.clear()
        self.since_s, self._t_s = t_s, math.nan
