# SPDX-License-Identifier: MIT
"""The inertial kernel: strapdown integration and its error-state Kalman filter.

In: specific force and angular rate of the foot. Out: position, velocity, attitude and their covariance, in a `Nav` that the caller owns.

Errors are true minus estimated, in the order of the constants below [Foxlin 2005; Nilsson et al. 2012]; attitude errors turn about the walk
frame's axes. `YAW` repeats the attitude's third error but is never reset: it keeps the growth of the heading's error known after the position and
yaw errors of earlier steps have been handed over with those steps.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.jit import lean_kernel, lean_part

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Matrix = tuple[Vector, Vector, Vector]  # of rows

GRAVITY_M_S2 = 9.81
POS, VEL, TILT, GYRO_BIAS, ACCEL_BIAS, YAW, SIZE = 0, 3, 6, 9, 12, 15, 16

MOTION_S = 0.1  # a foot keeps its motion for about this time, in which its scale and alignment errors repeat
MISSED_SHARE = 1.0  # of the change over a time without samples: an impact may fall between two samples
GYRO_CHANGE_SHARE = 0.01  # of the rate's change: a mean over the period keeps the angle, only its axis errs
ACCEL_WANDER = 1e-4  # m/s2 per root s
GYRO_WANDER = 1e-5  # rad/s per root s


class Noise(NamedTuple):
    """Error model of an MTx-class sensor on a shoe; one setting for all wearers, fitted by `evaluate feet --leave-one-out`."""

    accel: float = 0.03  # m/s2 per root Hz; a hundred times the data sheet's, for vibration
    gyro: float = 1e-3  # rad/s per root Hz
    accel_share: float = 0.005  # of the acceleration: scale and alignment errors of a calibrated sensor
    gyro_share: float = 0.01  # of the rate
    change_share: float = 0.1  # of the force's change between two samples is lost, as in an impact
    lever_m: float = 0.07  # sd of the lever arm from sensor to point of contact
    rest_m_s: float = 0.005  # sd of a resting foot's velocity
    kept_s: float = 0.1  # correlation time of that velocity error: samples within it carry no more information
    flat_m: float = 0.01  # sd of a level floor's height from step to step
    accel_bias: float = 0.3  # m/s2, sd of an axis when the foot is levelled
    gyro_bias: float = 0.005  # rad/s, the same
    offset: float = 0.0  # m/s2 by which the force at rest may differ from gravity without a doubt about its scale


class Nav(NamedTuple):
    """Navigation state: `position` m, `velocity` m/s (walk frame), `attitude` (4,) quaternion w x y z body -> walk, biases (body frame),
    `level` (3, 3) the levelled attitude of yaw zero, `P` (16, 16) covariance of the errors, `noise` their growth.
    """

    position: Floats
    velocity: Floats
    attitude: Floats
    gyro_bias: Floats
    accel_bias: Floats
    level: Floats
    P: Floats
    noise: Noise


def new_nav(noise: Noise) -> Nav:
    """State at the origin, at rest, not levelled yet."""
    attitude = np.array([1.0, 0.0, 0.0, 0.0])
    return Nav(np.zeros(3), np.zeros(3), attitude, np.zeros(3), np.zeros(3), np.eye(3), np.zeros((SIZE, SIZE)), noise)


@lean_kernel
def rotation(q: Floats | Quaternion) -> Matrix:
    """Rotation matrix of a unit quaternion."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    return (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )


@lean_part
def multiply(a: Floats | Quaternion, b: Floats | Quaternion) -> Quaternion:
    """Quaternion product a b, of unit length again."""
    w = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]
    x = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2]
    y = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1]
    z = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]
    size = math.sqrt(w * w + x * x + y * y + z * z)
    return w / size, x / size, y / size, z / size


@lean_part
def turning(x: float, y: float, z: float) -> Quaternion:
    """Quaternion of a rotation vector (rad)."""
    angle = math.sqrt(x * x + y * y + z * z)
    k = 0.5 if angle < 1e-9 else math.sin(0.5 * angle) / angle
    return math.cos(0.5 * angle), k * x, k * y, k * z


@lean_part
def dot(a: Floats | Vector, b: Floats | Vector) -> float:
    """Scalar product of two (3,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@lean_part
def apply(r: Matrix, v: Floats | Vector) -> Vector:
    """The product r v of a (3, 3) and a (3,)."""
    return dot(r[0], v), dot(r[1], v), dot(r[2], v)


@lean_part
def difference(a: Floats | Vector, b: Floats | Vector) -> Vector:
    """The difference a - b of two (3,)."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@lean_part
