# SPDX-License-Identifier: MIT
"""Gyros that bend off at a soft limit: the omitted angle is restored, and a gyro that is not at its limit is left alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from echostep.foot import soft_limit, stance
from echostep.foot.steps import walk_track
from echostep.jit import lean_kernel
from foot import foot_walks as fw

QUICK_LAPS = fw.FootManner((1.2, 0.0, 0.0), turn_rad=0.35, swing_s=0.55, stance_s=0.22, toe_off_rad=1.0, roll_s=0.09)
STEPS = 40


@pytest.mark.parametrize("rate_hz", [100, 200])
@pytest.mark.parametrize("name", ["quick laps", "walking"])
def test_a_soft_limit_costs_a_percent_and_no_step(name: str, rate_hz: int) -> None:
    """At 80 % of the greatest rate; without the correction steps are missed, or the track leaves by tens of percent."""
    manner = QUICK_LAPS if name == "quick laps" else fw.MANNERS["walking"]
    course = fw.course(manner, STEPS)
    t, accel, gyro = fw.samples(course, rate_hz, rng=np.random.default_rng(1))
    track = walk_track(t, accel, fw.bent(gyro, 0.8 * float(np.abs(gyro).max())))
    assert len(track.steps) == STEPS
    assert track.counts.saturated > 5 * STEPS
    way = sum(float(np.hypot(*step.move_m[:2])) for step in track.steps)
    assert way == pytest.approx(float(np.hypot(*np.diff(course.prints_m, axis=0)[:, :2].T).sum()), rel=0.01)
    error = (track.steps[-1].heading_rad - STEPS * manner.turn_rad + np.pi) % (2.0 * np.pi) - np.pi
    assert abs(error) < np.radians(8.0)


def test_a_rate_at_the_value_of_the_last_plateau_may_be_rounder() -> None:
    window = stance.new_window()
    for k, rate in enumerate((8.9, 9.01)):  # 2.4 per second: more than 2, less than 3
        stance.add_sample(window, 0.005 * k, np.zeros(3), np.full(3, rate))
    flat: Callable[..., bool] = lean_kernel(lambda window, limit: soft_limit._flat(window, 0, 0, 1, limit))
    assert [flat(window, limit) for limit in (0.0, 8.95, 9.2)] == [False, True, False]


@pytest.mark.parametrize("name", ["walking", "running", "turning", "downstairs"])
def test_a_round_peak_is_no_limit(name: str) -> None:
    t, accel, gyro = fw.samples(fw.course(fw.MANNERS[name], 10), 200, rng=np.random.default_rng(2))
    assert walk_track(t, accel, gyro).counts.saturated == 0
