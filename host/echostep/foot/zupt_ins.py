"""The foot's kernel: each sample through filter and stance detector, and the steps and stances that come of it.

In: samples, and the states of `ins` and `stance`. Out: rows that `foot` turns into events. Owns the `Footing`.

Until the foot has been still for a moment there is no level and no navigation; the same holds after samples were missing for too long.
Position and yaw errors count from the last stance, so that every step comes with its own covariance; floors are taken as level.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from echostep.arrays import Floats
from echostep.foot import ins, mounting, stance
from echostep.foot import magnetometer as magnetic
from echostep.foot.ins import POS, TILT, VEL, YAW, Nav
from echostep.foot.magnetometer import Magnetometer
from echostep.foot.stance import Rest, Window
from echostep.jit import lean_kernel

CONFIRM_S = 0.03  # a stance is told after so much rest
SETTLE_S = 0.2  # by then it has corrected the step before it
LEAVE_S = 0.15  # and it is over after so long without rest: no swing is shorter
PERIOD_GAIN = 0.003  # a sample
GAP_S = 0.25  # the filter carries on over shorter gaps
STRAY_SAMPLES = 20  # so many samples in a row from the past: the clock has been set back
WALK_M_S = 1.5  # a foot that nobody watches moves no faster, on the whole
MAX_ACCEL_M_S2, MAX_RATE_RAD_S = 1e3, 1e2  # beyond any foot
STEEP_M_S2, STEEP_RAD_S = 15.0, 4.0  # equal readings beyond these are a sensor at its limit, not a coincidence
LOST_SHARE = 0.3  # of such a reading may be missing
LEVEL_S = 0.1  # still for long enough to take gravity from
IMPATIENT_S = 3.0  # without such a moment, the next one at which the foot may rest at all has to do
STILL_TILT_RAD, UNSURE_TILT_RAD = 0.05, 0.3
UNSURE_YAW_RAD2_S = 1.0
DOUBT_S = 0.1  # of rests that the filter could not believe: its level is wrong
ACCEL_BIAS_M_S2, GYRO_BIAS_RAD_S = 0.3, 0.005
FLAT_M = 0.04  # floors are level: a step that rises less is no stair, kerb or ramp

STEP, STANCE = 0.0, 1.0
EVENT_SIZE = 18  # kind, start, end, move (3), covariance (9), heading, heading sd, toe
EVENTS_PER_SAMPLE = 2
ROW_SIZE = 6  # position (3), heading, in stance, events so far


class Footing(Protocol):
    """What is known of the foot besides its navigation: the last sample, the level, the present rest, the last step, the counts."""

    t_s: float
    period_s: float  # between samples, as a rule
    force: Floats
    rate: Floats
    levelled: int
    yaw_rad: float  # to level with
    waited_s: float  # for a level
    still_s: float
    lasting_s: float
    doubt_s: float  # at rest against the filter's belief
    force_sum: Floats
    force_count: int
    lost_s: float  # since samples were missing
    force_limit_s: Floats  # how long each axis has read its limit
    rate_limit_s: Floats
    rest_s: float
    rest_end_s: float
    rest_yaw_rad: float
    in_stance: int
    settled: int
    stood: Floats  # tilt of the foot when it stood last
    tilt_square: Floats  # of the swings, see `mounting`
    tilt_cube: Floats
    began_s: float  # the stance
    left_s: float  # the stance before
    under_way: int  # there was a stance before
    origin: Floats  # position at the last step told
    yaw_variance: float  # at the last step told
    stray: int
    samples: int
    impossible: int
    not_later: int
    saturated: int
    gaps: int
    forced: int


_NUMPY = {"float": ("f8",), "int": ("i8",), "Floats": ("f8", 3)}
FOOTING = np.dtype([(name, *_NUMPY[kind]) for name, kind in Footing.__annotations__.items()])


@lean_kernel
def walk(
    s: Footing, nav: Nav, window: Window, rest: Rest, compass: Magnetometer, height_m: float,
    t_s: Floats, accel: Floats, gyro: Floats, mag: Floats, events: Floats, rows: Floats,
) -> int:  # fmt: skip
    """Take samples t_s (n,), accel and gyro (n, 3), mag (n, 3) or (0, 3) in turn.

    Fills `events` (2n, EVENT_SIZE), and `rows` (n, ROW_SIZE) unless it is empty. Returns the number of events.
    """
    found = 0
    for k in range(len(t_s)):
        if _usable(s, t_s[k], accel[k], gyro[k]):
            dt = t_s[k] - s.t_s if s.samples > 1 else 0.0
            if s.samples > 1 and not 0.0 < dt <= GAP_S:
                found = _lose(s, nav, rest, compass, dt, events, found)
                dt = 0.0
            _time(s, dt)
            stance.put(window, t_s[k], accel[k], gyro[k])
            if s.levelled:
                found = _navigate(s, nav, window, rest, compass, height_m, dt, t_s[k], accel[k], gyro[k], events, found)
                if len(mag) and s.rest_s > 0.0:
                    magnetic.gather(compass, nav, mag[k])
            else:
                found = _find_level(s, nav, window, dt, t_s[k], events, found)
            s.t_s = t_s[k]
            for i in range(3):
                s.force[i], s.rate[i] = accel[k, i], gyro[k, i]
        if len(rows):
            rows[k, 0], rows[k, 1], rows[k, 2] = nav.position[0], nav.position[1], nav.position[2]
            rows[k, 3] = ins.heading(nav)
            rows[k, 4] = s.in_stance
            rows[k, 5] = found
    return found


@lean_kernel
def _usable(s: Footing, t_s: float, accel: Floats, gyro: Floats) -> bool:
    """Whether this is a sample: finite, possible, later than the last one; counts those that are not."""
    possible = math.isfinite(t_s)
    for i in range(3):
        possible = possible and abs(accel[i]) < MAX_ACCEL_M_S2 and abs(gyro[i]) < MAX_RATE_RAD_S  # false for NaN
    if not possible:
        s.impossible += 1
        return False
    if s.samples > 0 and t_s <= s.t_s:
        s.stray += 1
        if s.stray < STRAY_SAMPLES:
            s.not_later += 1
            return False
    s.stray = 0
    s.samples += 1
    return True


@lean_kernel
def _time(s: Footing, dt: float) -> None:
    """The period of the samples: a running median, so that missing ones do not count."""
    if s.period_s == 0.0:
        s.period_s = dt
    elif dt > 0.0:
        s.period_s *= 1.0 + PERIOD_GAIN if dt > s.period_s else 1.0 - PERIOD_GAIN


@lean_kernel
def _lose(s: Footing, nav: Nav, rest: Rest, compass: Magnetometer, dt: float, events: Floats, found: int) -> int:
    """Samples are missing, or the clock or the level is wrong: the stance is over, and what the foot does until the next level unknown."""
    s.gaps += 1
    span_s = min(max(dt, GAP_S), 3600.0)
    s.lost_s += span_s
    nav.P[YAW, YAW] = min(nav.P[YAW, YAW] + UNSURE_YAW_RAD2_S * span_s, math.pi**2 / 3.0)
    if s.in_stance:
        found = _leave(s, nav, compass, events, found)
    if s.levelled:
        s.yaw_rad = ins.heading(nav)
    stance.end_rest(rest)
    s.levelled = 0
    s.still_s = s.lasting_s = s.doubt_s = s.waited_s = s.rest_s = 0.0
    return found


@lean_kernel
def _find_level(s: Footing, nav: Nav, window: Window, dt: float, t_s: float, events: Floats, found: int) -> int:
    """Wait for a still moment to take the level from; after a while, start without."""
    unrest = stance.unrest(*stance.activity(window, nav.gyro_bias))
    s.waited_s += dt
    s.still_s = s.still_s + dt if unrest < stance.STILL else 0.0
    force = stance.mean_force(window)
    if s.still_s == 0.0:
        s.force_count = 0
    for i in range(3):
        s.force_sum[i] = s.force_sum[i] + force[i] if s.force_count else force[i]
    s.force_count += 1
    if s.still_s >= LEVEL_S - 1e-6:
        n, total = s.force_count, s.force_sum
        ins.set_level(nav, (total[0] / n, total[1] / n, total[2] / n), s.yaw_rad, True)
        _begin(s, nav, t_s, STILL_TILT_RAD, 0.02)
        found = _land(s, nav, t_s - s.still_s, events, found)
    elif s.waited_s >= IMPATIENT_S and unrest < 1.0:
        ins.set_level(nav, force, s.yaw_rad, False)
        _begin(s, nav, t_s, UNSURE_TILT_RAD, WALK_M_S)
        found = _land(s, nav, t_s, events, found)
    return found


@lean_kernel
def _begin(s: Footing, nav: Nav, t_s: float, tilt_sd_rad: float, velocity_sd_m_s: float) -> None:
    """Navigate from here on; whatever the foot did while nobody watched goes into the position's covariance."""
    ins.set_covariance(nav, tilt_sd_rad, velocity_sd_m_s, GYRO_BIAS_RAD_S, ACCEL_BIAS_M_S2)
    lost_s = s.lost_s + s.waited_s if s.lost_s > 0.0 else 0.0
    for i in range(3):
        nav.P[POS + i, POS + i] = (WALK_M_S * lost_s) ** 2
    s.lost_s = 0.0
    s.levelled = 1
    s.rest_end_s = t_s


