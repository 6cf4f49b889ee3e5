# SPDX-License-Identifier: MIT
"""Angle that a gyro omits at a soft limit: its reading bends off from the rate and stays almost, but never exactly, equal.

In: the latest samples, the greatest rate of each axis so far. Out: corrections of the navigation state. The caller owns both.

A swinging foot has a smooth rate. Its peaks are round: where the rate is flat, it was not steep 15 ms before. A plateau with steep flanks on
both sides, at the greatest rate that the axis ever had, is a sensor at its limit; one at the value of the last plateau may be rounder. The rate
above is taken as a cubic that continues both flanks by their slopes. The correction comes 15 ms later; the velocity of that time is turned with it.
"""

from __future__ import annotations

from echostep.arrays import Floats
from echostep.foot import ins
from echostep.foot.ins import TILT, VEL, YAW, Nav, Vector
from echostep.foot.stance import RING, SampleWindow
from echostep.jit import lean_part

# Assumed; no figure changes for the recordings of `evaluate feet` whose gyros have a wider range.
HIGH_RAD_S = 4.0  # no gyro for feet has a lower limit
FLAT_PER_S = 2.0  # greatest change of a flat rate, as a share of it per second: 1 % in 5 ms
STEP_S = 0.005  # over which the change of a rate is measured, so that noise at high sample rates does not count
FEWEST, SHORTEST_S = 2, 0.009  # steps of a plateau between samples, and its duration
FLANK_S = 0.015  # on either side of a plateau
STEEP = 3.0  # least slope of a flank, in units of the greatest slope of a flat rate
NEAR = 0.94  # least height of a plateau, as a share of the greatest rate of the axis so far
SAME = 0.01  # greatest deviation of a rate from the last plateau of its axis, as a share of it, at which FLAT_AT_LIMIT_PER_S counts
FLAT_AT_LIMIT_PER_S = 3.0  # instead of FLAT_PER_S: a limit is known by its value, which a sensor reaches again
LONGEST_STEP_S = 0.03  # between two samples of a plateau
UNSURE = 2.0  # sd of the angle, as a share of it: a heel strike has several peaks, and the flanks show one
TURNED = (VEL, VEL + 1, VEL + 2, TILT, TILT + 1, TILT + 2)  # error states of velocity and attitude


@lean_part
def restore(nav: Nav, window: SampleWindow, period_s: float, peak: Floats, plateau: Floats) -> int:
    """Correct attitude and velocity for the plateaus that ended FLANK_S ago; returns their samples. Updates `peak`, `plateau` (3,) rad/s."""
    newest = window.added[0] - 1
    step = max(1, round(STEP_S / max(period_s, 1e-4)))  # samples
    after = max(2, round(FLANK_S / max(period_s, 1e-4)))
    count = 0
    for i in range(3):
        peak[i] = max(peak[i], abs(window.gyro[newest % RING, i]))
        long_enough = 2 * (after + step) + FEWEST < min(newest, RING - 1)
        limit = plateau[i]
        if long_enough and _flat(window, i, after, step, limit) and not _flat(window, i, after - 1, step, limit):
            count += _restore_axis(nav, window, i, after, step, peak[i], plateau)
    return count


@lean_part
def _flat(window: SampleWindow, axis: int, back: int, step: int, limit: float) -> bool:
    """Whether the rate is high and flat from the sample `back` + `step` before the newest to the one `back` before it."""
    newest = window.added[0] - 1
    now, before = (newest - back) % RING, (newest - back - step) % RING
    rate = min(abs(window.gyro[now, axis]), abs(window.gyro[before, axis]))
    most = rate * (FLAT_AT_LIMIT_PER_S if abs(rate - limit) < SAME * limit else FLAT_PER_S)
    is_step = 0.0 < window.t_s[now] - window.t_s[before] < LONGEST_STEP_S
    return is_step and rate > HIGH_RAD_S and abs(_slope(window, axis, back, step)) < most


