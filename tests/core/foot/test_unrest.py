# SPDX-License-Identifier: MIT
"""A sensor that is on no foot, and one whose rest is not one g: told, and within the stated deviation."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.foot.steps import walk_track
from echostep.foot.trunk_path import KNOWN_SCALE_SD, GaitSettings, TrunkPath
from echostep.localization.settings import CloudSettings
from echostep.offline.imu_checks import contradiction, end_sd_m
from echostep_simulation.people.rolling_foot import glide
from foot import foot_walks as fw

STEPS, STRIDE_M = 20, 1.4


def shank(lever_m: float, manner: fw.FootManner, slowest: float = 0.7) -> fw.Course:
    """A walk whose sensor is on the shank: it leans by 48 degrees over the ankle in each stance, `slowest` of its mean rate in the middle."""
    foot = fw.course(manner, STEPS)
    ground = foot.position_m - foot.rotation @ [0.0, 0.0, manner.height_m]
    angle, back, ahead = np.zeros(len(foot.t_s)), -0.24, 0.6
    for k, (left, landed) in enumerate(zip(foot.left_s, foot.landed_s, strict=True)):
        u = np.clip((foot.t_s - (left - manner.stance_s)) / manner.stance_s, 0.0, 1.0)
        v = 2.0 * u - 1.0
        lean = 0.5 * (slowest * v + (1.0 - slowest) * v**3 + 1.0) if k else u**2 * (3.0 - 2.0 * u)
        angle += (ahead - (back if k else 0.0)) * lean
        angle += ((back if k < STEPS - 1 else 0.0) - ahead) * glide(foot.t_s, left, landed)
    rotation = fw.pitched(angle)
    return fw.Course(
        foot.t_s, ground + rotation @ [0.0, 0.0, lever_m], rotation, foot.left_s, foot.landed_s, foot.prints_m
    )


def flat_walk(**changed: float) -> fw.FootManner:
    return fw.FootManner((STRIDE_M, 0.0, 0.0), toe_off_rad=0.0, heel_strike_rad=0.0, **changed)


@pytest.mark.parametrize("lever_m", [0.13, 0.28, 0.4])
@pytest.mark.parametrize("noise", [0.0, 0.3])
@pytest.mark.parametrize("stance_s", [0.4, 0.6])
def test_a_sensor_on_the_shank_is_told_and_its_deviation_covers_the_error(
    lever_m: float, noise: float, stance_s: float
) -> None:
    rng = np.random.default_rng(2)
    t, accel, gyro = fw.samples(shank(lever_m, flat_walk(stance_s=stance_s)), 100, fw.any_rotation(rng), rng)
    track = walk_track(t, accel + noise * rng.standard_normal(accel.shape), gyro)
    error_m = np.hypot(*(track.position_m[-1] - track.position_m[0])[:2]) - STEPS * STRIDE_M
    assert "does not rest while the foot stands" in fw.doubts_of(track)
    assert abs(error_m) < 2.0 * end_sd_m(track)


def test_a_refusal_asks_whether_the_sensor_is_on_the_foot() -> None:
    assert "is the sensor on the foot" in contradiction(
        walk_track(*fw.samples(shank(0.28, flat_walk(stance_s=0.75)), 100))
    )


@pytest.mark.parametrize("manner", list(fw.MANNERS))
def test_no_manner_of_walking_is_taken_for_a_leg(manner: str) -> None:
    course = fw.course(fw.MANNERS[manner], STEPS, np.random.default_rng(4))
    track = walk_track(*fw.samples(course, 100, rng=np.random.default_rng(5)))
    assert max(step.unrest for step in track.steps) < 0.9
    assert fw.doubts_of(track) == ""


@pytest.mark.parametrize("scale", [0.85, 0.92, 0.97, 0.99, 1.01, 1.03, 1.08, 1.2])
def test_a_rest_that_is_not_one_g_is_told_and_covered(scale: float) -> None:
    course = fw.course(fw.MANNERS["walking"], STEPS)
    t, accel, gyro = fw.samples(course, 100, rng=np.random.default_rng(6))
    track = walk_track(t, scale * accel, gyro)
    error_m = np.hypot(*track.position_m[-1, :2]) - course.prints_m[-1, 0]
    assert abs(error_m) < 2.0 * end_sd_m(track)
    assert ("the accelerometer shows" in fw.doubts_of(track)) == (abs(scale - 1.0) > 0.02)


def test_the_trunks_path_states_the_same_deviation_once() -> None:
    t, accel, gyro = fw.samples(fw.course(fw.MANNERS["walking"], 10), 100)
    assert CloudSettings().start_scale_sd == KNOWN_SCALE_SD
    for scale, stated in ((1.0, 0.0), (1.08, 0.08)):
        path = TrunkPath(GaitSettings())
        segments = [s for step in walk_track(t, scale * accel, gyro).steps for s in path.add_step(step)]
        whole = math.sqrt(sum(segment.scale_sd**2 for segment in segments))
        assert math.hypot(whole, KNOWN_SCALE_SD if stated else 0.0) == pytest.approx(stated, abs=0.004)
        assert bool(path.doubts) == (stated > 0.0)