def _distance(a: Floats, b: Floats) -> float:
    """Distance between two (3,)."""
    d = difference(a, b)
    return math.sqrt(dot(d, d))


@lean_kernel
def heading(nav: Nav) -> float:
    """How far the foot has turned about the vertical since it was levelled with yaw zero (rad), whatever the mounting.

    The twist about z of the rotation from the levelled attitude to the present one.
    """
    r = rotation(nav.attitude)
    cosine, sine = 0.0, 0.0
    for k in range(3):
        cosine += r[0][k] * nav.level[0, k] + r[1][k] * nav.level[1, k]
        sine += r[1][k] * nav.level[0, k] - r[0][k] * nav.level[1, k]
    return math.atan2(sine, cosine)


@lean_part
def set_level(nav: Nav, force: Vector, yaw: float, at_rest: bool) -> None:
    """Attitude: roll and pitch from the direction of the mean specific force (3,), yaw as given. If `at_rest`, accelerometer bias from its norm."""
    size = max(math.sqrt(dot(force, force)), 1e-9)
    if at_rest:
        for i in range(3):
            nav.accel_bias[i] = force[i] * (1.0 - GRAVITY_M_S2 / size)
    roll = turning(math.atan2(force[1], force[2]), 0.0, 0.0)
    pitch = turning(0.0, math.asin(min(max(-force[0] / size, -1.0), 1.0)), 0.0)
    flat = multiply(pitch, roll)
    level = rotation(flat)
    for i in range(3):
        nav.level[i, 0], nav.level[i, 1], nav.level[i, 2] = level[i]
    _set_attitude(nav, multiply(turning(0.0, 0.0, yaw), flat))


@lean_part
def _set_attitude(nav: Nav, q: Quaternion) -> None:
    """Set the attitude."""
    nav.attitude[0], nav.attitude[1], nav.attitude[2], nav.attitude[3] = q


@lean_part
def turn_by(nav: Nav, rotation_vector: Vector) -> None:
    """Turn the attitude by a rotation vector (rad) in the walk frame."""
    _set_attitude(nav, multiply(turning(rotation_vector[0], rotation_vector[1], rotation_vector[2]), nav.attitude))


@lean_part
def set_covariance(nav: Nav, tilt_sd: float, velocity_sd: float, gyro_bias_sd: float, accel_bias_sd: float) -> None:
    """Covariance after levelling, velocity zero, from standard deviations; accelerometer bias and the tilt that it causes are correlated."""
    nav.velocity[:] = 0.0
    r = rotation(nav.attitude)
    P = nav.P
    yaw_variance = P[YAW, YAW]
    P[:] = 0.0
    P[YAW, YAW] = yaw_variance
    lean = accel_bias_sd**2 / GRAVITY_M_S2
    for i in range(3):
        P[VEL + i, VEL + i] = velocity_sd**2
        P[GYRO_BIAS + i, GYRO_BIAS + i] = gyro_bias_sd**2
        P[ACCEL_BIAS + i, ACCEL_BIAS + i] = accel_bias_sd**2
        P[TILT, ACCEL_BIAS + i] = P[ACCEL_BIAS + i, TILT] = -r[1][i] * lean
        P[TILT + 1, ACCEL_BIAS + i] = P[ACCEL_BIAS + i, TILT + 1] = r[0][i] * lean
    for i in range(2):
        P[TILT + i, TILT + i] = tilt_sd**2 + lean / GRAVITY_M_S2


