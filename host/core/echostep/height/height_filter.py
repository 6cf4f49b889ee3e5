# SPDX-License-Identifier: MIT
"""Height by pressure at this moment, also in a moving lift; height above the start without a plan; whether the foot is held above the floor.

In: heights by pressure with the time between them, the foot's rises. Out: the height at the end of each segment. Owns two Kalman filters of two
states: the height and its rate; the height and the lag of the height by pressure behind it, a random walk; the last rises.

The median of a segment's heights is robust, but belongs to the middle: a quarter of a second old, and 0.25 m behind in a lift at 1 m/s. A rate that
changes slowly (a lift takes more than a second to start) carries many heights to the end: simulated rides of 3.5 m with an SCP1000 have a root mean
square error of 0.16 m, not of 0.23 m.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep.elementary import dot, product
from echostep.height.levels import HeightChange
from echostep.particles.limits import HALF_STOREY_M

# Spectral density of the acceleration: 0.8 m/s2 for 1.25 s at either end of a ride [ISO 8100-32, typical]
STARTING_M2_S3 = 0.2
RATE_SD_M_S = 0.5  # of the rate at first: stairs, or a lift
HEIGHT, LAG = range(2)
MEASURED = np.array([1.0, 1.0])  # the height by pressure is their sum
CLIMB_M_S = 0.5  # standard deviation of a climb that no foot measured, in a second: stairs at a brisk walk
UNKNOWN_M = 1e4  # standard deviation of the lag before the first pressure: any place on earth
# Assumed, not measured: how long a rise is kept in mind (weather, the foot's drift); sd of its difference by foot and pressure (draughts, noise)
KEPT_S, ALIKE_M = 10.0, 0.25
# The same of the height by pressure against a level (draughts, doors: 6 Pa); longest way of a trunk that may ride; speeds on stairs and of lifts: a
# faster change is the door of a stairwell under pressure, 20 to 50 Pa [EN 12101-6]
OFF_KEPT_S, OFF_SD_M, RESTING_M, CLIMBING_M_S, RIDING_M_S = 60.0, 0.5, 0.2, 0.5, 2.5


class RidingHeight:
    """`add` the heights of each segment; `height_m` is the height at the end of the last one, NaN before the first height."""

    def __init__(self, height_sd_m: float) -> None:
        """`height_sd_m`: of one height by pressure."""
        self._height_m2 = height_sd_m**2
        self.forget()

    def forget(self) -> None:
        """The heights begin again: the next ones may be another barometer's."""
        self.height_m, self._rate_m_s = math.nan, 0.0
        self._hh, self._hr, self._rr = 0.0, 0.0, 0.0  # their covariance

    def add(self, height_m: Floats, span_s: float) -> None:
        """Heights (k,) evenly spread over the time since the heights before; the last one is at its end."""
        dt_s = span_s / max(len(height_m), 1)
        for height in height_m.tolist():
            if math.isnan(self.height_m):
                self.height_m, self._hh, self._rr = height, self._height_m2, RATE_SD_M_S**2
            else:
                self.height_m += self._rate_m_s * dt_s
                self._hh += (2.0 * self._hr + self._rr * dt_s) * dt_s + STARTING_M2_S3 * dt_s**3 / 3.0
                self._hr += self._rr * dt_s + 0.5 * STARTING_M2_S3 * dt_s**2
                self._rr += STARTING_M2_S3 * dt_s
                self._correct(height)

    def _correct(self, height_m: float) -> None:
        off_m, variance = height_m - self.height_m, self._hh + self._height_m2
        gain, rate_gain = self._hh / variance, self._hr / variance
        self.height_m += gain * off_m
        self._rate_m_s += rate_gain * off_m
        self._rr -= rate_gain * self._hr
        self._hr -= gain * self._hr
        self._hh -= gain * self._hh


class RelativeHeight:
    """The height above the start, and its standard deviation (m)."""

    def __init__(self, drift_m: float) -> None:
        """`drift_m`: random walk of the height by pressure in a second."""
        self._drift_m = drift_m
        self._state = np.zeros(2)
        self._covariance = np.diag([0.0, UNKNOWN_M**2])

    def forget_lag(self) -> None:
        """The heights by pressure begin again: the next ones may be another barometer's."""
        self._covariance = np.diag([self._covariance[HEIGHT, HEIGHT], UNKNOWN_M**2])

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
            covariance = product(self._covariance, MEASURED)
            gain = covariance / (dot(MEASURED, covariance) + change.height_sd_m**2)
            self._state += gain * (change.height_m - dot(MEASURED, self._state))
            self._covariance -= np.outer(gain, covariance)
            self._covariance = 0.5 * (self._covariance + self._covariance.T)


class Rises:
    """Of a lifted foot, beside a belt whose pressure stays; of the pressure in a lift that the plan lacks, beside a level that stays.

    `evidence`: half the squared, normalized height of the foot above the floor. `off_m`: how far the height by pressure has left the level; from half
    a storey on it is kept, whatever the weather.
    """

    def __init__(self) -> None:
        self.evidence = self.off_m = self._felt_m = self._risen_m = 0.0
        self._height_m, self._starts, self._level_m = math.nan, 0, math.nan

    def update(self, change: HeightChange, way_m: float, barometer_starts: int, level_m: float) -> float:
        """Of a segment with a way of this length; `barometer_starts`: how often the heights by pressure have begun; `level_m`: height of the trunk by
        its level, NaN: none is believed. Returns by how much the evidence has grown.
        """
        if math.isinf(change.height_sd_m):
            return 0.0
        begins = barometer_starts != self._starts or math.isnan(self._height_m)
        risen_m, fade = (0.0, 0.0) if begins else (change.height_m - self._height_m, math.exp(-change.span_s / KEPT_S))
        self._felt_m, self._risen_m = fade * (self._felt_m + change.felt_m), fade * (self._risen_m + risen_m)
        self._height_m, self._starts, was = change.height_m, barometer_starts, self.evidence
        climbed_m, self._level_m = level_m - self._level_m, level_m
        if not abs(climbed_m) < HALF_STOREY_M:  # another level is believed, or none
            self.off_m = 0.0
        elif abs(risen_m) < (RIDING_M_S if way_m < RESTING_M else CLIMBING_M_S) * change.span_s:
            kept = 1.0 if abs(self.off_m) > HALF_STOREY_M else math.exp(-change.span_s / OFF_KEPT_S)
            self.off_m = kept * self.off_m + risen_m - climbed_m
        now = 0.5 * (max(self._felt_m - max(self._risen_m, 0.0), 0.0) / ALIKE_M) ** 2
        self.evidence = max(now, was) if now > 0.5 else now
        return max(self.evidence - was, 0.0)