@lean_kernel
def _navigate(
    s: Footing, nav: Nav, window: Window, rest: Rest, compass: Magnetometer, height_m: float, dt: float, t_s: float, accel: Floats, gyro: Floats,
    events: Floats, found: int,
) -> int:  # fmt: skip
    """One sample of navigation: predict, decide whether the foot rests, correct, tell."""
    ins.predict(nav, dt, s.period_s, s.force, accel, s.rate, gyro)
    _doubt_limits(s, nav, dt, accel, gyro)
    if not _rests(s, nav, window, height_m, dt, t_s, gyro):
        stance.end_rest(rest)
        s.rest_s = 0.0
        if not s.in_stance:
            mounting.watch(s.tilt_square, s.tilt_cube, ins.difference(mounting.tilt(nav), s.stood), dt)
        if s.in_stance and t_s - s.rest_end_s >= LEAVE_S - 1e-6:
            found = _leave(s, nav, compass, events, found)
        return found
    if s.doubt_s > DOUBT_S:
        return _lose(s, nav, rest, compass, dt, events, found)
    s.rest_s += dt
    s.rest_end_s = t_s
    s.rest_yaw_rad = ins.heading(nav)
    if stance.learn_bias(nav, rest, dt, s.rate, gyro) or (not s.settled and s.rest_s >= SETTLE_S):
        _settle(s, nav)
    if not s.in_stance and s.rest_s >= CONFIRM_S - 1e-6:
        rise_m = nav.position[2] - s.origin[2]
        if abs(rise_m) < FLAT_M:
            ins.observe(nav, POS + 2, -rise_m, nav.noise.flat_m**2)
        found = _land(s, nav, t_s - s.rest_s, events, found)
    return found


