# SPDX-License-Identifier: MIT
"""Tops that a gyro's range has cut off."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.legs.clipping import ClippingRepair
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


def test_a_cut_off_swing_keeps_its_angle() -> None:
    t, true, clipped = swings()
    lost = float(np.abs((true - clipped).sum(axis=0) * 0.01).max())
    left = float(np.abs((true - repair_clipping(t, clipped)).sum(axis=0) * 0.01).max())
    assert lost > 0.3
    assert left < 0.15 * lost


def test_the_way_is_that_of_a_better_sensor() -> None:
    t, true, clipped = swings(noise=0.0)

    def way(rates: Floats) -> float:
        legs = StrideEstimator(StrideSettings())
        return sum(s.length_m for s in (*legs.feed(t, *rates.T), *legs.finish()))

    assert way(repair_clipping(t, clipped)) == pytest.approx(way(true), rel=0.01)


def test_portions_do_not_matter() -> None:
    t, _, clipped = swings()
    low, high = np.full(2, -LIMIT), np.full(2, LIMIT)

    def told(size: int) -> Floats:
        one = ClippingRepair(low, high)
        parts: list[Floats] = []
        for k in range(0, len(t), size):
            parts.append(np.column_stack(one.feed(t[k : k + size], clipped[k : k + size])))
        return np.vstack([*parts, np.column_stack(one.finish())])

    assert np.array_equal(told(20), told(1))
    assert np.array_equal(told(7), told(10_000))
    assert np.array_equal(told(7)[:, 0], t)


def test_a_sensor_within_its_range_is_left_alone() -> None:
    t, _, _ = swings()
    rates = np.random.default_rng(1).standard_normal((len(t), 2))
    assert not np.isfinite(find_clipping_limits(rates)).any()
    assert np.array_equal(repair_clipping(t, rates), rates)


def test_a_sensor_stuck_at_its_end_is_passed_on() -> None:
    t: Floats = np.arange(1000.0) * 0.01
    stuck = np.full((1000, 2), LIMIT)
    one = ClippingRepair(np.full(2, -LIMIT), np.full(2, LIMIT))
    gone = sum(len(one.feed(t[k : k + 20], stuck[k : k + 20])[0]) for k in range(0, 1000, 20))
    assert gone > 800
