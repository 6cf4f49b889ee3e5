# SPDX-License-Identifier: MIT
"""What a standing foot tells its filter: twins of the kernels, a glide that is no rest, real feet in a hurry.

In a lift the floor's motion is no step, no tilt and no turn.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.foot import ins, stance
from echostep.foot.steps import FootCounts, Stance, Step, Track, walk_track
from echostep.offline.imu_csv import describe_track
from foot.foot_walks import Samples, moves, walking
from foot.test_foot import some_nav

HEIGHT_M = 0.08


def test_velocity_of_a_standing_foot_agrees_with_its_twin() -> None:
    """Rate x height in the middle of the window, and the acceleration since."""
    rng = np.random.default_rng(1)
    nav, window = some_nav(rng), stance.new_window()
    t = np.arange(20) * 0.005
    accel, gyro = rng.standard_normal((20, 3)), rng.standard_normal((20, 3))
    for sample in zip(t, accel, gyro, strict=True):
        stance.add_sample(window, *sample)
    r = np.array(ins.rotation(nav.attitude))
    up = np.array([0.0, 0.0, 1.0])
    in_window = t > t[-1] - stance.WINDOW_S - 1e-6
    middle = len(t) - 1 - int(in_window.sum()) // 2
    since = (accel[middle + 1 :] - nav.accel_bias) @ r.T - 9.81 * up
    expected = np.cross(r @ (gyro[middle] - nav.gyro_bias), HEIGHT_M * up) + 0.005 * since.sum(0)
    assert stance.standing_velocity(nav, window, HEIGHT_M) == pytest.approx(expected, abs=1e-9)


def test_a_covariance_that_grows_again_and_again_stays_one() -> None:
    """As on a trolley: a hundred times against the gate, each followed by an update."""
    nav = some_nav(np.random.default_rng(5))
    for at in np.tile(range(ins.VEL, ins.VEL + 3), 100):
        stance.inflate_covariance(nav, stance.MOST_EXCESS)
        ins.update_but_gyro_bias(nav, at, 0.0, 1e-4)
    assert pytest.approx(nav.P.T, abs=1e-9) == nav.P
    assert nav.P[ins.YAW, ins.YAW] <= 1.001 * stance.UNKNOWN_YAW_RAD2


@pytest.mark.parametrize(("push_m_s2", "turn_rad_s", "end_s"), [(0.4, 0.0, 5.0), (0.0, 0.1, 3.5)])
def test_a_push_is_a_floor_that_moves_and_a_tilt_is_none(push_m_s2: float, turn_rad_s: float, end_s: float) -> None:
    """A trolley starts, or the foot turns until it feels as much."""
    rng, t = np.random.default_rng(1), np.arange(800) / 100.0
    during = (t > 3.0) & (t < end_s)
    tilt = np.cumsum(turn_rad_s * during) / 100.0
    ahead = push_m_s2 * during - ins.GRAVITY_M_S2 * np.sin(tilt)
    accel = np.column_stack([ahead, 0.0 * t, ins.GRAVITY_M_S2 * np.cos(tilt)]) + 0.03 * rng.standard_normal((800, 3))
    gyro = np.column_stack([0.0 * t, turn_rad_s * during, 0.0 * t]) + 0.01 * rng.standard_normal((800, 3))
    in_stance = walk_track(t, accel, gyro).stance
    assert in_stance[[250, -1]].tolist() == [True, push_m_s2 == 0.0]


def test_a_glide_is_no_rest() -> None:
    """A shuffling foot is calm for long, and its force has gravity's size; but it leans forward, then back."""
    t = np.arange(600) / 200.0
    along = np.interp(t, [1.0, 1.1, 1.5, 1.6], [0.0, 4.0, -4.0, 0.0])
    shaken = np.where((t > 1.0) & (t < 1.1), 8.0 * (-1.0) ** np.arange(len(t)), 0.0)
    accel = np.column_stack([along, 0.0 * t, ins.GRAVITY_M_S2 + shaken])
    track = walk_track(t, accel, np.zeros((len(t), 3)))
    moved_m = float(np.cumsum(along).sum() / 200.0**2)
    assert track.position_m[-1, 0] == pytest.approx(moved_m, rel=0.1)


def test_a_quick_foot_may_stand_less_still() -> None:
    assert stance.most_activity(0.0) == stance.most_activity(stance.CALM_SWING_RAD_S) == 1.0
    assert stance.most_activity(2.0 * stance.CALM_SWING_RAD_S) == 4.0


@pytest.mark.parametrize(("stood_s", "said"), [(0.08, "; once the foot"), (0.3, "0 gaps;")])
def test_a_run_is_said_to_be_one(stood_s: float, said: str) -> None:
    events: list[Step | Stance] = [
        Step(1.0, 1.6, (1.5, 0.0, 0.0), 0.09**2 * np.eye(3), 0.0, 0.01),
        Stance(1.6, 1.6 + stood_s, 0.0),
    ]
    flags = np.zeros(2, bool)
    track = Track(np.zeros(2), np.zeros((2, 3)), np.zeros(2), flags, events, FootCounts(2, 0, 0, 0, 0, 0))
    assert said in describe_track(track)


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