@lean_kernel
def _rests(s: Footing, nav: Nav, window: Window, height_m: float, dt: float, t_s: float, gyro: Floats) -> bool:
    """Whether the foot rests now; if so, the velocity has been corrected."""
    rate2, force2 = stance.activity(window, nav.gyro_bias)
    unrest = stance.unrest(rate2, force2)
    s.lasting_s = s.lasting_s + dt if unrest < stance.CALM else 0.0
    if unrest > 1.0:
        return False
    expected = stance.rolling(nav, gyro, height_m)
    variance = stance.rest_variance(nav, rate2)
    surprise = stance.surprise(nav, expected, variance, stance.mean_force(window))
    if surprise > stance.BELIEF:
        since_s = t_s - s.rest_end_s
        if s.lasting_s < stance.LASTING_S and since_s < stance.OVERDUE_S:
            return False
        s.forced += 1
        s.doubt_s += dt
        stance.distrust(nav, surprise / stance.BELIEF)
    else:
        s.doubt_s = 0.0
    stance.hold(nav, expected, variance + stance.haste_variance(force2), dt)
    return True


@lean_kernel
def _doubt_limits(s: Footing, nav: Nav, dt: float, accel: Floats, gyro: Floats) -> None:
    """A sensor at the end of its range reads the same again and again: how far beyond the truth lies stays unknown all that time."""
    for i in range(3):
        s.force_limit_s[i] = s.force_limit_s[i] + dt if accel[i] == s.force[i] and abs(accel[i]) > STEEP_M_S2 else 0.0
        s.rate_limit_s[i] = s.rate_limit_s[i] + dt if gyro[i] == s.rate[i] and abs(gyro[i]) > STEEP_RAD_S else 0.0
        force = _limit_variance(accel[i], s.force_limit_s[i], dt)
        rate = _limit_variance(gyro[i], s.rate_limit_s[i], dt)
        if force + rate > 0.0:
            s.saturated += 1
            r = ins.rotation(nav.attitude)
            axis = (r[0][i], r[1][i], r[2][i])
            for j in range(3):
                for k in range(3):
                    nav.P[VEL + j, VEL + k] += force * axis[j] * axis[k]
                    nav.P[TILT + j, TILT + k] += rate * axis[j] * axis[k]
            nav.P[YAW, YAW] += rate * axis[2] ** 2


