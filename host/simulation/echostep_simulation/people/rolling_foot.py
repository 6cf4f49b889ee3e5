# SPDX-License-Identifier: MIT
"""Courses of a rigid foot whose every move is known, and what a sensor on it feels.

In: a manner of moving. Out: `Course`: truth at 1 kHz; samples at any rate, in any mounting. The foot rolls without sliding about the point of
contact below the sensor, at heel rise and after heel strike.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats

RATE_HZ = 1000
GRAVITY = np.array([0.0, 0.0, 9.81])
STAND_S = 2.0


@dataclass(frozen=True)
class FootManner:
    """A step: `move_m` and `turn_rad` in the foot's own directions, how long it swings and stands, its pitch at toe-off and at heel strike.

    `rest_rad`: pitch of the foot at rest; a foot that lies on its toes behind a knee looks down.
    """

    move_m: tuple[float, float, float] = (1.3, 0.0, 0.0)
    turn_rad: float = 0.0
    swing_s: float = 0.6
    stance_s: float = 0.5
    toe_off_rad: float = 0.9
    heel_strike_rad: float = -0.35
    clearance_m: float = 0.1
    roll_s: float = 0.12
    height_m: float = 0.08
    rest_rad: float = 0.0


MANNERS = {
    "walking": FootManner(),
    "strolling": FootManner((0.9, 0.0, 0.0), swing_s=0.8, stance_s=0.9),
    "running": FootManner((2.4, 0.0, 0.0), swing_s=0.5, stance_s=0.25, toe_off_rad=1.2, clearance_m=0.25, roll_s=0.06),
    "backward": FootManner((-0.7, 0.0, 0.0), toe_off_rad=0.3, heel_strike_rad=0.2),
    "sideways": FootManner((0.0, 0.5, 0.0), toe_off_rad=0.3, heel_strike_rad=0.0),
    "shuffling": FootManner(
        (0.25, 0.0, 0.0), swing_s=0.4, stance_s=0.4, toe_off_rad=0.1, heel_strike_rad=0.0, clearance_m=0.02
    ),
    "upstairs": FootManner((0.56, 0.0, 0.34), swing_s=0.7, heel_strike_rad=0.0),
    "downstairs": FootManner((0.56, 0.0, -0.34), swing_s=0.6, heel_strike_rad=0.3),
    "turning": FootManner((0.8, 0.1, 0.0), turn_rad=0.6),
}
# Lengths and times of a step differ by so much from step to step, its direction by so much in rad [Winter 1991: 3 to 6 % in walking; more here].
SCATTER, WANDER_RAD = 0.06, 0.05


@dataclass(frozen=True)
class Course:
    """Truth: `t_s` (n,), sensor `position_m` (n, 3), `rotation` (n, 3, 3) foot -> walk; steps (k,) in time; footprints (k + 1, 3)."""

    t_s: Floats
    position_m: Floats
    rotation: Floats
    left_s: Floats
    landed_s: Floats
    prints_m: Floats


def glide(t: Floats, begin: float = 0.0, end: float = 1.0) -> Floats:
    """Minimum-jerk rise from 0 to 1 [Flash and Hogan 1985]."""
    u = np.clip((t - begin) / (end - begin), 0.0, 1.0)
    return u**3 * (10.0 - 15.0 * u + 6.0 * u**2)


def course(manner: FootManner, steps: int, rng: np.random.Generator | None = None) -> Course:
    """Stand, take `steps` steps, stand; the steps are equal, or given a generator differ by SCATTER and WANDER_RAD."""
    m = manner
    longer, slower, aside = np.zeros((3, steps)) if rng is None else rng.standard_normal((3, steps))
    swing_s, stance_s = m.swing_s * (1.0 + SCATTER * slower), m.stance_s * (1.0 + SCATTER * slower)
    left: Floats = STAND_S + np.concatenate([[0.0], np.cumsum(swing_s + stance_s)[:-1]])
    landed: Floats = left + swing_s
    t = np.arange(int((landed[-1] + STAND_S) * RATE_HZ)) / RATE_HZ
    ground, pitch, yaw = np.zeros((len(t), 3)), np.full(len(t), m.rest_rad), np.zeros(len(t))
    prints, heading = [np.zeros(3)], 0.0
    for k, (start, end) in enumerate(zip(left, landed, strict=True)):
        move = turned(np.array([heading]))[0] @ (np.array(m.move_m) * (1.0 + SCATTER * longer[k]))
        turn = m.turn_rad + WANDER_RAD * aside[k]
        heading += turn
        prints.append(prints[-1] + move)
        share = glide(t, start, end)
        ground += share[:, None] * move
        ground[:, 2] += m.clearance_m * 64.0 * (share * (1.0 - share)) ** 3
        yaw += share * turn
        peak = start + 0.35 * swing_s[k]
        strike = end - 0.15 * swing_s[k]
        pitch += m.toe_off_rad * (glide(t, start - m.roll_s, peak) - glide(t, peak, strike))
        pitch += m.heel_strike_rad * (glide(t, peak, strike) - glide(t, strike, strike + m.roll_s))
    rotation = turned(yaw) @ pitched(pitch)
    lever = np.array([0.0, 0.0, m.height_m])
    return Course(t, ground + rotation @ lever - rotation[0] @ lever, rotation, left, landed, np.array(prints))


def turned(yaw: Floats) -> Floats:
    """Rotations (n, 3, 3) about z."""
    c, s, zero, one = np.cos(yaw), np.sin(yaw), np.zeros_like(yaw), np.ones_like(yaw)
    return np.stack([np.stack([c, -s, zero], -1), np.stack([s, c, zero], -1), np.stack([zero, zero, one], -1)], 1)


def pitched(pitch: Floats) -> Floats:
    """Rotations (n, 3, 3) about y; positive is toe down."""
    c, s, zero, one = np.cos(pitch), np.sin(pitch), np.zeros_like(pitch), np.ones_like(pitch)
    return np.stack([np.stack([c, zero, s], -1), np.stack([zero, one, zero], -1), np.stack([-s, zero, c], -1)], 1)


def felt(walk: Course) -> tuple[Floats, Floats]:
    """Specific force and angular rate (n, 3) in the foot's axes, without error."""
    dt = 1.0 / RATE_HZ
    accel = np.zeros_like(walk.position_m)
    accel[1:-1] = (walk.position_m[2:] - 2.0 * walk.position_m[1:-1] + walk.position_m[:-2]) / dt**2
    turn = np.einsum("nji,njk->nik", walk.rotation[:-1], walk.rotation[1:])
    rate = np.zeros_like(accel)
    rate[:-1] = np.stack(
        [turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]], 1
    )
    return np.einsum("nji,nj->ni", walk.rotation, accel + GRAVITY), rate / (2.0 * dt)


def samples(
    walk: Course, rate_hz: int, mounting: Floats | None = None, rng: np.random.Generator | None = None
) -> tuple[Floats, Floats, Floats]:
    """t_s (m,), accel and gyro (m, 3): means over each interval, as a sensor gives them; with an MTx's noise and biases given a generator."""
    every = RATE_HZ // rate_hz
    count = len(walk.t_s) // every
    t = walk.t_s[: count * every].reshape(count, every).mean(1)
    accel, gyro = (v[: count * every].reshape(count, every, 3).mean(1) for v in felt(walk))
    if mounting is not None:
        accel, gyro = accel @ mounting.T, gyro @ mounting.T
    if rng is not None:
        accel = accel + 0.02 * rng.standard_normal(3) + 0.002 * math.sqrt(rate_hz) * rng.standard_normal(accel.shape)
        gyro = gyro + 0.0035 * rng.standard_normal(3) + 8.7e-4 * math.sqrt(rate_hz) * rng.standard_normal(gyro.shape)
    return t, accel, gyro
