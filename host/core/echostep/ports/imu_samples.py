# SPDX-License-Identifier: MIT
"""Samples of any foot IMU in place of an MTx's, as arrays; one rule for their units and order, for arrays and for files.

In: arrays, or a table (n, 7 or more) of time s, specific force m/s2, angular rate rad/s. Out: `ImuSamples`: each sample with a counter and an arrival
time, both from its own time; complaints with the factor: wrong units give a plausible, wrong track. Owns the time of the first sample.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.errors import EchostepError
from echostep.ports.chunks import LATEST_NS

TIME = 0  # columns of the table
FORCE = slice(1, 4)
RATE = slice(4, 7)
TIME_UNITS = ("seconds", "s", 1.0), ("milliseconds", "ms", 1e3), ("microseconds", "us", 1e6), ("nanoseconds", "ns", 1e9)

# Assumed, all of them.
CALMEST_SHARE = 0.1  # share of the samples in which a foot surely stands
# Of the specific force at rest: 30 % for errors of the sensor and a foot not quite at rest
GRAVITY_RANGE_M_S2 = (7.0, 13.0)
G_RANGE = (0.7, 1.3)  # the same in units of gravity
FASTEST_FOOT_RAD_S = 40.0  # 2300 deg/s; common gyros end at 2000 deg/s
FASTEST_QUANTILE = 0.999  # of the rates, compared with that limit: single spikes are left out
RATE_RANGE_HZ = (45.0, 550.0)  # 50 to 500 Hz with a margin of 10 %
BACK_SHARE = 0.02  # largest share of rows whose time goes back
REPEATED_SHARE = 0.6  # largest share of rows that repeat the time before
OF_NO_UNIT = 1e6  # force or rate that no unit of a sample gives
FEWEST_SAMPLES = 500  # of arrays that are checked: 1 to 10 s


class ImuSamples(NamedTuple):
    """Samples (n,): `counter` of 16 bits, `t_arrival_ns`, `accel` (n, 3) m/s2, `gyro` (n, 3) rad/s."""

    counter: Ints
    t_arrival_ns: Ints
    accel: Floats
    gyro: Floats


class SampleCounter:
    """Numbers samples by their times, from the first sample on: a gap in the times is a gap in the counter.

    `left_out`: samples within the same period as the one before, which are dropped.
    """

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._first_s, self._last = math.nan, -1.0
        self.left_out = 0

    def of(self, t_s: Floats, accel: Floats, gyro: Floats) -> ImuSamples:
        """From t_s (n,) s, rising; accel (n, 3) m/s2, gyro (n, 3) rad/s, body frame. Raises EchostepError for other shapes."""
        t_s, accel, gyro = (np.asarray(each, np.float64) for each in (t_s, accel, gyro))
        if t_s.ndim != 1 or accel.shape != (len(t_s), 3) or gyro.shape != (len(t_s), 3):
            raise EchostepError(f"t_s {t_s.shape}, accel {accel.shape}, gyro {gyro.shape}; must be (n,) and (n, 3)")
        if not np.isfinite(t_s).all():
            raise EchostepError("samples: t_s is not a number in some of them: leave these out")
        if math.isnan(self._first_s) and len(t_s):
            self._first_s = float(t_s[0])
        at_s = t_s - self._first_s
        count = np.rint(at_s * self._rate_hz)
        newest = np.maximum.accumulate(np.append(self._last, count))
        kept = count > newest[:-1]
        self._last = float(newest[-1])
        self.left_out += int(np.sum(~kept))
        arrival_ns = np.clip(np.rint(1e9 * at_s[kept]), 0.0, LATEST_NS).astype(np.int64)
        return ImuSamples(np.mod(count[kept], 1 << 16).astype(np.int64), arrival_ns, accel[kept], gyro[kept])


def check_samples(t_s: Floats, accel: Floats, gyro: Floats) -> None:
    """Raise EchostepError, with the factor, where a file would be refused. Less than FEWEST_SAMPLES of t_s, accel and gyro may have no rest."""
    if len(t_s) < FEWEST_SAMPLES or np.shape(accel) != (len(t_s), 3) or np.shape(gyro) != (len(t_s), 3):
        return
    rows = np.column_stack([t_s, accel, gyro])
    rows = rows[np.isfinite(rows[:, TIME]) & (np.abs(rows[:, FORCE.start :]) < OF_NO_UNIT).all(axis=1)]
    if len(rows) and (wrong := time_complaint(rows[:, TIME], "a foot") or unit_complaint(rows)):
        raise EchostepError(f"samples: {wrong}")


def time_complaint(t_s: Floats, what: str) -> str:
    """Message for the times (n,) of `what` that go back, repeat, or have another unit."""
    steps = np.diff(t_s)
    back = float((steps < 0).mean()) if len(steps) else 0.0
    if back > BACK_SHARE:
        return f"t_s goes back in {100 * back:.0f} % of the rows, even when sorted: are several recordings mixed?"
    forward = steps[steps > 0]
    if not len(forward):
        return "t_s does not advance"
    if (steps == 0.0).mean() > REPEATED_SHARE:
        return f"t_s repeats itself in {100 * (steps == 0.0).mean():.0f} % of the rows: are several recordings mixed?"
    rate = 1.0 / float(np.median(forward))
    return rate_complaint(rate, RATE_RANGE_HZ, f"{what} needs 50 at least", "average them down to 500 or fewer")


def unit_complaint(table: Floats) -> str:
    """Message for forces in g or without gravity, and for rates in deg/s."""
    rate = np.linalg.norm(table[:, RATE], axis=1)
    calm = rate <= np.quantile(rate, CALMEST_SHARE)  # over all samples of a run the median is far above gravity
    force = float(np.median(np.linalg.norm(table[calm, FORCE], axis=1)))
    if G_RANGE[0] <= force <= G_RANGE[1]:
        return f"ax, ay, az look like g (at rest they are {force:.2f}): multiply them by 9.80665, or say --units g"
    if not GRAVITY_RANGE_M_S2[0] <= force <= GRAVITY_RANGE_M_S2[1]:
        return f"ax, ay, az are {force:.3g} at rest, gravity is 9.8 m/s2: wrong unit, or gravity was removed"
    fastest = float(np.quantile(np.abs(table[:, RATE]), FASTEST_QUANTILE))
    if fastest > FASTEST_FOOT_RAD_S:
        return f"gx, gy, gz reach {fastest:.0f}, no foot turns so fast in rad/s: in deg/s? multiply them by pi/180, or say --units deg/s"
    return ""


def rate_complaint(rate: float, range_hz: tuple[float, float], too_slow: str, too_fast: str) -> str:
    """Message for a sample rate (Hz) outside the range, with the likely unit of t_s or else the given advice; empty inside."""
    unit, option, factor = unit_of_times(rate, range_hz)
    if option == "s":
        return ""
    if option:
        return f"t_s gives {rate:.3g} samples a second: is it in {unit}? divide it by {factor:.0f} to have seconds, or say --units {option}"
    for unit, _, factor in TIME_UNITS:
        if range_hz[0] <= rate / factor <= range_hz[1]:
            return f"t_s gives {rate:.3g} samples a second: are these seconds, not {unit}? multiply it by {factor:.0f}, or say --units s"
    return f"t_s gives {rate:.3g} samples a second: is it in seconds? {too_slow if rate < range_hz[0] else too_fast}"


def unit_of_times(rate: float, range_hz: tuple[float, float]) -> tuple[str, str, float]:
    """Name, option and number in a second of the unit in which times of this rate (Hz, if they were seconds) are in the range; "" for none."""
    return next((unit for unit in TIME_UNITS if range_hz[0] <= rate * unit[2] <= range_hz[1]), ("", "", 0.0))
