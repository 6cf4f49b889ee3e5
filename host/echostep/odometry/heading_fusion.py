# SPDX-License-Identifier: MIT
"""The foot's heading with the drift taken out that the belt gyro does not confirm.

In: blocks of belt rates, steps and stances of the foot (walk frame), in order of their messages. Out: the same steps, turned. Owns a Kalman filter of
foot minus belt heading, of the belt gyro's bias and of its scale error, and the correction of the foot's heading.

In the middle of each stance, and at both ends of standing, foot less belt heading is measured. Between two of them the foot's error walks at random
as its navigation states; the belt's error is its noise, its bias times time, its scale error times the turn. Trunk and foot differ by a constant
angle, from stance to stance by JITTER_RAD, and more where the wearer turns. What the filter finds of the foot's error is shared out by the variances
of both turns. Bias and scale are those known before the stride: a bias found later must not bend the path that is behind, or all corrections would
sum up to the foot's own drift. In the long run the foot knows more, since its error grows by the root of time: the correction fades.

Without evidence that the belt gyro turns with the foot (scale known to SURE_SCALE, within LARGEST_SCALE; innovations as expected) the correction is
kept as it is: a dead, loose or reversed gyro never corrects. A gap, or REFUSALS stances in a row beyond the gate, begin the evidence anew.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from echostep.angles import wrap
from echostep.foot.alignment import rotated_event
from echostep.foot.steps import Stance, Step
from echostep.legs.heading import HeadingSettings
from echostep.legs.trunk_path import GyroBlock
from echostep.odometry.belt_angle import BeltAngle

# Indices of the state: recent error of the foot (rad), not yet corrected; the rest of foot less belt heading (rad); bias of the belt (rad/s); error
# of its scale.
FOOT, OFFSET, BIAS, SCALE = 0, 1, 2, 3
SIZE = 4
MEASURED = np.array([1.0, 1.0, 0.0, 0.0])  # foot less belt heading, by the state

REST_S = 1.0  # a longer stance is standing [foot.trunk_path], which is measured near both ends:
EDGE_S = 0.25  # half a stance from them
# Trunk against foot in the middle of the stance: 0.9 to 1.2 degrees in straight strides (two feet, two belt sensors of legs_qmt), 10 to 40 degrees in
# turns of 60 to 170 degrees a stride (motion capture, legs_gaittoolbox).
JITTER_RAD, TWIST_SHARE = math.radians(1.2), 0.3
# Walking adds to the bias by turns about the other axes: two belts on one pelvis differ by 0.08 deg/s more in walking than at rest [legs_qmt].
WALKING_RAD_S = math.radians(0.06)
GATE_SD = 3.0  # a normal innovation exceeds it in 0.3 % of stances
# All by reason.
FIRST_SCALE_SD = 1.0  # a dead gyro (-1) is possible, and a reversed one (-2) not excluded
SURE_SCALE = 0.03  # sd, two right angles; real belts err by 1 to 2 %
LARGEST_SCALE = 0.1  # sensitivity, and 20 degrees of tilt of the axis, which cost 6 %
SCALE_WALK = 0.001  # from stance to stance: a belt that shifts, 1 % in a hundred strides
REFUSALS = 3
MEMORY = 20  # stances in the mean of the squared normalized innovations; 1 is expected
LARGEST_MEAN_SQUARE = 2.5  # of a belt that is worn; about 20 normal ones exceed it once in 10,000
RECENT_S = 10.0  # time in which jitter lets the filter find an error of the foot: some strides; what is older is no longer sought
CORRELATED_S = 30.0  # the error of the bias acts in one direction until walls tell the heading: as a random walk of this much growth


class HeadingFusion:
    """Call `add_belt` and `corrected` in order of the messages."""

    def __init__(self) -> None:
        self.correction_rad = 0.0  # error of the foot's heading so far, as far as it is known
        self._gyro = HeadingSettings()
        self._belt = BeltAngle()
        self._last: tuple[float, float] | None = None  # time and foot's yaw of the stance measured last
        self._growth = 0.0  # variance of the foot's turn since then, rad2
        self._share = 0.0  # of the foot's turn error that the last stance has taken out, and the next is expected to
        self._promised = self._owed = (
            0.0  # variance (rad2) that steps since the last stance did not state; of that what was not taken out
        )
        self._state, self._P = np.zeros(SIZE), np.eye(SIZE)
        self._mean_square, self._refused = 1.0, 0
        self._restart(0.0)

    def add_belt(self, block: GyroBlock) -> None:
        """A block of samples, of which the belt's rate is used."""
        self._belt.add(block.t_s, block.belt)

    @property
    def trusted(self) -> bool:
        """Whether foot and belt have been seen to turn alike."""
        known = self._P[SCALE, SCALE] < SURE_SCALE**2 and abs(self._state[SCALE]) < LARGEST_SCALE
        return bool(known and self._mean_square < LARGEST_MEAN_SQUARE)

    def corrected(self, event: Step | Stance) -> Step | Stance:
        """A step turned by the correction; a stance as it is, after it was measured."""
        if isinstance(event, Stance):
            self._measure(event)
            return event
        variance = event.heading_sd_rad**2
        self._growth += variance
        stated = math.sqrt((1.0 - self._share) * variance + self._owed)
        self._promised, self._owed = self._promised + self._share * variance, 0.0
        if self.correction_rad == 0.0 and self._share == 0.0:
            return event
        turned = rotated_event(event, self.correction_rad)
        assert isinstance(turned, Step)
        heading_rad = wrap(event.heading_rad - self.correction_rad)
        return replace(turned, heading_rad=heading_rad, heading_sd_rad=stated, toe_rad=event.toe_rad)

    def _measure(self, stance: Stance) -> None:
        """Foot less belt heading in a stance; the foot does not turn while it stands."""
        begin_s, end_s = stance.t_start_s + EDGE_S, stance.t_end_s - EDGE_S
        if end_s - begin_s < REST_S:
            self._measure_at(0.5 * (begin_s + end_s), stance.heading_rad)
            return
        self._measure_at(max(begin_s, min(self._belt.oldest_s, end_s)), stance.heading_rad)
        self._measure_at(end_s, stance.heading_rad, WALKING_RAD_S)

    def _measure_at(self, t_s: float, yaw_rad: float, bias_sd_rad_s: float = 0.0) -> None:
        """Foot less belt heading at a time; `bias_sd_rad_s`: how far the belt's bias has differed since the last measurement."""
        angle = self._belt.angle_rad(t_s)
        if angle is None:
            self._keep_foot()
            return
        if self._last is None or not self._belt.since_s <= self._last[0] < t_s:
            self._keep_foot()
            self._restart(yaw_rad - angle)
        else:
            dt = t_s - self._last[0]
            turn = wrap(yaw_rad - self._last[1])
            share = self._belt_share(dt, turn)
            self._fade(dt)
            self._propagate(dt, turn, (bias_sd_rad_s * dt) ** 2)
            self._update(yaw_rad - angle, turn, share)
        self._last, self._growth = (t_s, yaw_rad), 0.0

    def _fade(self, dt: float) -> None:
        """Return to the foot over the time (s) in which the error of the belt's bias makes as much drift as the foot has."""
        if self.trusted and self._growth > 0.0:
            over_s = max(self._growth / (dt * float(self._P[BIAS, BIAS])), CORRELATED_S)
            self.correction_rad *= math.exp(-dt / over_s)

    def _belt_share(self, dt: float, turn: float) -> float:
        """Share of the foot's turn error that the belt takes out: by the variances of both turns over `dt`, the belt's as of a random walk."""
        belt = (self._gyro.walk_rad**2 + self._P[BIAS, BIAS] * CORRELATED_S) * dt + self._P[SCALE, SCALE] * turn**2
        return float(self._growth / (self._growth + belt))

    def _propagate(self, dt: float, turn: float, variance: float) -> None:
        """The state over `dt` with a turn of the foot: foot less belt changes by the belt's bias and scale error; `variance`: added to noise."""
        kept = math.exp(-dt / RECENT_S)
        f = np.eye(SIZE)
        f[FOOT, FOOT], f[OFFSET, FOOT] = kept, 1.0 - kept
        f[OFFSET, BIAS], f[OFFSET, SCALE] = -dt, -turn
        self._state = f @ self._state
        self._P = f @ self._P @ f.T
        self._P[FOOT, FOOT] += self._growth
        self._P[OFFSET, OFFSET] += self._gyro.walk_rad**2 * dt + variance
        self._P[BIAS, BIAS] += self._gyro.drift_rad_s2**2 * dt
        self._P[SCALE, SCALE] += SCALE_WALK**2

    def _update(self, measured: float, turn: float, share: float) -> None:
        """Update by the measured difference after a turn of the foot; correct the foot by the belt's share of what is found of its error."""
        innovation = wrap(measured - float(MEASURED @ self._state))
        towards = self._P @ MEASURED
        variance = float(MEASURED @ towards) + JITTER_RAD**2 + (TWIST_SHARE * turn) ** 2
        square = innovation**2 / variance
        self._mean_square += (min(square, GATE_SD**2) - self._mean_square) / MEMORY
        if square > GATE_SD**2:
            self._refuse(measured)
            return
        self._state = self._state + towards / variance * innovation
        self._P = self._P - np.outer(towards, towards) / variance
        found = float(self._state[FOOT])
        self._state[FOOT], self._state[OFFSET] = 0.0, self._state[OFFSET] + found
        self._share = share if self.trusted else 0.0
        self.correction_rad = wrap(self.correction_rad + self._share * found)
        self._refused, self._promised = 0, 0.0

    def _refuse(self, measured: float) -> None:
        """An innovation beyond the gate: the trunk looks aside, or the gyro does not turn with it."""
        self._keep_foot()
        self._refused += 1
        if self._refused >= REFUSALS:
            self._restart(measured)

    def _keep_foot(self) -> None:
        """The foot's turn stays uncorrected: the next step states the variance that was left out."""
        self._owed, self._promised, self._share = self._owed + self._promised, 0.0, 0.0

    def _restart(self, measured: float) -> None:
        """Nothing is known but the difference of the headings."""
        self._state = np.array([0.0, measured, 0.0, 0.0])
        self._P = np.diag([0.0, JITTER_RAD**2, self._gyro.bias_sd_rad_s**2, FIRST_SCALE_SD**2])
        self._mean_square, self._refused = 1.0, 0
