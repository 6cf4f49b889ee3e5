# SPDX-License-Identifier: MIT
"""Stance detection, and the zero-velocity and zero-angular-rate updates of a standing foot.

In: the latest samples and the navigation state. Out: test statistics, and corrections of that state. The caller owns `SampleWindow` and `ZaruSums`.

Two tests decide a stance, so one setting serves walking, running, stairs and shuffling at any rate. The first uses the sensors alone: the SHOE
statistic [Skog et al. 2010] in physical units, with a loose threshold, because a runner's foot is never still. The second is a gate on the
normalized innovation of the filter, whose velocity is good to a few cm/s at the end of a swing; in mid swing, at metres a second, it fails.
A standing foot rolls about its contact with the floor. The sensor then moves with angular rate times its height, and the error of the lever arm
grows with the rate. So the update gives a calm mid-stance much weight and a heel rise little, and strides do not come out short.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.foot import ins
from echostep.foot.ins import GYRO_BIAS, TILT, VEL, Nav, Vector
from echostep.jit import lean_kernel, lean_part

UP = 2  # of the walk frame's axes
RING = 64  # samples: 0.12 s at the highest rate, for the plateaus of `soft_limit`
WINDOW_S = 0.03
REST_RAD_S, REST_M_S2 = 1.6, 6.0  # rms over the window: `stillness_statistic` is 1 on the ellipse between them
# A faster swing is followed by a less quiet stance, in proportion. Walking peaks at 5 to 8 rad/s; running beyond 10, with 2 rad/s in its stances.
CALM_SWING_RAD_S = 8.0
CALM, STILL = 0.25, 0.03  # `stillness_statistic` of a standing foot, and of a foot at rest
GATE = 16.8  # chi-square with six degrees of freedom (three velocities, three accelerations), 99 % quantile
ROLL_M_S2 = 2.0  # acceleration of a sensor on a foot that rolls
MOST_EXCESS = 1e3
UNKNOWN_YAW_RAD2 = math.pi**2 / 3.0  # variance of any yaw alike
# Difference between a resting foot's force and gravity, with the bias of a sensor; a shuffling foot shows 1 to 4
GRAVITY_ALONE_M_S2 = 1.0
# Greatest change of that force while a foot rests, twice the above; a foot that glides brakes at 4 to 6 m/s2
STEADY_M_S2 = 2.0
# Limits for a foot that stands on an accelerating floor: a lift accelerates at up to 1.2 m/s2, and a standing person shifts.
RIDING_RAD_S, RIDING_M_S2 = 0.15, 2.0
LASTING_S = 0.15  # no swing is calm for this long: the stance is accepted, the velocity is corrected
OVERDUE_S = 2.0  # no swing lasts this long
PART_S, PARTS = 0.1, 5  # gyro bias: a rest is averaged in parts of this duration, this many for an update
SWAY_S = 0.3  # correlation time of a standing person's sway
BIAS_FLOOR_RAD_S = 1e-3
BIAS_GATE = 16.0  # chi-square of one rate, four sigma
# Share of the innovation added to the bias' sd from the second rejection in a row on, so that the third measurement passes the gate.
# A first rejection alone is a foot that starts to move.
BIAS_INFLATION = 0.3


class SampleWindow(NamedTuple):
    """The latest samples in a ring: `t_s` (RING,), `accel` and `gyro` (RING, 3); `added` (1,) samples put in so far."""

    t_s: Floats
    accel: Floats
    gyro: Floats
    added: Ints


class ZaruSums(NamedTuple):
    """Integrals of the angular rate over the present rest, for the zero-angular-rate update (ZARU).

    `part` (3,) rad over `part_s` (1,): the part under way. `whole` (3,) rad over `whole_s` (1,), `squares` (1,) rad2/s: the complete parts.
    `rejected` (3,): rejections in a row per axis; kept from rest to rest.
    """

    part: Floats
    part_s: Floats
    whole: Floats
    squares: Floats
    whole_s: Floats
    rejected: Floats


def new_window() -> SampleWindow:
    """An empty window."""
    return SampleWindow(np.zeros(RING), np.zeros((RING, 3)), np.zeros((RING, 3)), np.zeros(1, np.int64))


def new_zaru_sums() -> ZaruSums:
    """Sums of an empty rest."""
    return ZaruSums(np.zeros(3), np.zeros(1), np.zeros(3), np.zeros(1), np.zeros(1), np.zeros(3))


@lean_kernel
def add_sample(window: SampleWindow, t_s: float, accel: Floats, gyro: Floats) -> None:
    """Write a sample into the ring."""
    slot = window.added[0] % RING
    window.t_s[slot] = t_s
    for i in range(3):
        window.accel[slot, i], window.gyro[slot, i] = accel[i], gyro[i]
    window.added[0] += 1


@lean_part
def mean_force(window: SampleWindow) -> Vector:
    """Mean specific force (3,) over the window."""
    newest, n = window.added[0] - 1, _length(window)
    x, y, z = 0.0, 0.0, 0.0
    for k in range(n):
        slot = (newest - k) % RING
        x, y, z = x + window.accel[slot, 0], y + window.accel[slot, 1], z + window.accel[slot, 2]
    return x / n, y / n, z / n


@lean_part
def feels_gravity_alone(window: SampleWindow) -> bool:
    """Whether the mean specific force is as large as gravity, whatever the level: `activity` hardly shows a smooth acceleration."""
    force = mean_force(window)
    return abs(math.sqrt(ins.dot(force, force)) - ins.GRAVITY_M_S2) < GRAVITY_ALONE_M_S2


@lean_part
def _length(window: SampleWindow) -> int:
    """Number of samples within WINDOW_S before the newest."""
    newest = window.added[0] - 1
    begin = window.t_s[newest % RING] - WINDOW_S - 1e-6
    n = 1
    while n < min(newest + 1, RING) and window.t_s[(newest - n) % RING] >= begin:
        n += 1
    return n


@lean_part
def activity(window: SampleWindow, bias: Floats) -> tuple[float, float]:
    """Mean squares over the window: angular rate (rad/s)2; specific force less gravity along its mean (m/s2)2 [Skog et al. 2010, eq. 12]."""
    newest, n = window.added[0] - 1, _length(window)
    mean = mean_force(window)
    scale = ins.GRAVITY_M_S2 / max(math.sqrt(ins.dot(mean, mean)), 1e-9)
    rate2, force2 = 0.0, 0.0
    for k in range(n):
        slot = (newest - k) % RING
        for i in range(3):
            rate2 += (window.gyro[slot, i] - bias[i]) ** 2
            force2 += (window.accel[slot, i] - scale * mean[i]) ** 2
    return rate2 / n, force2 / n


@lean_part
def stillness_statistic(rate2: float, force2: float) -> float:
    """The SHOE statistic of `activity`; a stance needs a value below 1."""
    return rate2 / REST_RAD_S**2 + force2 / REST_M_S2**2


@lean_kernel
def most_activity(swing_rad_s: float) -> float:
    """Greatest `stillness_statistic` of a stance after a swing with this peak rate."""
    return max(1.0, swing_rad_s / CALM_SWING_RAD_S) ** 2


@lean_kernel
def standing_velocity(nav: Nav, window: SampleWindow, height_m: float) -> Vector:
    """Velocity (3,) that a sensor at `height_m` above the contact has now if its foot rolled without sliding in the middle of the window.

    Rate x height at that sample, plus the velocity change from the accelerometer since: at the end of the window the heel may already rise.
    """
    newest, middle = window.added[0] - 1, _length(window) // 2
    r = ins.rotation(nav.attitude)
    rate = ins.apply(r, ins.difference(window.gyro[(newest - middle) % RING], nav.gyro_bias))
    x, y, z = rate[1] * height_m, -rate[0] * height_m, 0.0
    for k in range(middle):
        slot = (newest - k) % RING
        dt = window.t_s[slot] - window.t_s[(slot - 1) % RING]
        f = ins.apply(r, ins.difference(window.accel[slot], nav.accel_bias))
        x, y, z = x + dt * f[0], y + dt * f[1], z + dt * (f[2] - ins.GRAVITY_M_S2)
    return x, y, z


@lean_part
def normalized_innovation(nav: Nav, expected: Vector, variance: float, force: Vector) -> tuple[float, float]:
    """Chi-square of the innovations of velocity (from `expected`) and acceleration (from 0), given the mean specific force (3,).

    Two parts: of the two level axes, and of the vertical axis.
    """
    f = ins.apply(ins.rotation(nav.attitude), ins.difference(force, nav.accel_bias))
    accel = (f[0], f[1], f[2] - ins.GRAVITY_M_S2)
    lean = ins.GRAVITY_M_S2**2 * (nav.P[TILT, TILT] + nav.P[TILT + 1, TILT + 1])
    level, vertical = 0.0, 0.0
    for i in range(3):
        part = (nav.velocity[i] - expected[i]) ** 2 / (nav.P[VEL + i, VEL + i] + variance)
        part += accel[i] ** 2 / (ROLL_M_S2**2 + lean)
        if i == UP:
            vertical = part
        else:
            level += part
    return level, vertical


@lean_part
def rest_variance(nav: Nav, rate2: float) -> float:
    """Variance (m/s)2 of a standing foot's velocity about rate x height."""
    return nav.noise.rest_m_s**2 + nav.noise.lever_m**2 * rate2


