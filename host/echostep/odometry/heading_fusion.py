# SPDX-License-Identifier: MIT
"""The foot's heading with the drift taken out that the belt gyro does not confirm.

In: blocks of belt rates, steps and stances of the foot (walk frame), in order of their messages. Out: the same steps, turned. Owns a Kalman filter of
foot minus belt heading, of the belt gyro's bias and of its scale error, and the correction of the foot's heading.

At the middle of each stance foot less belt heading is measured. Between two of them the foot's error walks at random as its navigation states; the
belt's error is its noise, its bias times time, its scale error times the turn. Trunk and foot differ by a constant angle, from stance to stance by
JITTER_RAD, and more where the wearer turns. What the filter finds of the foot's error is shared out by the variances of both turns. Bias and scale
are those known before the stride: a bias found later must not bend the path that is behind, or the correction would sum up to the foot's own drift.

Without evidence that the belt gyro turns with the foot (scale known to SURE_SCALE, within LARGEST_SCALE; innovations as expected) the correction is
kept as it is: a dead, loose or reversed gyro never corrects. A gap, or REFUSALS stances in a row beyond the gate, begin the evidence anew.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

import numpy as np

from echostep.angles import wrap
from echostep.arrays import Floats
from echostep.foot.alignment import rotated_event
from echostep.foot.steps import Stance, Step
from echostep.legs.heading import HeadingSettings
from echostep.legs.trunk_path import GyroBlock

OFFSET, BIAS, SCALE = 0, 1, 2  # indices of the state: foot less belt heading (rad), bias of the belt (rad/s), error of its scale
SIZE = 3

GAP_S = 0.05  # ten samples; a longer gap may hide a turn, by reason
KEPT_S = 10.0  # of belt angles: the first events wait up to 4 s for the toe's direction [foot.alignment]
HALF_STANCE_S = 0.25  # before its end a longer stance is measured: the heel is still down
# Trunk against foot in the middle of the stance: 0.9 to 1.2 degrees in straight strides (two feet, two belt sensors of legs_qmt), 10 to 40 degrees in
# turns of 60 to 170 degrees a stride (motion capture, legs_gaittoolbox).
JITTER_RAD, TWIST_SHARE = math.radians(1.2), 0.3
GATE_SD = 3.0  # a normal innovation exceeds it in 0.3 % of stances
# All by reason.
FIRST_SCALE_SD = 1.0  # a dead gyro (-1) is possible, and a reversed one (-2) not excluded
SURE_SCALE, LARGEST_SCALE = 0.03, 0.1  # sensitivity, and 20 degrees of tilt of the axis, which cost 6 %; real belts: 1 to 2 %
REFUSALS = 3
MEMORY = 20  # stances in the mean of the squared normalized innovations; 1 is expected
LARGEST_MEAN_SQUARE = 2.5  # of a belt that is worn; about 20 normal ones exceed it once in 10,000
CORRELATED_S = 30.0  # the error of the bias acts in one direction until walls tell the heading: as a random walk of this much growth


class HeadingFusion:
    """Call `add_belt` and `corrected` in order of the messages."""

    def __init__(self) -> None:
        self.correction_rad = 0.0  # error of the foot's heading so far, as far as it is known
        self._gyro = HeadingSettings()
        self._belt = BeltAngle()
        self._last: tuple[float, float] | None = None  # time and foot's yaw of the stance measured last
        self._growth = 0.0  # variance of the foot's turn since then, rad2
        self._share = 0.0  # of the foot's turn error that the next stance is expected to take out
        self._promised = self._owed = 0.0  # variance (rad2) that steps since the last stance did not state; of that what was not taken out
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
        """Foot less belt heading in a stance."""
        t_s = max(0.5 * (stance.t_start_s + stance.t_end_s), stance.t_end_s - HALF_STANCE_S)
        angle = self._belt.angle_rad(t_s)
        if angle is None:
            self._keep_foot()
            return
        measured = stance.heading_rad - angle
        if self._last is None or not self._belt.since_s < self._last[0] < t_s:
            self._keep_foot()
            self._restart(measured)
        else:
            self._update(t_s - self._last[0], wrap(stance.heading_rad - self._last[1]), measured)
        self._last, self._growth = (t_s, stance.heading_rad), 0.0

    def _update(self, dt: float, turn: float, measured: float) -> None:
        """Propagate over `dt` with a turn of the foot, update by the measured difference, correct the foot."""
        belt = self._belt_variance(dt, turn)
        share = self._growth / (self._growth + belt)
        self._propagate(dt, turn)
        innovation = wrap(measured - float(self._state[OFFSET]))
        variance = self._P[OFFSET, OFFSET] + JITTER_RAD**2 + (TWIST_SHARE * turn) ** 2
        square = innovation**2 / variance
        self._mean_square += (min(square, GATE_SD**2) - self._mean_square) / MEMORY
        if square > GATE_SD**2:
            self._refuse(measured)
            return
        self._refused = 0
        gain = self._P[:, OFFSET] / variance
        self._state = self._state + gain * innovation
        self._P = self._P - np.outer(gain, gain) * variance
        if self.trusted:
            self.correction_rad = wrap(self.correction_rad + share * float(gain[OFFSET]) * innovation)
        self._promised = 0.0
        self._share = share if self.trusted else 0.0

    def _propagate(self, dt: float, turn: float) -> None:
        """The state over `dt` with a turn of the foot: foot less belt changes by the belt's bias and scale error."""
        f = np.eye(SIZE)
        f[OFFSET, BIAS], f[OFFSET, SCALE] = -dt, -turn
        self._state = f @ self._state
        self._P = f @ self._P @ f.T
        self._P[OFFSET, OFFSET] += self._growth + self._gyro.walk_rad**2 * dt
        self._P[BIAS, BIAS] += self._gyro.drift_rad_s2**2 * dt

    def _belt_variance(self, dt: float, turn: float) -> float:
        """Growth of the belt heading's variance over `dt` with a turn, as a random walk."""
        bias: float = self._gyro.walk_rad**2 + self._P[BIAS, BIAS] * CORRELATED_S
        return bias * dt + float(self._P[SCALE, SCALE]) * turn**2

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
        self._state = np.array([measured, 0.0, 0.0])
        self._P = np.diag([JITTER_RAD**2, self._gyro.bias_sd_rad_s**2, FIRST_SCALE_SD**2])
        self._mean_square, self._refused = 1.0, 0


