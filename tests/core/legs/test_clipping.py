# SPDX-License-Identifier: MIT
"""Tops that a gyro's range has cut off."""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep.legs.clipping import ClippingRepair
from legs.leg_walks import walked

LIMIT = math.radians(250.0)


def swings() -> tuple[Floats, Floats, Floats]:
    """Times, rates of thigh and shank, the same clipped."""
    t, *rates = walked([(0.0, 0.0), (8.0, 0.0)])
    true = np.column_stack(rates)
    return t, true, np.clip(true, -LIMIT, LIMIT)


def told(t: Floats, rates: Floats, size: int) -> Floats:
    """Times and repaired rates (n, 3), fed in portions of this size."""
    one = ClippingRepair(np.full(2, -LIMIT), np.full(2, LIMIT))
    parts = [np.column_stack(one.feed(t[k : k + size], rates[k : k + size])) for k in range(0, len(t), size)]
    return np.vstack([*parts, np.column_stack(one.finish())])


def test_a_cut_off_swing_keeps_its_angle() -> None:
    t, true, clipped = swings()
    repaired = told(t, clipped, len(t))[:, 1:]
    lost, left = (float(np.abs((true - rates).sum(axis=0) * 0.01).max()) for rates in (clipped, repaired))
    assert lost > 0.05
    assert left < 0.15 * lost


def test_portions_do_not_matter() -> None:
    t, _, clipped = swings()
    one = told(t, clipped, 1)
    assert all(np.array_equal(told(t, clipped, size), one) for size in (7, 20, 10_000))
    assert np.array_equal(one[:, 0], t)


def test_a_sensor_stuck_at_its_end_is_passed_on() -> None:
    t: Floats = np.arange(1000.0) * 0.01
    stuck = np.full((1000, 2), LIMIT)
    one = ClippingRepair(np.full(2, -LIMIT), np.full(2, LIMIT))
    gone = sum(len(one.feed(t[k : k + 20], stuck[k : k + 20])[0]) for k in range(0, 1000, 20))
    assert gone > 800