@lean_part
def _restore_axis(nav: Nav, window: SampleWindow, axis: int, end: int, step: int, peak: float, plateau: Floats) -> int:
    """Correct for the plateau of an axis whose last sample is `end` before the newest; returns its number of samples, 0 if it is no plateau."""
    newest = window.added[0] - 1
    begin, height = end, abs(window.gyro[(newest - end) % RING, axis])
    last = min(newest, RING - 1) - end - step
    while begin < last and _flat(window, axis, begin, step, plateau[axis]):
        begin += 1
        height = max(height, abs(window.gyro[(newest - begin) % RING, axis]))
    flat_s = window.t_s[(newest - end) % RING] - window.t_s[(newest - begin) % RING]
    is_plateau = begin < last and begin - end >= FEWEST and flat_s >= SHORTEST_S and height >= NEAR * peak
    if not is_plateau:
        return 0
    begin += step - 1
    span_s = window.t_s[(newest - end) % RING] - window.t_s[(newest - begin) % RING]
    sign = 1.0 if window.gyro[(newest - begin) % RING, axis] > 0.0 else -1.0
    rises, falls = 0.0, 0.0
    for k in range(end - step + 1):
        rises = max(rises, sign * _slope(window, axis, begin + k, step))
        falls = max(falls, -sign * _slope(window, axis, k, step))
    if min(rises, falls) < STEEP * FLAT_PER_S * height:
        return 0
    plateau[axis] = height
    _turn(nav, axis, sign * span_s**2 * (rises + falls) / 12.0, _impulse(nav, window, begin, end))
    return begin - end + 1


@lean_part
def _slope(window: SampleWindow, axis: int, back: int, step: int) -> float:
    """Slope of the rate (rad/s2) from the sample `back` + `step` before the newest to the one `back` before it."""
    newest = window.added[0] - 1
    now, before = (newest - back) % RING, (newest - back - step) % RING
    change: float = window.gyro[now, axis] - window.gyro[before, axis]
    return change / max(window.t_s[now] - window.t_s[before], 1e-4)


@lean_part
def _impulse(nav: Nav, window: SampleWindow, begin: int, end: int) -> Vector:
    """Integral (3,) of the specific force (walk frame) since the plateau began, weighted by the share of the angle omitted until then."""
    newest = window.added[0] - 1
    x, y, z = 0.0, 0.0, 0.0
    for back in range(begin):
        slot = (newest - back) % RING
        share = 1.0 if back <= end else (begin - back) / (begin - end)
        weight = share * (window.t_s[slot] - window.t_s[(slot - 1) % RING])
        x += weight * window.accel[slot, 0]
        y += weight * window.accel[slot, 1]
        z += weight * window.accel[slot, 2]
    return ins.apply(ins.rotation(nav.attitude), (x, y, z))


@lean_part
def _turn(nav: Nav, axis: int, angle: float, impulse: Vector) -> None:
    """Turn the attitude by an angle (rad) about an axis of the sensor, and the velocity gained since; the covariance grows by both together."""
    r = ins.rotation(nav.attitude)
    x, y, z = angle * r[0][axis], angle * r[1][axis], angle * r[2][axis]
    lost = (y * impulse[2] - z * impulse[1], z * impulse[0] - x * impulse[2], x * impulse[1] - y * impulse[0], x, y, z)
    for i in range(3):
        nav.velocity[i] += lost[i]
    ins.turn_by(nav, (x, y, z))
    for i in range(6):
        for j in range(6):
            nav.P[TURNED[i], TURNED[j]] += UNSURE**2 * lost[i] * lost[j]
        nav.P[YAW, TURNED[i]] += UNSURE**2 * z * lost[i]
        nav.P[TURNED[i], YAW] += UNSURE**2 * z * lost[i]
    nav.P[YAW, YAW] += UNSURE**2 * z * z
