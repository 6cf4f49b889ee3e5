# SPDX-License-Identifier: MIT
"""The wall that a ranger heard last, as a line in the walk frame: it foretells the next echo without a plan.

In: the way to each echo, and its range. Out: the density of the next range if that wall goes on. Owns the line.

A smooth wall answers from the foot of the perpendicular, whatever the ranger's axis: so its distance shrinks by the way along its normal. An extended
Kalman filter of distance and direction of the normal. An edge or a corner answers as a wall whose normal turns, which TURN_SD_RAD allows.
"""

from __future__ import annotations

import math

from echostep.angles import wrap
from echostep.localization.echo_likelihood import normal

# All by reason.
AXIS_SD_RAD = math.radians(
    20.0
)  # of a new wall's normal about the ranger's axis: half of the angle at which walls answer
SEEN_RAD = math.radians(50.0)  # of the normal from the axis: the angle at which near walls answer, and the axis' error
TURN_SD_RAD = 0.05  # change of the normal on a metre of path


class LastWall:
    """`distance_m`, `normal_rad`: the line seen from where the last echo was received; their covariance."""

    def __init__(self, range_m: float, axis_rad: float, sd_m: float, slant_m: float) -> None:
        """From a first echo. Standard deviation of a range: `sd_m`, and `slant_m` per radian off the axis."""
        self._sd_m, self._slant_m = sd_m, slant_m
        self.distance_m, self.normal_rad = range_m, axis_rad
        self._var_m2, self._covariance_m, self._var_rad2 = sd_m**2, 0.0, AXIS_SD_RAD**2

    def move(self, dx_m: float, dy_m: float) -> None:
        """Predict the line as seen after this way in the walk frame."""
        c, s = math.cos(self.normal_rad), math.sin(self.normal_rad)
        self.distance_m -= c * dx_m + s * dy_m
        across = s * dx_m - c * dy_m  # change of the distance with the normal
        self._var_m2 += across * (2.0 * self._covariance_m + across * self._var_rad2)
        self._covariance_m += across * self._var_rad2
        self._var_rad2 += TURN_SD_RAD**2 * math.hypot(dx_m, dy_m)

    def density(self, range_m: float, axis_rad: float) -> float:
        """Density (1/m) of an echo of this wall; 0 when it is out of the ranger's sight."""
        if abs(wrap(self.normal_rad - axis_rad)) > SEEN_RAD:
            return 0.0
        return normal(range_m - self.distance_m, math.sqrt(self._var_m2 + self._error_m(axis_rad) ** 2))

    def update(self, range_m: float, axis_rad: float, power: float) -> None:
        """Correct the line by an echo, whose error counts by `power`: those of successive echoes are alike."""
        total = self._var_m2 + self._error_m(axis_rad) ** 2 / power
        gain_m, gain_rad = self._var_m2 / total, self._covariance_m / total
        difference = range_m - self.distance_m
        self.distance_m += gain_m * difference
        self.normal_rad += gain_rad * difference
        self._var_rad2 -= gain_rad * self._covariance_m
        self._covariance_m -= gain_m * self._covariance_m
        self._var_m2 -= gain_m * self._var_m2

    def _error_m(self, axis_rad: float) -> float:
        """Standard deviation of a range."""
        return self._sd_m + self._slant_m * abs(wrap(self.normal_rad - axis_rad))
