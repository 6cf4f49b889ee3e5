"""Heading of the trunk from a gyro that turns with it and a compass that is disturbed.

In: yaw rates, compass headings (rad, counter-clockwise from the map's x), whether the wearer stands. Out: heading with its standard deviation. Owns
the filter's state: heading, gyro bias, and how the wearer's iron turns the compass; `fit_compass_errors` finds that iron from a turn on the spot.

CompassErrors that moves with a compass, hard or soft, errs its heading h by A + B sin h + C cos h + D sin 2h + E cos 2h [National
Geospatial-Intelligence Agency 2004, Handbook of Magnetic Compass Adjustment]. A says where the device is mounted and cannot be told from the
heading itself: it is left 0. CompassErrors of the building errs it by 7 degrees from place to place, much the same for some metres: so one reading
counts little, and readings that turn while the gyro does not count for nothing. The foot's magnetometer (`compass`) is the same idea for a field
of three axes.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from echostep.angles import wrap
from echostep.arrays import Bools, Floats

HEADING, BIAS, IRON = 0, 1, 2  # places in the state
SIZE = 6
FULL_TURN_RAD = math.radians(330.0)
LARGEST_IRON_RAD = math.radians(60.0)
FAR_OFF_SD = 3.0
FITS = 6
BIN_S = 0.1  # a trunk is at rest in the middle of CALM_BINS whose means differ by less than CALM_RAD_S
CALM_BINS = 7
CALM_RAD_S = math.radians(1.0)


@dataclass(frozen=True, slots=True)
class CompassErrors:
    """B, C, D, E (rad): a compass shows B sin h + C cos h + D sin 2h + E cos 2h too much at heading h. `rms_rad`: what a fit left over."""

    sin1: float = 0.0
    cos1: float = 0.0
    sin2: float = 0.0
    cos2: float = 0.0
    rms_rad: float = 0.0

    def error(self, heading_rad: float) -> float:
        """What the compass shows too much."""
        return float(np.array([self.sin1, self.cos1, self.sin2, self.cos2]) @ _harmonics(heading_rad))


@dataclass(frozen=True, slots=True)
class HeadingSettings:
    """How wrong gyro and compass are: the building's `disturbance_rad` stays the same for about `same_s`; `steady_rad` is how far gyro and compass
    may part in a second. `drift_rad_s2` is the random walk of the bias in a root second, `walk_rad` that of the heading. `iron_sd_rad` of what is not
    calibrated. `rest_sd_rad_s`: how somebody who stands still turns nevertheless, in a tenth of a second. `first_sd_rad`: of the first reading of the
    compass; small where only turns against it count.
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
    """A Kalman filter of heading, gyro bias and iron; equal samples give equal headings, in whatever portions they come."""

    def __init__(
        self, settings: HeadingSettings | None = None, heading_rad: float | None = None, sd_rad: float = 0.0
    ) -> None:
        """`heading_rad`: at the beginning, with `sd_rad`; None: the first reading of the compass tells, or it counts from 0."""
        self.settings = s = settings or HeadingSettings()
        self.state = np.zeros(SIZE)
        iron_sd = 0.25 * s.iron_sd_rad if s.iron else s.iron_sd_rad
        self.P = np.diag(
            [sd_rad**2, s.bias_sd_rad_s**2, iron_sd**2, iron_sd**2, (0.5 * iron_sd) ** 2, (0.5 * iron_sd) ** 2]
        )
        if s.iron:
            self.state[IRON:] = s.iron.sin1, s.iron.cos1, s.iron.sin2, s.iron.cos2
        self.known = self._given = heading_rad is not None
        self._spun = False
        if heading_rad is not None:
            self.state[HEADING] = heading_rad
        self.read = self.refused = 0
        self._t_s: float | None = None
        self._since_s = 0.0  # since P was moved on
        self._turned = 0.0  # by the gyro since the compass was read, a running difference over a second
        self._last: tuple[float, float] | None = None  # time and compass of the reading before
        self._parted = 0.0
        self._period_s = 0.1
        self._bin = (-1, 0.0, 0, True)  # its number, sum and count of rates, whether the legs stand in all of it
        self._bins: deque[float] = deque(maxlen=CALM_BINS)  # means of the last ones in which they did

    def feed(self, t_s: Floats, rate_rad_s: Floats, compass_rad: Floats, still: Bools | None = None) -> Floats:
        """(n, 2) heading (not wrapped) and its standard deviation at samples (n,); compass NaN where it was not read."""
        found = np.empty((len(t_s), 2))
        rests = np.zeros(len(t_s), np.bool_) if still is None else still
        samples = zip(t_s.tolist(), rate_rad_s.tolist(), compass_rad.tolist(), rests.tolist(), strict=True)
        for k, (t, rate, compass, rest) in enumerate(samples):
            self._turn(t, rate)
            self._watch(t, rate, rest)
            if not math.isnan(compass):
                self._see(t, compass)
            found[k] = self.state[HEADING], math.sqrt(self.P[HEADING, HEADING])
        return found

    @property
    def bias_sd_rad_s(self) -> float:
        """How well the gyro's bias is known."""
        return math.sqrt(self.P[BIAS, BIAS])

    @property
    def iron(self) -> CompassErrors:
        """The wearer's iron, as far as it is known."""
        b, c, d, e = self.state[IRON:].tolist()
        return CompassErrors(b, c, d, e)

    def _turn(self, t_s: float, rate: float) -> None:
        if self._t_s is None or t_s <= self._t_s:
            self._t_s = t_s if self._t_s is None else self._t_s
            return
        dt, self._t_s = t_s - self._t_s, t_s
        turned = 0.0 if math.isnan(rate) else (rate - float(self.state[BIAS])) * dt
        self.state[HEADING] += turned
        self._turned += turned
        if math.isnan(rate):
            self.P[HEADING, HEADING] += (math.radians(30.0)) ** 2 * dt
        elif not self._spun:
            self._begin()
        self._since_s += dt
        if self._since_s >= 0.1:
            self._grow()

    def _begin(self) -> None:
        """The gyro speaks for the first time: until then only the compass told, and tells no more exactly than it does."""
        self._spun = True
        if self.known and not self._given:
            self.P[HEADING] = self.P[:, HEADING] = 0.0
            self.P[HEADING, HEADING] = self.settings.first_sd_rad**2

    def _grow(self) -> None:
        """Move the covariance on."""
        dt, self._since_s = self._since_s, 0.0
        f = np.eye(SIZE)
        f[HEADING, BIAS] = -dt
        self.P = f @ self.P @ f.T
        self.P[HEADING, HEADING] += self.settings.walk_rad**2 * dt
        self.P[BIAS, BIAS] += self.settings.drift_rad_s2**2 * dt

    def _watch(self, t_s: float, rate: float, still: bool) -> None:
        """Whose legs stand may turn on the spot or begin to walk: only in the middle of a calm stretch does the gyro show its bias."""
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
            self._rest(self._bins[CALM_BINS // 2])

    def _rest(self, rate: float) -> None:
        """Who stands does not turn: the gyro shows its bias."""
        off = rate - float(self.state[BIAS])
        if abs(off) < FAR_OFF_SD * (self.settings.rest_sd_rad_s + self.settings.bias_sd_rad_s):
            row = np.zeros(SIZE)
            row[BIAS] = 1.0
            self._update(row, off, self.settings.rest_sd_rad_s**2)

    def _see(self, t_s: float, compass: float) -> None:
        """One reading of the compass."""
        self.read += 1
        self._grow()
        heading = float(self.state[HEADING])
        if not self.known:
            self.known = True
            self.state[HEADING] = heading = compass
            self.P[HEADING] = self.P[:, HEADING] = 0.0
            self.P[HEADING, HEADING] = self.settings.first_sd_rad**2
            self._last, self._turned = (t_s, compass), 0.0
            return
        harmonics = _harmonics(heading)
        off = wrap(compass - heading - float(self.state[IRON:] @ harmonics))
        if not self._steady(t_s, compass) or abs(off) > self._gate():
            self.refused += 1
            return
        row = np.zeros(SIZE)
        row[HEADING], row[IRON:] = 1.0, harmonics
        again = max(1.0, self.settings.same_s / self._period_s)
        self._update(row, off, again * self.settings.disturbance_rad**2)

    def _gate(self) -> float:
        iron = float(np.trace(self.P[IRON:, IRON:]))
        return FAR_OFF_SD * math.sqrt(self.P[HEADING, HEADING] + iron + self.settings.disturbance_rad**2)

    def _steady(self, t_s: float, compass: float) -> bool:
        """Whether compass and gyro turned alike lately."""
        before, self._last = self._last, (t_s, compass)
        turned, self._turned = self._turned, 0.0
        if before is None:
            self._period_s = 0.1
            return True
        self._period_s = max(t_s - before[0], 0.02)
        fade = math.exp(-self._period_s)
        self._parted = fade * self._parted + wrap(compass - before[1] - turned)
        return abs(self._parted) < self.settings.steady_rad

    def _update(self, row: Floats, off: float, variance: float) -> None:
        towards = self.P @ row
        gain = towards / (row @ towards + variance)
        self.state += gain * off
        self.P = self.P - np.outer(gain, towards)
        self.P = 0.5 * (self.P + self.P.T)


def fit_compass_errors(t_s: Floats, rate_rad_s: Floats, compass_rad: Floats) -> CompassErrors:
    """The iron of a wearer who turned on the spot, once round or more, from samples (n,); raises ValueError that says what is wrong with the turn.

    Gyro and compass differ by an angle, a bias times time, and the iron: least squares of all six, each reading's own angle by the gyro.
    """
    turned = np.concatenate([[0.0], np.cumsum(np.diff(t_s) * 0.5 * (rate_rad_s[1:] + rate_rad_s[:-1]))])
    read = np.isfinite(compass_rad)
    if read.sum() < 20:
        raise ValueError("fewer than 20 readings of the compass: is it connected?")
    at, turn, shown = t_s[read] - t_s[0], turned[read], np.unwrap(compass_rad[read])
    if float(np.ptp(turn)) < FULL_TURN_RAD:
        raise ValueError(
            f"the turn covers {math.degrees(float(np.ptp(turn))):.0f} degrees: turn once round on the spot, slowly"
        )
    if float(np.ptp(shown)) < 0.5 * FULL_TURN_RAD:
        raise ValueError("the compass does not follow the turn: is it stuck, or is there a magnet beside it?")
    if (shown[-1] - shown[0]) * (turn[-1] - turn[0]) < 0.0:
        turn = -turn
    offset, drift, iron = float(np.mean(shown - turn)), 0.0, np.zeros(4)
    for _ in range(FITS):
        h = turn + offset + drift * at
        columns = np.column_stack([np.ones_like(h), at - at.mean(), *_harmonics(h)])
        off = shown - h
        weight = np.ones_like(off)
        for _ in range(3):  # a few readings may be wrong altogether
            found = np.linalg.lstsq(columns * weight[:, None], off * weight, rcond=None)[0]
            left = off - columns @ found
            spread = max(1.4826 * float(np.median(np.abs(left))), math.radians(0.2))
            weight = np.minimum(1.0, 2.0 * spread / np.maximum(np.abs(left), 1e-9)) ** 0.5
        offset += float(found[0]) - float(found[1]) * float(at.mean())
        drift += float(found[1])
        iron = found[2:]
    if float(np.hypot(iron[0], iron[1])) > LARGEST_IRON_RAD:
        raise ValueError(
            "the iron beside the compass is stronger than the earth's field: move the compass away from it"
        )
    b, c, d, e = iron.tolist()
    return CompassErrors(b, c, d, e, float(np.sqrt(np.mean(left**2))))


def compass_heading(bearing_rad: Floats) -> Floats:
    """Map heading, counter-clockwise from x, of bearings clockwise from north."""
    return 0.5 * math.pi - bearing_rad


def _harmonics(heading_rad: float | Floats) -> Floats:
    """Sines and cosines of the heading and of twice the heading: (4,) or (4, n)."""
    return np.array([np.sin(heading_rad), np.cos(heading_rad), np.sin(2.0 * heading_rad), np.cos(2.0 * heading_rad)])
