# SPDX-License-Identifier: MIT
"""Angle that a gyro omits at a soft limit: its reading bends off from the rate and stays almost, but never exactly, equal.

In: the latest samples, the greatest rate of each axis so far. Out: corrections of the navigation state. The caller owns both.

A swinging foot has a smooth rate. Its peaks are round: where the rate is flat, it was not steep 15 ms before. A plateau with steep flanks on
both sides, at the greatest rate that the axis ever had, is a sensor at its limit. The rate above it is taken as the curve that continues both
flanks, a cubic with their slopes at its ends. So the correction comes 15 ms after the plateau; the velocity of that time is turned with it.
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
LONGEST_STEP_S = 0.03  # between two samples of a plateau
UNSURE = 2.0  # sd of the angle, as a share of it: a heel strike has several peaks, and the flanks show one


@lean_part
def restore(nav: Nav, window: SampleWindow, period_s: float, peak: Floats) -> int:
    """Correct attitude and velocity for the plateaus that ended FLANK_S ago; returns the number of their samples. Updates `peak` (3,) rad/s."""
    newest = window.added[0] - 1
    step = max(1, round(STEP_S / max(period_s, 1e-4)))  # samples
    after = max(2, round(FLANK_S / max(period_s, 1e-4)))
    count = 0
    for i in range(3):
        peak[i] = max(peak[i], abs(window.gyro[newest % RING, i]))
        long_enough = 2 * (after + step) + FEWEST < min(newest, RING - 1)
        if long_enough and _flat(window, i, after, step) and not _flat(window, i, after - 1, step):
            count += _restore_axis(nav, window, i, after, step, peak[i])
    return count


@lean_part
def _flat(window: SampleWindow, axis: int, back: int, step: int) -> bool:
    """Whether the rate is high and flat from the sample `back` + `step` before the newest to the one `back` before it."""
    newest = window.added[0] - 1
    now, before = (newest - back) % RING, (newest - back - step) % RING
    rate = min(abs(window.gyro[now, axis]), abs(window.gyro[before, axis]))
    dt = window.t_s[now] - window.t_s[before]
    change = abs(window.gyro[now, axis] - window.gyro[before, axis])
    return 0.0 < dt < LONGEST_STEP_S and rate > HIGH_RAD_S and change < FLAT_PER_S * rate * dt


@lean_part
def _restore_axis(nav: Nav, window: SampleWindow, axis: int, end: int, step: int, peak: float) -> int:
    """Correct for the plateau of an axis whose last sample is `end` before the newest; returns its number of samples, 0 if it is no plateau."""
    newest = window.added[0] - 1
    begin, height = end, abs(window.gyro[(newest - end) % RING, axis])
    last = min(newest, RING - 1) - end - step
    while begin < last and _flat(window, axis, begin, step):
        begin += 1
        height = max(height, abs(window.gyro[(newest - begin) % RING, axis]))
    flat_s = window.t_s[(newest - end) % RING] - window.t_s[(newest - begin) % RING]
    is_plateau = begin < last and begin - end >= FEWEST and flat_s >= SHORTEST_S and height >= NEAR * peak
    begin += step - 1
    span_s = window.t_s[(newest - end) % RING] - window.t_s[(newest - begin) % RING]
    if not is_plateau:
        return 0
    sign = 1.0 if window.gyro[(newest - begin) % RING, axis] > 0.0 else -1.0
    rises, falls = 0.0, 0.0
    for k in range(end - step + 1):
        rises = max(rises, sign * _slope(window, axis, begin + k, step))
        falls = max(falls, -sign * _slope(window, axis, k, step))
    if min(rises, falls) < STEEP * FLAT_PER_S * height:
        return 0
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
        x, y, z = (
            x + weight * window.accel[slot, 0],
            y + weight * window.accel[slot, 1],
            z + weight * window.accel[slot, 2],
        )
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
            nav.P[_component(i), _component(j)] += UNSURE**2 * lost[i] * lost[j]
        nav.P[YAW, _component(i)] += UNSURE**2 * z * lost[i]
        nav.P[_component(i), YAW] += UNSURE**2 * z * lost[i]
    nav.P[YAW, YAW] += UNSURE**2 * z * z


@lean_part
def _component(k: int) -> int:
    """The error state of velocity 0 to 2, attitude 3 to 5."""
    return VEL + k if k < 3 else TILT + k - 3