@lean_kernel
def propagate(nav: Nav, dt: float, period: float, force0: Floats, force1: Floats, rate0: Floats, rate1: Floats) -> None:
    """Strapdown step over `dt` with the samples of specific force and rate (3,) at its beginning and its end.

    A sample is the mean over the `period` before it; the rest of `dt` is interpolated linearly between both. The change of rate and force from
    one sample to the next gives the coning and sculling corrections [Savage 1998, part 1 eq. 47, part 2 eq. 56].
    """
    seen = min(0.5 + 0.5 * period / dt, 1.0) if dt > 0.0 else 1.0
    rate = _mean(seen, rate0, rate1, nav.gyro_bias)
    force = _mean(seen, force0, force1, nav.accel_bias)
    half = turning(0.5 * dt * rate[0], 0.5 * dt * rate[1], 0.5 * dt * rate[2])
    r = rotation(multiply(nav.attitude, half))
    c = dt * dt / 12.0
    whole = turning(
        dt * rate[0] + c * (rate0[1] * rate1[2] - rate0[2] * rate1[1]),
        dt * rate[1] + c * (rate0[2] * rate1[0] - rate0[0] * rate1[2]),
        dt * rate[2] + c * (rate0[0] * rate1[1] - rate0[1] * rate1[0]),
    )
    _set_attitude(nav, multiply(nav.attitude, whole))
    f = apply(
        r,
        (
            force[0] + dt / 12.0 * _sculling(1, 2, force0, force1, rate0, rate1),
            force[1] + dt / 12.0 * _sculling(2, 0, force0, force1, rate0, rate1),
            force[2] + dt / 12.0 * _sculling(0, 1, force0, force1, rate0, rate1),
        ),
    )
    accel = (f[0], f[1], f[2] - GRAVITY_M_S2)
    for i in range(3):
        nav.position[i] += nav.velocity[i] * dt + 0.5 * accel[i] * dt * dt
        nav.velocity[i] += accel[i] * dt
    _propagate_errors(nav.P, f, r, dt)
    _propagate_errors(nav.P.T, f, r, dt)
    turn = apply(r, rate)
    hidden = 0.125 * dt * dt / MOTION_S  # a motion that begins and ends between two samples
    missed = MISSED_SHARE * (1.0 - seen)
    lost_m_s = (nav.noise.change_share + missed) * _distance(force1, force0) * dt + math.sqrt(
        dot(accel, accel)
    ) * hidden
    lost_rad = (GYRO_CHANGE_SHARE + missed) * _distance(rate1, rate0) * dt + math.sqrt(dot(turn, turn)) * hidden
    _add_noise(nav.P, nav.noise, dt, accel, turn, lost_m_s, lost_rad)


@lean_part
def _mean(share: float, earlier: Floats, later: Floats, bias: Floats) -> Vector:
    """Mean of two samples (3,), the later one weighted by `share`, less the bias."""
    rest = 1.0 - share
    return (
        share * later[0] + rest * earlier[0] - bias[0],
        share * later[1] + rest * earlier[1] - bias[1],
        share * later[2] + rest * earlier[2] - bias[2],
    )


@lean_part
def _sculling(j: int, k: int, force0: Floats, force1: Floats, rate0: Floats, rate1: Floats) -> float:
    """The component perpendicular to axes j and k of rate0 x force1 + force0 x rate1."""
    return rate0[j] * force1[k] - rate0[k] * force1[j] + force0[j] * rate1[k] - force0[k] * rate1[j]


@lean_part
def _propagate_errors(m: Floats, f: Vector, r: Matrix, dt: float) -> None:
    """Propagate errors over dt: m <- F m, F = 1 + dt (dp = v, dv = -[f x] tilt - R b_a, dtilt = -R b_g); applied to P and to P' it gives F P F'."""
    for c in range(SIZE):
        for i in range(3):
            m[POS + i, c] += dt * m[VEL + i, c]
        x, y, z = m[TILT, c], m[TILT + 1, c], m[TILT + 2, c]
        m[VEL, c] -= dt * (f[1] * z - f[2] * y)
        m[VEL + 1, c] -= dt * (f[2] * x - f[0] * z)
        m[VEL + 2, c] -= dt * (f[0] * y - f[1] * x)
        for i in range(3):
            m[VEL + i, c] -= dt * (
                r[i][0] * m[ACCEL_BIAS, c] + r[i][1] * m[ACCEL_BIAS + 1, c] + r[i][2] * m[ACCEL_BIAS + 2, c]
            )
            turned = dt * (r[i][0] * m[GYRO_BIAS, c] + r[i][1] * m[GYRO_BIAS + 1, c] + r[i][2] * m[GYRO_BIAS + 2, c])
            m[TILT + i, c] -= turned
        m[YAW, c] -= turned


