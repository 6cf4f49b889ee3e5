# SPDX-License-Identifier: MIT
"""Heading of the trunk from a gyro that turns with it and a disturbed compass.

In: yaw rates, compass headings (rad, counter-clockwise from the map's x), whether the wearer stands. Out: heading with its standard deviation. Owns
the filter's state: heading, gyro bias, and the compass errors from the wearer's iron.

Hard and soft iron that moves with a compass adds the error A + B sin h + C cos h + D sin 2h + E cos 2h to its heading h [National
Geospatial-Intelligence Agency 2004, Handbook of Magnetic Compass Adjustment]. A depends on the mounting of the device and cannot be separated from
the heading itself: it is left at 0. Iron of the building adds errors of about 7 degrees that vary by place and stay similar for some metres.
Therefore one reading has a small weight, and readings that turn while the gyro does not are rejected. `foot.magnetometer` applies the same
principle to a field of three axes.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Bools, Floats
from echostep.elementary import cos, dot, product, sin, wrap
from echostep.legs.angle_grid import LONGEST_GAP_S

HEADING, BIAS, IRON = 0, 1, 2  # indices of the state; from IRON on: B, C, D, E
SIZE = 6

# Assumed, not measured.
GATE_SD = 3.0  # gate on the innovation: a normal innovation exceeds it in 0.3 % of readings
STEP_S = 0.1  # of the covariance's propagation; also the compass period until two readings show it
SHORTEST_PERIOD_S = 0.02  # of the compass
MISSING_WALK_RAD = math.radians(30.0)  # random walk of the heading per root second while the gyro is missing
CALIBRATED_SHARE = 0.25  # of `iron_sd_rad` once calibrated
SECOND_SHARE = 0.5  # sd of D and E (soft iron) over that of B and C (hard iron, the larger error)
BIN_S = 0.1  # a trunk is at rest in the middle of CALM_BINS whose mean rates differ by less than CALM_RAD_S
CALM_BINS = 7
CALM_RAD_S = math.radians(1.0)


@dataclass(frozen=True, slots=True)
class CompassErrors:
    """B, C, D, E (rad): error B sin h + C cos h + D sin 2h + E cos 2h of a compass at heading h. `rms_rad`: residual of the fit."""

    sin1: float = 0.0
    cos1: float = 0.0
    sin2: float = 0.0
    cos2: float = 0.0
    rms_rad: float = 0.0

    def error(self, heading_rad: float) -> float:
        """Compass heading less true heading."""
        return dot(np.array([self.sin1, self.cos1, self.sin2, self.cos2]), harmonics(heading_rad))


@dataclass(frozen=True, slots=True)
class HeadingSettings:
    """Errors of gyro and compass.

    `disturbance_rad`: compass error from the building, sd; it stays similar for about `same_s`. `steady_rad`: largest difference between the turns of
    gyro and compass within a second. `walk_rad` and `drift_rad_s2`: random walk of heading and of gyro bias per root second. `bias_sd_rad_s`: bias
    at the start, sd. `rest_sd_rad_s`: mean rate of a resting trunk over 0.1 s, sd. `first_sd_rad`: first reading of the compass, sd; small where
    only turns relative to it matter. `iron_sd_rad`: error from the wearer's iron, sd, without calibration; `iron`: the calibration.
    """

    disturbance_rad: float = math.radians(8.0)
    same_s: float = 8.0
    steady_rad: float = math.radians(12.0)
    walk_rad: float = math.radians(0.06)
    drift_rad_s2: float = math.radians(0.002)
    bias_sd_rad_s: float = math.radians(1.5)
    rest_sd_rad_s: float = math.radians(0.4)
    first_sd_rad: float = math.radians(8.0)
    iron_sd_rad: float = math.radians(4.0)
    iron: CompassErrors | None = None


class Heading:
    """Kalman filter of heading, gyro bias and iron; equal samples give equal headings, in blocks of any size."""

    def __init__(
        self, settings: HeadingSettings | None = None, heading_rad: float | None = None, sd_rad: float = 0.0
    ) -> None:
        """`heading_rad`: at the start, with `sd_rad`; None if given by the first reading of the compass (0 without a compass)."""
        self.settings = s = settings or HeadingSettings()
        self.state = np.zeros(SIZE)
        iron_sd = CALIBRATED_SHARE * s.iron_sd_rad if s.iron else s.iron_sd_rad
        second_sd = SECOND_SHARE * iron_sd
        self.P = np.diag(np.square([sd_rad, s.bias_sd_rad_s, iron_sd, iron_sd, second_sd, second_sd]))
        if s.iron:
            self.state[IRON:] = s.iron.sin1, s.iron.cos1, s.iron.sin2, s.iron.cos2
        self.known = self._given = heading_rad is not None
        self._has_rate = False
        if heading_rad is not None:
            self.state[HEADING] = heading_rad
        self.read = self.refused = 0
        self._t_s: float | None = None
        self.unbroken_s = -math.inf  # since the newest gap, and since the compass then gave the heading anew
        self._since_s = 0.0  # since P was propagated
        self._turned = 0.0  # by the gyro since the last reading of the compass
        self._last: tuple[float, float] | None = None  # time and heading of the last reading of the compass
        self._difference = 0.0  # compass turn less gyro turn, fading within a second
        self._period_s = STEP_S  # of the compass
        self._bin = (-1, 0.0, 0, True)  # number, sum and count of rates, whether the legs stand in all of it
        self._bins: deque[float] = deque(maxlen=CALM_BINS)  # mean rates of the last bins in which the legs stand

    def feed(self, t_s: Floats, rate_rad_s: Floats, compass_rad: Floats, still: Bools | None = None) -> Floats:
        """(n, 2) heading (not wrapped) and its standard deviation after samples (n,); compass NaN where it was not read.

        `still` (n,): whether the legs stand.
        """
        headings = np.empty((len(t_s), 2))
        rests = np.zeros(len(t_s), np.bool_) if still is None else still
        samples = zip(t_s.tolist(), rate_rad_s.tolist(), compass_rad.tolist(), rests.tolist(), strict=True)
        for k, (t, rate, compass, rest) in enumerate(samples):
            self._propagate(t, rate)
            self._update_if_resting(t, rate, rest)
            if not math.isnan(compass):
                self._compass_update(t, compass)
            headings[k] = self.state[HEADING], math.sqrt(self.P[HEADING, HEADING])
        return headings

    @property
    def bias_sd_rad_s(self) -> float:
        """Standard deviation of the gyro's bias."""
        return math.sqrt(self.P[BIAS, BIAS])

    @property
    def iron(self) -> CompassErrors:
        """Estimated compass errors from the wearer's iron."""
        b, c, d, e = self.state[IRON:].tolist()
        return CompassErrors(b, c, d, e)

    def _propagate(self, t_s: float, rate: float) -> None:
        """Turn the heading by one rate; a missing one (NaN, or after a gap) inflates its variance."""
        if self._t_s is None or t_s <= self._t_s:
            self._t_s = t_s if self._t_s is None else self._t_s
            return
        dt, self._t_s = t_s - self._t_s, t_s
        if is_gap := dt > LONGEST_GAP_S:
            self.known, self.unbroken_s = self._given, t_s
        is_missing = is_gap or math.isnan(rate)
        turned = 0.0 if is_missing else (rate - float(self.state[BIAS])) * dt
        self.state[HEADING] += turned
        self._turned += turned
        if is_missing:
            self.P[HEADING, HEADING] += MISSING_WALK_RAD**2 * dt
        elif not self._has_rate:
            self._has_rate = True
            if self.known and not self._given:  # by the compass
                self._know_by_first_reading()
        self._since_s += dt
        if self._since_s >= STEP_S:
            self._propagate_covariance()

    def _know_by_first_reading(self) -> None:
        """The heading has the error of the compass's first reading, whatever it was before."""
        self.P[HEADING] = self.P[:, HEADING] = 0.0
        self.P[HEADING, HEADING] = self.settings.first_sd_rad**2

    def _propagate_covariance(self) -> None:
        """Propagate the covariance over the time since the last propagation."""
        dt, self._since_s = self._since_s, 0.0
        f = np.eye(SIZE)
        f[HEADING, BIAS] = -dt
        self.P = product(product(f, self.P), f.T)
        self.P[HEADING, HEADING] += self.settings.walk_rad**2 * dt
        self.P[BIAS, BIAS] += self.settings.drift_rad_s2**2 * dt

    def _update_if_resting(self, t_s: float, rate: float, still: bool) -> None:
        """Detect rest and update the bias. While the legs stand the trunk may still turn, so only the middle of a calm stretch is used."""
        number, total, count, all_still = self._bin
        if number == int(t_s / BIN_S):
            self._bin = (number, total + rate, count + 1, all_still and still)
            return
        self._bin = (int(t_s / BIN_S), rate, 1, still)
        if not count or not all_still or math.isnan(total):
            self._bins.clear()
            return
        self._bins.append(total / count)
        if len(self._bins) == CALM_BINS and max(self._bins) - min(self._bins) < CALM_RAD_S:
            self._zero_rate_update(self._bins[CALM_BINS // 2])

    def _zero_rate_update(self, rate: float) -> None:
        """A trunk at rest does not turn: its rate is a measurement of the bias."""
        innovation = rate - float(self.state[BIAS])
        if abs(innovation) < GATE_SD * (self.settings.rest_sd_rad_s + self.settings.bias_sd_rad_s):
            row = np.zeros(SIZE)
            row[BIAS] = 1.0
            self._update(row, innovation, self.settings.rest_sd_rad_s**2)

    def _compass_update(self, t_s: float, compass: float) -> None:
        """One reading of the compass: the first one, also after a gap, sets an unknown heading; a later one must be steady and within the gate."""
        self.read += 1
        self._propagate_covariance()
        heading = float(self.state[HEADING])
        if not self.known:
            self.known, self.unbroken_s = True, t_s
            self.state[HEADING] += wrap(compass - heading)
            self._know_by_first_reading()
            self._last, self._turned = (t_s, compass), 0.0
            return
        waves = harmonics(heading)
        innovation = wrap(compass - heading - dot(self.state[IRON:], waves))
        iron = float(np.trace(self.P[IRON:, IRON:]))
        gate = GATE_SD * math.sqrt(self.P[HEADING, HEADING] + iron + self.settings.disturbance_rad**2)
        if not self._steady(t_s, compass) or abs(innovation) > gate:
            self.refused += 1
            return
        row = np.zeros(SIZE)
        row[HEADING], row[IRON:] = 1.0, waves
        alike = max(1.0, self.settings.same_s / self._period_s)  # readings with the same disturbance
        self._update(row, innovation, alike * self.settings.disturbance_rad**2)

    def _steady(self, t_s: float, compass: float) -> bool:
        """Whether compass and gyro turned alike within about the last second."""
        before, self._last = self._last, (t_s, compass)
        turned, self._turned = self._turned, 0.0
        if before is None:
            self._period_s = STEP_S
            return True
        self._period_s = max(t_s - before[0], SHORTEST_PERIOD_S)
        fade = math.exp(-self._period_s)
        self._difference = fade * self._difference + wrap(compass - before[1] - turned)
        return abs(self._difference) < self.settings.steady_rad

    def _update(self, row: Floats, innovation: float, variance: float) -> None:
        """Kalman update by a scalar measurement with the measurement row (SIZE,)."""
        covariance = product(self.P, row)
        gain = covariance / (dot(row, covariance) + variance)
        self.state += gain * innovation
        self.P = self.P - np.outer(gain, covariance)
        self.P = 0.5 * (self.P + self.P.T)


def missing_sd_rad(span_s: float) -> float:
    """How far a trunk turns in a time without samples, 1 sd: a random walk."""
    return MISSING_WALK_RAD * math.sqrt(span_s)


def harmonics(heading_rad: float | Floats) -> Floats:
    """Sines and cosines of the heading and of twice the heading: (4,) or (4, n)."""
    once = np.asarray(heading_rad, np.float64)
    return np.array([sin(once), cos(once), sin(2.0 * once), cos(2.0 * once)])
