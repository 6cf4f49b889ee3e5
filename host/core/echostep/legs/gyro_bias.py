# SPDX-License-Identifier: MIT
"""Constant errors of a gyro on a leg: its bias, and the share of the trunk's turns that leaks into it.

In: mean rates over rest and over whole strides, in which the leg does not turn, and the trunk's mean rate. Out: `GyroBias`. Owns the filter.

A sensor whose axis is not level measures each turn times the sine of its tilt: 13 degrees leak 20 degrees of a 90-degree corner into the pitch.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

BIAS_SD_RAD_S = math.radians(3.0)  # at the start [ADIS16100 datasheet: 3 deg/s with temperature]
SMALLEST_BIAS_SD_RAD_S = math.radians(0.02)  # bias instability, assumed
LEAK_SD = 0.35  # sine of the tilt of a strapped sensor's axis: strapped legs show 0 to 26 degrees, thighs up to 35
GATE_SD = 3.0  # on the innovation: a false stride or a false rest exceeds it


@dataclass(slots=True)
class GyroBias:
    """Bias `value` (rad/s) and `leak` (rate per rate of the trunk), their variances and covariance."""

    value: float = 0.0
    leak: float = 0.0
    variance: float = BIAS_SD_RAD_S**2
    leak_variance: float = LEAK_SD**2
    covariance: float = 0.0

    def learn(self, measured: float, sd: float, turn_rad_s: float = 0.0) -> None:
        """Kalman update: `measured` (rad/s, sd) is the bias plus the leak of the trunk's mean rate; ignored outside the gate."""
        pb = self.variance + self.covariance * turn_rad_s
        pl = self.covariance + self.leak_variance * turn_rad_s
        spread = pb + pl * turn_rad_s + sd * sd
        innovation = measured - self.value - self.leak * turn_rad_s
        if innovation * innovation > GATE_SD**2 * spread:
            return
        self.value += pb / spread * innovation
        self.leak += pl / spread * innovation
        self.variance = max(self.variance - pb * pb / spread, SMALLEST_BIAS_SD_RAD_S**2)
        self.covariance -= pb * pl / spread
        self.leak_variance -= pl * pl / spread
        limit = math.sqrt(self.variance * self.leak_variance)
        self.covariance = min(max(self.covariance, -limit), limit)

    def drift_variance(self, span_s: float, turn_rad: float) -> float:
        """Variance (rad2), from the uncertainty of bias and leak, of the angle integrated over a time in which the trunk has turned."""
        return self.variance * span_s**2 + 2.0 * self.covariance * span_s * turn_rad + self.leak_variance * turn_rad**2

    def flip(self) -> None:
        """The same gyro with the other sign."""
        self.value, self.leak = -self.value, -self.leak
