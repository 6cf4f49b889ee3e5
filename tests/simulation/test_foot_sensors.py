# SPDX-License-Identifier: MIT
"""The simulated foot's specific force and rate."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.arrays import Floats
from echostep_simulation.devices.mtx import GRAVITY_M_S2, specific_force_and_rate, stream
from echostep_simulation.people.attitude import quaternions, rotations
from echostep_simulation.people.walker import RATE_HZ, Walk
from simulation.simulated import FAULTLESS, samples_of


def strapdown(force: Floats, rate: Floats, r0: Floats, dt_s: float) -> Floats:
    """Position (n, 3) by integrating specific force and angular rate (n, 3) from rest: naive, small steps."""
    r, v, p = r0.copy(), np.zeros(3), np.zeros(3)
    path = np.zeros((len(force), 3))
    for k, (f, w) in enumerate(zip(force, rate, strict=True)):
        v = v + (r @ f - [0.0, 0.0, GRAVITY_M_S2]) * dt_s
        p = p + v * dt_s
        path[k] = p
        r = r @ rotation_of(w * dt_s)
    return path


def rotation_of(turn: Floats) -> Floats:
    """Rotation matrix of a rotation vector (Rodrigues)."""
    angle = float(np.linalg.norm(turn))
    x, y, z = turn
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    a, b = (1.0, 0.5) if angle < 1e-9 else (math.sin(angle) / angle, (1.0 - math.cos(angle)) / angle**2)
    return np.eye(3) + a * k + b * (k @ k)


def test_what_the_foot_feels_integrates_back_to_its_path(l_walk: Walk) -> None:
    force, rate = specific_force_and_rate(l_walk)
    r0 = rotations(l_walk.foot_rpy_rad[:1])[0]
    path = strapdown(force, rate, r0, 1.0 / RATE_HZ)
    truth = l_walk.foot_m - l_walk.foot_m[0]
    assert np.hypot(*truth[-1, :2]) > 7.0
    assert np.abs(path[:-1] - truth[1:]).max() < 0.005  # of 11 m in 16 s; 1e-4 m/s2 would already give 1 cm


def test_a_standing_foot_feels_gravity_and_nothing_else(l_walk: Walk) -> None:
    force, rate = specific_force_and_rate(l_walk)
    assert np.allclose(force[10:2_000], [0.0, 0.0, GRAVITY_M_S2], atol=1e-9)
    assert np.allclose(rate[10:2_000], 0.0, atol=1e-12)
    assert np.abs(force).max() < 180.0
    assert np.degrees(np.abs(rate)).max() < 1200.0


@pytest.mark.parametrize("rate_hz", [100.0, 200.0])
def test_samples_are_means_over_their_interval(l_walk: Walk, rate_hz: float) -> None:
    found = stream(l_walk, replace(FAULTLESS, rate_hz=rate_hz), np.random.default_rng(1))
    force, rate = specific_force_and_rate(l_walk)
    samples = samples_of(found.frames)
    n = int(RATE_HZ / rate_hz)
    for k in (len(samples) // 3, len(samples) // 2):
        end = round(found.t_s[k] * RATE_HZ)
        assert np.allclose(samples[k].accel, force[end - n : end + 1].mean(0), atol=0.4)
        assert np.allclose(samples[k].gyro, rate[end - n : end + 1].mean(0), atol=0.2)


def test_mtx_means_carry_the_whole_turn(l_walk: Walk) -> None:
    found = stream(l_walk, FAULTLESS, np.random.default_rng(1))
    gyro = np.array([s.gyro for s in samples_of(found.frames)])
    r = rotations(l_walk.foot_rpy_rad[:1])[0]
    for w in gyro * 0.01:
        r = r @ rotation_of(w)
    yaw = math.atan2(r[1, 0], r[0, 0])
    assert yaw - l_walk.foot_rpy_rad[0, 2] == pytest.approx(0.5 * math.pi, abs=math.radians(1.0))


@given(st.tuples(*[st.floats(-math.pi, math.pi)] * 3))
def test_quaternions_are_the_rotations(rpy: tuple[float, float, float]) -> None:
    r = rotations(np.array([rpy]))
    w, x, y, z = quaternions(r)[0]
    again = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    assert np.allclose(again, r[0], atol=1e-9)
