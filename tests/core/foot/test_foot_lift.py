# SPDX-License-Identifier: MIT
"""A foot that stands in a lift: what the floor does is no step, no tilt and no turn."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.foot.steps import walk_track
from foot.foot_walks import Samples, moves, walking

RATE_HZ, STEPS = 100, 6
GRAVITY_M_S2 = 9.81
SPEED_M_S, RISE_M, SMOOTH_S = 1.0, 7.0, 0.3  # of the lift


def lift_m_s2(acceleration_m_s2: float, t_s: np.ndarray) -> np.ndarray:
    """Upward acceleration at times since a ride's beginning."""
    start_s = SPEED_M_S / acceleration_m_s2
    end_s = RISE_M / SPEED_M_S + start_s
    up, down = (t_s > 0.0) & (t_s < start_s), (t_s > end_s - start_s) & (t_s < end_s)
    smooth = np.full(int(SMOOTH_S * RATE_HZ), 1.0 / int(SMOOTH_S * RATE_HZ))
    return np.convolve(acceleration_m_s2 * (up.astype(float) - down), smooth, "same")


def walk_ride_walk(acceleration_m_s2: float, bias_m_s2: float) -> Samples:
    """Six steps, a ride of seven metres, the same six steps; the accelerometer has a bias."""
    rng, (_, accel, gyro) = np.random.default_rng(1), walking(STEPS, RATE_HZ)
    n = int((RISE_M / SPEED_M_S + 8.0) * RATE_HZ)
    felt = 1.0 + lift_m_s2(acceleration_m_s2, np.arange(n) / RATE_HZ - 3.0) / GRAVITY_M_S2
    standing = accel[-20:].mean(0) * felt[:, None] + 0.05 * rng.standard_normal((n, 3))
    turning = gyro[-20:].mean(0) + 0.01 * rng.standard_normal((n, 3))
    accel = np.vstack([accel, standing, accel]) + [0.0, 0.0, bias_m_s2]
    return np.arange(len(accel)) / RATE_HZ, accel, np.vstack([gyro, turning, gyro])


@pytest.mark.parametrize("bias_m_s2", [0.0, 0.15])
@pytest.mark.parametrize("acceleration_m_s2", [0.5, 0.8, 1.2])
def test_a_ride_is_a_stance(acceleration_m_s2: float, bias_m_s2: float) -> None:
    track = walk_track(*walk_ride_walk(acceleration_m_s2, bias_m_s2))
    assert len(track.steps) == 2 * STEPS
    assert track.counts.gaps == track.counts.forced == 0
    assert max(step.heading_sd_rad for step in track.steps) < math.radians(1.0)
    assert np.hypot(*moves(track)[:, :2].T) == pytest.approx(np.full(2 * STEPS, 1.3), abs=0.02)
    assert moves(track)[:, 2] == pytest.approx(np.zeros(2 * STEPS), abs=0.02)
