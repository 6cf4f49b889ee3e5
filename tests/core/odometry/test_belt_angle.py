# SPDX-License-Identifier: MIT
"""The angle of the belt: an integral, unbroken or none."""

from __future__ import annotations

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.odometry.belt_angle import GAP_S, KEPT_S, BeltAngle

RATE_HZ = 200


def ramp(begin_s: float, seconds: float) -> tuple[Floats, Floats]:
    t_s: Floats = begin_s + np.arange(0.0, seconds, 1.0 / RATE_HZ)
    return t_s, 0.1 + 1e-6 * np.arange(float(len(t_s)))


def test_the_belts_angle_is_the_integral_of_its_rate_from_block_to_block() -> None:
    belt = BeltAngle()
    t_s, rate = ramp(0.0, 5.0)
    for k in range(0, len(t_s), 20):
        belt.add(t_s[k : k + 20], rate[k : k + 20])
    first, last = belt.angle_rad(0.5), belt.angle_rad(4.5)
    assert first is not None
    assert last is not None
    assert last - first == pytest.approx(0.402)
    assert belt.angle_rad(5.5) is None


def test_the_belts_angle_begins_anew_after_a_gap_and_is_forgotten() -> None:
    belt = BeltAngle()
    belt.add(*ramp(0.0, 1.0))
    belt.add(*ramp(1.0 + 0.5 * GAP_S, 1.0))
    assert belt.since_s == 0.0
    belt.add(*ramp(4.0, 1.0))
    assert belt.since_s == 4.0
    assert belt.angle_rad(1.0) is None
    for k in range(40):
        belt.add(*ramp(5.0 + k, 1.0))
    assert belt.angle_rad(44.0 - KEPT_S - 1.5) is None
    assert belt.angle_rad(44.0 - KEPT_S + 1.5) is not None


def test_time_that_goes_back_begins_anew() -> None:
    belt = BeltAngle()
    belt.add(*ramp(100.0, 1.0))
    belt.add(*ramp(3.0, 1.0))
    assert belt.since_s == 3.0