@lean_part
def zero_velocity_update(nav: Nav, expected: Vector, variance: float, dt: float) -> None:
    """Zero-velocity update; its variance is scaled so that the information per second does not depend on the sample rate.

    The gyro bias keeps its value: the rolling and creeping of a foot repeats at each step, and would be taken for a bias.
    """
    repeated = max(1.0, nav.noise.kept_s / dt)  # samples with the same error
    for i in range(3):
        ins.update_but_gyro_bias(nav, VEL + i, expected[i] - nav.velocity[i], variance * repeated)


@lean_kernel
def inflate_covariance(nav: Nav, excess: float) -> None:
    """Multiply the covariance of all errors but the biases by `excess` (cross-covariances with the biases by its root).

    Applied when a stance is accepted although its normalized innovation exceeds the gate: the errors grew faster since the last rest than
    modelled. The correlations are kept, so position, velocity and attitude are corrected together. Nothing here measures the yaw: it has a limit.
    """
    most = math.sqrt(min(excess, MOST_EXCESS))
    yaw = min(most, math.sqrt(UNKNOWN_YAW_RAD2 / nav.P[ins.YAW, ins.YAW]))
    for i in range(ins.SIZE):
        for j in range(i + 1):
            factor = 0.5
            for k in (i, j):
                factor *= most if k < ins.GYRO_BIAS else yaw if k == ins.YAW else 1.0
            # By their mean: else what rounding has made uneven grows, too
            nav.P[i, j] = nav.P[j, i] = factor * (nav.P[i, j] + nav.P[j, i])


