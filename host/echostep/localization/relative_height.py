# SPDX-License-Identifier: MIT
"""Height above the start without a plan: the foot's rises, and the height by pressure, whose level the weather moves.

In: `HeightChange`s. Out: a height and its standard deviation. Owns a Kalman filter of two states: the height, and the lag of the height by pressure
behind it, a random walk.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.localization.level_changes import HeightChange

HEIGHT, LAG = range(2)
MEASURED = np.array([1.0, 1.0])  # the height by pressure is their sum
CLIMB_M_S = 0.5  # standard deviation of a climb that no foot measured, in a second; by reason: stairs at a brisk walk
UNKNOWN_M = 1e4  # standard deviation of the lag before the first pressure; by reason: any place on earth


class RelativeHeight:
    """The height above the start, and its standard deviation (m)."""

    def __init__(self, drift_m: float) -> None:
        """`drift_m`: random walk of the height by pressure in a second."""
        self._drift_m = drift_m
        self._state = np.zeros(2)
        self._covariance = np.diag([0.0, UNKNOWN_M**2])

    @property
    def height_m(self) -> float:
        """Above the start."""
        return float(self._state[HEIGHT])

    @property
    def sd_m(self) -> float:
        """Standard deviation of the height."""
        return math.sqrt(max(float(self._covariance[HEIGHT, HEIGHT]), 0.0))

    def update(self, change: HeightChange) -> None:
        """Predict by the foot's rise, correct by the height by pressure."""
        felt = math.isfinite(change.felt_sd_m)
        self._state[HEIGHT] += change.felt_m if felt else 0.0
        rise_variance = change.felt_sd_m**2 if felt else CLIMB_M_S**2 * change.span_s
        self._covariance += np.diag([rise_variance, self._drift_m**2 * change.span_s])
        if math.isfinite(change.height_sd_m):
            covariance = self._covariance @ MEASURED
            gain = covariance / (MEASURED @ covariance + change.height_sd_m**2)
            self._state += gain * (change.height_m - MEASURED @ self._state)
            self._covariance -= np.outer(gain, covariance)
            self._covariance = 0.5 * (self._covariance + self._covariance.T)
