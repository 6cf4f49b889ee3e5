# SPDX-License-Identifier: MIT
"""The equations of Lee and Lee 2010 against numbers and differences."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.elementary import wrap
from echostep_studies.papers import lee2010
from echostep_studies.papers.lee2010 import Lee2010Legs

LEGS = Lee2010Legs()
angles = st.floats(-0.6, 0.6)


def test_travel_by_the_papers_lengths() -> None:
    assert lee2010.knee_travel(math.pi / 6, math.pi / 6, LEGS) == pytest.approx(0.48)
    assert lee2010.hip_travel(math.pi / 6, math.pi / 6, math.pi / 6, math.pi / 6, LEGS) == pytest.approx(1.04)


@given(angles, angles, angles, angles, st.floats(-5, 5), st.floats(-5, 5))
def test_velocity_is_the_derivative_of_the_travel(
    a: float, b: float, c: float, d: float, thigh: float, calf: float
) -> None:
    h = 1e-6
    after = lee2010.hip_travel(a + h * thigh, b + h * thigh, c + h * calf, d + h * calf, LEGS)
    before = lee2010.hip_travel(a - h * thigh, b - h * thigh, c - h * calf, d - h * calf, LEGS)
    assert lee2010.velocity(a, b, c, d, thigh, calf, LEGS) == pytest.approx((after - before) / (2 * h), abs=1e-6)


@given(st.floats(-20, 20), st.floats(0.01, 2), st.floats(-20, 20), st.floats(0.01, 2))
def test_fusion_is_the_best_and_lies_between(c: float, c_var: float, g: float, g_var: float) -> None:
    fused = lee2010.fuse(c, c_var, g, g_var)
    off, whole = abs(wrap(c - g)), abs(wrap(fused.angle_rad - g))
    assert whole == pytest.approx(off * g_var / (c_var + g_var), abs=1e-9)
    assert fused.variance == pytest.approx(1.0 / (1.0 / c_var + 1.0 / g_var))
    assert -math.pi <= fused.angle_rad < math.pi


def test_fusion_where_the_circle_closes() -> None:
    fused = lee2010.fuse(math.radians(179), 1.0, math.radians(-179), 1.0)
    assert abs(abs(fused.angle_rad) - math.pi) < 1e-9


def test_drift_does_not_carry_the_leg_away() -> None:
    """Figure 4: a biased gyro's angle is reset after each oscillation."""
    t = np.arange(0.0, 60.0, 0.005)
    rate = 0.4 * 2 * math.pi * np.cos(2 * math.pi * t) + 0.02
    walker = lee2010.Walker()
    walker.feed(t, rate, rate, np.zeros_like(t), np.full_like(t, np.nan))
    assert abs(lee2010.nominal(walker.thigh.front_rad, walker.thigh.rear_rad)) < 0.25  # unreset: 1.2


def test_walker_goes_twice_the_travel_in_a_period() -> None:
    t = np.arange(0.0, 20.0, 0.005)
    swing = 0.35
    rate = swing * 2 * math.pi * np.cos(2 * math.pi * t)
    walker = lee2010.Walker()
    rows = walker.feed(t, rate, rate, np.zeros_like(t), np.full_like(t, np.nan))
    per_period = 2.0 * lee2010.hip_travel(swing, swing, swing, swing, LEGS)
    assert rows[-1, 1] == pytest.approx(20.0 * per_period, rel=0.06)
    assert np.diff(rows[:, 0]) == pytest.approx(0.1, abs=0.0051)


def test_floor_is_the_nearest_by_height() -> None:
    heights = (0.0, 4.0, 8.0)
    up = 101_325.0 * (1.0 - 2.25577e-5 * 7.0) ** 5.25588
    assert lee2010.floor_of(up, heights, 101_325.0, 0) == 2
    assert lee2010.floor_of(101_325.0, heights, up, 2) == 0