@lean_part
def _add_noise(
    P: Floats, noise: Noise, dt: float, accel: Vector, rate: Vector, lost_m_s: float, lost_rad: float
) -> None:
    """Add process noise to P; scale errors of the gyros act along the present axis of rotation, `rate` (3,) in the walk frame."""
    moving = accel[0] ** 2 + accel[1] ** 2 + accel[2] ** 2
    velocity = (noise.accel**2 + noise.accel_share**2 * moving * MOTION_S) * dt + lost_m_s**2
    tilt = noise.gyro**2 * dt + lost_rad**2
    for i in range(3):
        P[VEL + i, VEL + i] += velocity
        P[GYRO_BIAS + i, GYRO_BIAS + i] += GYRO_WANDER**2 * dt
        P[ACCEL_BIAS + i, ACCEL_BIAS + i] += ACCEL_WANDER**2 * dt
        for j in range(3):
            P[TILT + i, TILT + j] += noise.gyro_share**2 * MOTION_S * dt * rate[i] * rate[j] + (tilt if i == j else 0.0)
    for i in range(2):
        vertical = noise.gyro_share**2 * MOTION_S * dt * rate[i] * rate[2]
        P[YAW, TILT + i] += vertical
        P[TILT + i, YAW] += vertical
    vertical = noise.gyro_share**2 * MOTION_S * dt * rate[2] * rate[2] + tilt
    P[YAW, TILT + 2] += vertical
    P[TILT + 2, YAW] += vertical
    P[YAW, YAW] += vertical


@lean_kernel
def update(nav: Nav, component: int, error: float, variance: float) -> None:
    """Scalar Kalman update: the error state `component` is measured as `error` with this variance; the correction goes into the state."""
    row = nav.P[component]
    share = error / (row[component] + variance)
    for i in range(3):
        nav.gyro_bias[i] += share * row[GYRO_BIAS + i]
    _correct(nav, component, error, variance, SIZE)


@lean_kernel
def update_but_gyro_bias(nav: Nav, component: int, error: float, variance: float) -> None:
    """The same, but the gyro bias and its covariance stay: a Schmidt-Kalman update, with the cross-covariances of the full update."""
    _correct(nav, component, error, variance, GYRO_BIAS)


@lean_part
def _correct(nav: Nav, component: int, error: float, variance: float, considered: int) -> None:
    """A scalar update of all but the gyro bias; the mutual covariance of the three states from `considered` on stays (SIZE: no states)."""
    P = nav.P
    row = P[component]
    total = row[component] + variance
    share = error / total
    for i in range(3):
        nav.position[i] += share * row[POS + i]
        nav.velocity[i] += share * row[VEL + i]
        nav.accel_bias[i] += share * row[ACCEL_BIAS + i]
    turn_by(nav, (share * row[TILT], share * row[TILT + 1], share * row[TILT + 2]))
    for k in range(1, SIZE + 1):
        i = (component + k) % SIZE  # the row itself last: the others need it as it was
        gain = row[i] / total
        kept = considered <= i < considered + 3
        for j in range(SIZE):
            if not (kept and considered <= j < considered + 3):
                P[i, j] -= gain * row[j]


@lean_part
def turn(nav: Nav, centre: Floats, angle: float) -> None:
    """Correct the yaw by an angle (rad), and with it position and velocity since the foot left `centre` (3,)."""
    c, s = math.cos(angle), math.sin(angle)
    x, y = nav.position[0] - centre[0], nav.position[1] - centre[1]
    u, v = nav.velocity[0], nav.velocity[1]
    nav.position[0], nav.position[1] = centre[0] + c * x - s * y, centre[1] + s * x + c * y
    nav.velocity[0], nav.velocity[1] = c * u - s * v, s * u + c * v
    turn_by(nav, (0.0, 0.0, angle))


@lean_part
def decouple(nav: Nav, component: int, variance: float) -> None:
    """Give the error state `component` this variance, and no covariance with any other."""
    nav.P[component, :] = 0.0
    nav.P[:, component] = 0.0
    nav.P[component, component] = variance


@lean_part
def reset_height(nav: Nav, height_m: float) -> None:
    """Set the height to a level floor's, and correct nothing else: the drift of a runner's steps has a bias, which is not modelled."""
    decouple(nav, POS + 2, nav.noise.flat_m**2)
    nav.position[2] = height_m


@lean_part
def reset_reference(nav: Nav) -> None:
    """Make the present position and yaw the reference: their errors belong to the steps already reported."""
    for component in (POS, POS + 1, POS + 2, TILT + 2):
        decouple(nav, component, 0.0)
