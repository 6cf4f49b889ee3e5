"""The inertial kernel: strapdown integration and zero-velocity updates in an error-state Kalman filter.

In: specific force and angular rate of the foot, sample by sample. Out: position, velocity, attitude, and per sample whether the foot stands.
Owns nothing: state and covariance are arrays that the caller keeps. Feeding n samples at once or one at a time gives the same bits.

Errors are true minus estimated: position, velocity, attitude (walk frame), gyro bias; 12 in all [Foxlin 2005; Skog et al. 2010; Nilsson
et al. 2012]. The walk frame is levelled, z up, its yaw is zero at the start.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

GRAVITY_M_S2 = 9.81
P, V, TH, BG = 0, 3, 6, 9  # where each error begins

# `state`, one row of numbers: time, position, velocity, quaternion (body -> walk), gyro bias, last specific force and rate, bookkeeping.
T, POS, VEL, QUAT, BIAS, ACC, GYR, STILL_S, SWING_S, COUNT, BAD, GAPS = 0, 1, 4, 7, 11, 14, 17, 20, 21, 22, 23, 24
STATE_SIZE = 25

WINDOW = 32  # samples kept for the detector, at most
# `ring`, per sample: time, specific force, angular rate.


@njit(cache=True)
def rotation(q: Floats) -> Floats:
    """Rotation matrix (3, 3) body -> walk of a unit quaternion w x y z."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    r = np.empty((3, 3))
    r[0, 0], r[0, 1], r[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
    r[1, 0], r[1, 1], r[1, 2] = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
    r[2, 0], r[2, 1], r[2, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
    return r


@njit(cache=True)
def multiply(a: Floats, b: Floats) -> Floats:
    """Quaternion product a b."""
    return np.array(
        [
            a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
        ]
    )


@njit(cache=True)
def from_vector(v: Floats) -> Floats:
    """Unit quaternion of a rotation vector (rad)."""
    angle = math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    k = 0.5 if angle < 1e-12 else math.sin(0.5 * angle) / angle
    return np.array([math.cos(0.5 * angle), k * v[0], k * v[1], k * v[2]])


@njit(cache=True)
def level(state: Floats, accel: Floats) -> None:
    """Attitude from gravity: roll and pitch; yaw zero."""
    n = math.sqrt(accel[0] ** 2 + accel[1] ** 2 + accel[2] ** 2)
    roll = math.atan2(accel[1], accel[2])
    pitch = math.asin(min(max(-accel[0] / n, -1.0), 1.0)) if n > 0.0 else 0.0
    about_x = np.array([math.cos(roll / 2), math.sin(roll / 2), 0.0, 0.0])
    about_y = np.array([math.cos(pitch / 2), 0.0, math.sin(pitch / 2), 0.0])
    state[QUAT : QUAT + 4] = multiply(about_y, about_x)


@njit(cache=True)
def predict(state: Floats, cov: Floats, force: Floats, rate: Floats, dt: float, accel_sd: float, gyro_sd: float) -> None:
    """Strapdown step and covariance; `accel_sd`, `gyro_sd`: noise densities, m/s2 and rad/s per root Hz."""
    q = multiply(state[QUAT : QUAT + 4], from_vector((rate - state[BIAS : BIAS + 3]) * dt))
    q /= math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    half = q + state[QUAT : QUAT + 4]
    half /= math.sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2] + half[3] * half[3])
    r = rotation(half)
    state[QUAT : QUAT + 4] = q
    f = np.zeros(3)
    for i in range(3):
        f[i] = r[i, 0] * force[0] + r[i, 1] * force[1] + r[i, 2] * force[2]
    for i in range(3):
        a = f[i] - (GRAVITY_M_S2 if i == 2 else 0.0)
        state[POS + i] += state[VEL + i] * dt + 0.5 * a * dt * dt
        state[VEL + i] += a * dt
    _transition(cov, f, r, dt)
    for i in range(3):
        cov[V + i, V + i] += accel_sd * accel_sd * dt
        cov[TH + i, TH + i] += gyro_sd * gyro_sd * dt
        cov[BG + i, BG + i] += 1e-12 * dt


@njit(cache=True)
def _transition(cov: Floats, f: Floats, r: Floats, dt: float) -> None:
    """cov <- F cov F' with F = 1 + dt (dp = v, dv = -[f x] th, dth = -R bg), rows first, then columns."""
    for side in range(2):
        m = cov if side == 0 else cov.T
        for c in range(12):
            for i in range(3):
                m[P + i, c] += dt * m[V + i, c]
            a, b, g = m[TH, c], m[TH + 1, c], m[TH + 2, c]
            m[V, c] -= dt * (f[1] * g - f[2] * b)
            m[V + 1, c] -= dt * (f[2] * a - f[0] * g)
            m[V + 2, c] -= dt * (f[0] * b - f[1] * a)
            for i in range(3):
                m[TH + i, c] -= dt * (r[i, 0] * m[BG, c] + r[i, 1] * m[BG + 1, c] + r[i, 2] * m[BG + 2, c])


@njit(cache=True)
def observe(state: Floats, cov: Floats, at: int, value: Floats, sd: float) -> None:
    """Kalman update: the error states at..at+2 are `value` +- sd (three scalar updates), then the errors go into the state.

    The gyro bias is corrected by gyro readings alone: a velocity says nothing of the bias about the vertical, and what it seems
    to say is the rest of a foot that was not quite still. For velocities the bias is considered, not estimated [Schmidt 1966].
    """
    d = np.zeros(12)
    for i in range(3):
        j = at + i
        row = cov[:, j].copy()
        s = row[j] + sd * sd
        gain = row / s
        if at != BG:
            gain[BG:] = 0.0
        innovation = value[i] - d[j]
        d += gain * innovation
        for a in range(12):
            for b in range(a, 12):
                cov[a, b] += gain[a] * gain[b] * s - gain[a] * row[b] - row[a] * gain[b]
                cov[b, a] = cov[a, b]
    for i in range(3):
        state[POS + i] += d[P + i]
        state[VEL + i] += d[V + i]
        state[BIAS + i] += d[BG + i]
    state[QUAT : QUAT + 4] = multiply(from_vector(d[TH : TH + 3]), state[QUAT : QUAT + 4])


@njit(cache=True)
def motion(ring: Floats, count: int, span_s: float, bias: Floats) -> tuple[float, float]:
    """Mean squared deviation of specific force from gravity along its own mean, and mean squared rate, over the last span.

    The two terms of the SHOE statistic [Skog et al. 2010], in (m/s2)2 and (rad/s)2.
    """
    newest = ring[(count - 1) % WINDOW, 0]
    mean = np.zeros(3)
    n = 0
    while n < min(count, WINDOW) and newest - ring[(count - 1 - n) % WINDOW, 0] <= span_s:
        mean += ring[(count - 1 - n) % WINDOW, 1:4]
        n += 1
    mean /= n
    scale = GRAVITY_M_S2 / max(math.sqrt(mean[0] ** 2 + mean[1] ** 2 + mean[2] ** 2), 1e-9)
    a2, w2 = 0.0, 0.0
    for k in range(n):
        row = ring[(count - 1 - k) % WINDOW]
        for i in range(3):
            a2 += (row[1 + i] - mean[i] * scale) ** 2
            w2 += (row[4 + i] - bias[i]) ** 2
    return a2 / n, w2 / n
