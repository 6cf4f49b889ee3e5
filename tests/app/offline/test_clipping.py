# SPDX-License-Identifier: MIT
"""Tops that a gyro's range has cut off, in a file: the limits are found and the swings repaired."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.legs.stride import StrideSettings
from echostep.legs.strides import StrideEstimator
from echostep_app.offline.leg_gyros import find_clipping_limits, repair_clipping
from echostep_studies.simulation.joint_gait import FAST, draw_person, simulate_gait

LIMIT = math.radians(300.0)


def swings(seed: int = 0, noise: float = 0.01) -> tuple[Floats, Floats, Floats]:
    """Times, true rates of thigh and shank, the same with noise and clipped."""
    gait = simulate_gait(draw_person(np.random.default_rng(seed)), FAST, 5.0, np.random.default_rng(seed))
    at = slice(None, None, 5)
    true = np.column_stack([gait.thigh_rad_s[at], gait.shank_rad_s[at]])
    noisy = true + noise * np.random.default_rng(seed + 1).standard_normal(true.shape)
    return gait.t_s[at], true, np.clip(noisy, -LIMIT, LIMIT)


def test_the_way_is_that_of_a_better_sensor() -> None:
    t, true, clipped = swings(noise=0.0)

    def way(rates: Floats) -> float:
        legs = StrideEstimator(StrideSettings())
        return sum(s.length_m for s in (*legs.feed(t, *rates.T), *legs.finish()))

    assert way(repair_clipping(t, clipped)) == pytest.approx(way(true), rel=0.01)


def test_a_sensor_within_its_range_is_left_alone() -> None:
    t, _, _ = swings()
    rates = np.random.default_rng(1).standard_normal((len(t), 2))
    assert not np.isfinite(find_clipping_limits(rates)).any()
    assert np.array_equal(repair_clipping(t, rates), rates)
