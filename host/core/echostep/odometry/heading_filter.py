# SPDX-License-Identifier: MIT
"""Kalman filter of the components of the difference between foot and belt heading, from stance to stance.

In: `StanceHeadings`. Out: state and covariance, whether the belt can be trusted. Owns the model of both headings' errors.

Between two stances the foot's error walks at random as stated by its navigation; the belt's error is its noise, its bias times time, its scale error
times the turn. Trunk and foot differ by a constant angle, from stance to stance by JITTER_RAD, and more where the wearer turns.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep.elementary import dot, product, wrap
from echostep.legs.heading import HeadingSettings
from echostep.path import StanceHeadings

# Indices of the state: error of the foot (rad); the rest of foot less belt heading (rad); bias of the belt (rad/s); error of its scale.
FOOT, OFFSET, BIAS, SCALE = 0, 1, 2, 3
SIZE = 4
MEASURED = np.array([1.0, 1.0, 0.0, 0.0])  # foot less belt heading, by the state
GYRO = HeadingSettings()

# Trunk against foot in the middle of the stance: 0.9 to 1.2 degrees in straight strides (two feet, two belt sensors of legs_qmt), 10 to 40 degrees in
# turns of 60 to 170 degrees a stride (motion capture, legs_gaittoolbox).
JITTER_RAD, TWIST_SHARE = math.radians(1.2), 0.3
GATE_SD = 3.0  # a normal innovation exceeds it in 0.3 % of stances
# Assumed, not measured.
FIRST_SCALE_SD = 1.0  # a dead gyro (-1) is possible, and a reversed one (-2) not excluded
SURE_SCALE = 0.03  # sd, two right angles; real belts err by 1 to 2 %
LARGEST_SCALE = 0.1  # sensitivity, and 20 degrees of tilt of the axis, which cost 6 %
SCALE_WALK = 0.001  # from stance to stance: a belt that shifts, 1 % in a hundred strides
MEMORY = 20  # stances in the mean of the squared normalized innovations; 1 is expected
LARGEST_MEAN_SQUARE = 2.5  # of a worn belt; the mean of about 20 normal ones exceeds it once in 10,000
CORRELATED_S = 30.0  # the error of the bias acts in one direction until walls correct the heading: as a random walk of this much growth


class HeadingFilter:
    """For each stance call `propagate`, then `update`. `state` (SIZE,), `P` (SIZE, SIZE)."""

    def __init__(self, first: StanceHeadings) -> None:
        """Nothing is known but the first difference of the headings."""
        self.state = np.array([0.0, first.foot_rad - first.belt_rad, 0.0, 0.0])
        self.P = np.diag([0.0, JITTER_RAD**2, GYRO.bias_sd_rad_s**2, FIRST_SCALE_SD**2])
        self._last, self._turn_rad = first, 0.0
        self._mean_square = 1.0

    @property
    def trusted(self) -> bool:
        """Whether the foot's turns have confirmed the belt's turns."""
        known = self.P[SCALE, SCALE] < SURE_SCALE**2 and abs(self.state[SCALE]) < LARGEST_SCALE
        return bool(known and self._mean_square < LARGEST_MEAN_SQUARE)

    def belt_variance(self, dt: float, turn_rad: float = 0.0) -> float:
        """Variance (rad2) of a turn by the belt over `dt`, as of a random walk."""
        bias = GYRO.walk_rad**2 + self.P[BIAS, BIAS] * CORRELATED_S
        return float(bias * dt + self.P[SCALE, SCALE] * turn_rad**2)

    def propagate(self, stance: StanceHeadings, kept: float = 1.0) -> Floats:
        """Propagate the state to a stance; returns the transition (SIZE, SIZE). `kept`: share of the foot's error that is not left to the rest."""
        dt, turn = stance.t_s - self._last.t_s, wrap(stance.foot_rad - self._last.foot_rad)
        self._last, self._turn_rad = stance, turn
        f = np.eye(SIZE)
        f[FOOT, FOOT], f[OFFSET, FOOT] = kept, 1.0 - kept
        f[OFFSET, BIAS], f[OFFSET, SCALE] = -dt, -turn
        self.state = product(f, self.state)
        self.P = product(product(f, self.P), f.T)
        self.P[FOOT, FOOT] += stance.growth_rad2
        self.P[OFFSET, OFFSET] += GYRO.walk_rad**2 * dt + (stance.bias_sd_rad_s * dt) ** 2
        self.P[BIAS, BIAS] += GYRO.drift_rad_s2**2 * dt
        self.P[SCALE, SCALE] += SCALE_WALK**2
        return f

    def update(self, stance: StanceHeadings) -> bool:
        """Update by the measured difference; False if the innovation is beyond the gate."""
        innovation = wrap(stance.foot_rad - stance.belt_rad - dot(MEASURED, self.state))
        towards = product(self.P, MEASURED)
        variance = dot(MEASURED, towards) + JITTER_RAD**2 + (TWIST_SHARE * self._turn_rad) ** 2
        square = innovation**2 / variance
        self._mean_square += (min(square, GATE_SD**2) - self._mean_square) / MEMORY
        if square > GATE_SD**2:
            return False
        self.state = self.state + towards / variance * innovation
        self.P = self.P - np.outer(towards, towards) / variance
        return True