class BeltAngle:
    """The integral of the belt's rate, as far as it is unbroken."""

    def __init__(self) -> None:
        self.since_s = math.inf  # when the unbroken record begins
        self._rate = self._t_s = math.nan  # of the last sample
        self._angle = 0.0
        self._kept: deque[tuple[Floats, Floats]] = deque()  # times and angles of each block, with the sample before it

    def add(self, t_s: Floats, rate_rad_s: Floats) -> None:
        """A block of samples (n,). One with a missing sample, or whose samples are all alike as of a dead gyro, is left out."""
        if not (np.isfinite(t_s).all() and np.isfinite(rate_rad_s).all()) or np.ptp(rate_rad_s) == 0.0:
            return
        times, rates = np.append(self._t_s, t_s), np.append(self._rate, rate_rad_s)
        if not (np.diff(times) > 0.0).all() or np.diff(times).max() > GAP_S:
            self._begin(float(t_s[0]))
            times, rates = t_s, rate_rad_s
            if not (np.diff(times) > 0.0).all() or np.diff(times).max() > GAP_S:
                return
        turned = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(times) * (rates[1:] + rates[:-1]))])
        self._kept.append((times, self._angle + turned))
        self._t_s, self._rate, self._angle = float(times[-1]), float(rates[-1]), self._angle + float(turned[-1])
        while self._kept[0][0][-1] < self._t_s - KEPT_S:
            self._kept.popleft()

    def angle_rad(self, t_s: float) -> float | None:
        """The angle (not wrapped) at a time; None where it is not known (yet)."""
        for times, angles in reversed(self._kept):
            if times[0] <= t_s <= times[-1]:
                return float(np.interp(t_s, times, angles))
        return None

    def _begin(self, t_s: float) -> None:
        self._kept.clear()
        self.since_s, self._t_s = t_s, math.nan