@lean_kernel
def _limit_variance(value: float, span_s: float, dt: float) -> float:
    """Growth over `dt` of the variance of the integral of a reading at its limit since `span_s`, its error being the same all the time."""
    return (LOST_SHARE * value) ** 2 * (2.0 * span_s - dt) * dt if span_s > 0.0 else 0.0


@lean_kernel
def _land(s: Footing, nav: Nav, began_s: float, events: Floats, found: int) -> int:
    """A stance begins; the step that led to it is told, unless there was no stance before."""
    s.in_stance = 1
    s.settled = 0
    s.began_s = max(began_s, s.left_s) if s.under_way else began_s
    s.rest_yaw_rad = ins.heading(nav)
    s.stood[0], s.stood[1], s.stood[2] = mounting.tilt(nav)
    if s.under_way:
        _write_step(s, nav, events[found])
        found += 1
    s.under_way = 1
    s.origin[0], s.origin[1], s.origin[2] = nav.position[0], nav.position[1], nav.position[2]
    s.yaw_variance = nav.P[YAW, YAW]
    return found


@lean_kernel
def _write_step(s: Footing, nav: Nav, row: Floats) -> None:
    row[0], row[1], row[2] = STEP, s.left_s, s.began_s
    for i in range(3):
        row[3 + i] = nav.position[i] - s.origin[i]
        for j in range(3):
            row[6 + 3 * i + j] = nav.P[POS + i, POS + j]
    row[15] = s.rest_yaw_rad
    row[16] = math.sqrt(max(nav.P[YAW, YAW] - s.yaw_variance, 0.0))
    row[17] = mounting.toe(s.tilt_square, s.tilt_cube)
    for i in range(3):
        s.tilt_square[i] *= mounting.MEMORY
        s.tilt_cube[i] *= mounting.MEMORY


@lean_kernel
def _settle(s: Footing, nav: Nav) -> None:
    """The errors of the next step count from here."""
    s.settled = 1
    ins.forget_start(nav)


@lean_kernel
def _leave(s: Footing, nav: Nav, compass: Magnetometer, events: Floats, found: int) -> int:
    """The stance ended with its last rest."""
    row = events[found]
    row[0], row[1], row[2], row[15] = STANCE, s.began_s, max(s.rest_end_s, s.began_s), s.rest_yaw_rad
    s.left_s = row[2]
    s.in_stance = 0
    if not s.settled:
        _settle(s, nav)
    yaw = ins.heading(nav)
    turn = magnetic.correction(compass, nav, s.rest_yaw_rad)
    if turn != 0.0:
        ins.turn(nav, s.origin, turn - (ins.heading(nav) - yaw))
        s.rest_yaw_rad += turn
        s.yaw_variance = min(s.yaw_variance, nav.P[YAW, YAW])
    return found + 1