@lean_part
def may_ride(rate2: float, force2: float) -> bool:
    """Whether a foot with this `activity` may stand in a lift that starts or stops."""
    return rate2 < RIDING_RAD_S**2 and force2 < RIDING_M_S2**2


@lean_part
def follow_floor(nav: Nav, expected: Vector, variance: float) -> None:
    """The floor accelerates, and the foot with it: reset the vertical velocity, so that neither level nor biases are corrected by it."""
    ins.decouple(nav, VEL + UP, variance)
    nav.velocity[UP] = expected[UP]


@lean_part
def clear_rest(sums: ZaruSums) -> None:
    """Clear the sums: the foot moves, and an unfinished rest gives no update."""
    for i in range(3):
        sums.part[i] = sums.whole[i] = 0.0
    sums.part_s[0] = sums.whole_s[0] = sums.squares[0] = 0.0


@lean_part
def zero_angular_rate_update(nav: Nav, sums: ZaruSums, dt: float, gyro0: Floats, gyro1: Floats) -> bool:
    """Zero-angular-rate update of the gyro bias after each half second of rest; returns whether there was one.

    `gyro0`, `gyro1` (3,): rates at the beginning and the end of `dt`.
    """
    for i in range(3):
        sums.part[i] += 0.5 * dt * (gyro0[i] + gyro1[i])
    sums.part_s[0] += dt
    if sums.part_s[0] < PART_S - 1e-6:
        return False
    for i in range(3):
        sums.whole[i] += sums.part[i]
        sums.squares[0] += sums.part[i] ** 2 / sums.part_s[0]
        sums.part[i] = 0.0
    sums.whole_s[0] += sums.part_s[0]
    sums.part_s[0] = 0.0
    if sums.whole_s[0] < PARTS * PART_S - 1e-6:
        return False
    span_s: float = sums.whole_s[0]
    mean = (sums.whole[0] / span_s, sums.whole[1] / span_s, sums.whole[2] / span_s)
    _update_bias(nav, sums, mean, _bias_variance(sums, mean))
    clear_rest(sums)
    return True


@lean_part
def _bias_variance(sums: ZaruSums, mean: Vector) -> float:
    """Variance of the mean rate (3,) from its scatter over the parts of this rest, which contains sensor noise and sway."""
    span_s: float = sums.whole_s[0]
    scatter: float = sums.squares[0] / span_s - ins.dot(mean, mean)
    return BIAS_FLOOR_RAD_S**2 + max(scatter, 0.0) / 3.0 * PARTS / (PARTS - 1) * SWAY_S / span_s


@lean_part
def _update_bias(nav: Nav, sums: ZaruSums, mean: Vector, variance: float) -> None:
    """Bias update per axis with a gate against slow turns; repeated rejections inflate the bias' covariance."""
    for i in range(3):
        error = mean[i] - nav.gyro_bias[i]
        if error * error < BIAS_GATE * (nav.P[GYRO_BIAS + i, GYRO_BIAS + i] + variance):
            ins.update(nav, GYRO_BIAS + i, error, variance)
            sums.rejected[i] = 0.0
        else:
            sums.rejected[i] += 1.0
            if sums.rejected[i] > 1.0:
                nav.P[GYRO_BIAS + i, GYRO_BIAS + i] += (BIAS_INFLATION * error) ** 2
