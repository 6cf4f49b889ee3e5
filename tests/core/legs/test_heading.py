# SPDX-License-Identifier: MIT
"""Heading by a drifting gyro and a disturbed compass."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.elementary import wrap
from echostep.legs.heading import CompassErrors, Heading, HeadingSettings

IRON = CompassErrors(math.radians(6), math.radians(-4), math.radians(2), math.radians(1))


def shown(heading: np.ndarray, iron: CompassErrors) -> np.ndarray:
    return np.array([h + iron.error(h) for h in heading.tolist()])


def _lap(seed: int, iron: CompassErrors) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Two minutes round a rectangle: time, true heading, gyro, compass with slow disturbances and one machine."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 120.0, 0.005)
    heading = np.interp(t, [0, 30, 32, 55, 57, 87, 89, 120], np.radians([0, 0, 90, 90, 180, 180, 270, 270]))
    rate = (
        np.gradient(heading, t)
        + math.radians(1.0) * rng.standard_normal()
        + math.radians(0.5) * rng.standard_normal(len(t))
    )
    phase = rng.uniform(0, 2 * math.pi, 6)
    period = rng.uniform(3, 12, 6)
    slow = sum(
        math.radians(5.0) * math.sqrt(2 / 6) * np.sin(2 * math.pi * t / p + q)
        for p, q in zip(period, phase, strict=True)
    )
    machine = np.where((t > 40) & (t < 46), math.radians(90) * np.sin(math.pi * (t - 40) / 6), 0.0)
    compass = np.where(np.arange(len(t)) % 20 == 0, shown(heading, iron) + slow + machine, np.nan)
    return t, heading, rate, np.angle(np.exp(1j * compass))


@pytest.mark.parametrize("seed", range(4))
def test_heading_round_a_lap(seed: int) -> None:
    t, heading, rate, compass = _lap(seed, IRON)
    found = Heading(heading_rad=0.0, sd_rad=0.02).feed(t, rate, compass, t < 3.0)
    off = np.abs(np.angle(np.exp(1j * (found[:, 0] - heading))))
    assert math.degrees(off.max()) < 9.0
    assert math.degrees(math.sqrt((off**2).mean())) < 4.5
    assert (off < 3.0 * found[:, 1]).mean() > 0.9


def test_a_magnet_does_not_turn_the_heading() -> None:
    t, heading, rate, compass = _lap(5, CompassErrors())
    ours = Heading(heading_rad=0.0, sd_rad=0.02)
    found = ours.feed(t, rate, compass, t < 3.0)
    beside = (t > 40) & (t < 46)
    assert math.degrees(np.abs(found[beside, 0] - heading[beside]).max()) < 6.0
    assert ours.refused > 30


def test_portions_do_not_matter_and_the_circle_closes() -> None:
    t, _, rate, compass = _lap(6, IRON)
    whole = Heading().feed(t, rate + 0.2, compass)
    cut = Heading()
    cuts = ((0, 7), (7, 5000), (5000, len(t)))
    parts = [cut.feed(t[a:b], rate[a:b] + 0.2, compass[a:b]) for a, b in cuts]
    assert np.array_equal(np.vstack(parts), whole)
    assert np.isfinite(whole).all()
    assert wrap(math.pi) == -math.pi


def test_without_compass_it_counts_from_zero_and_says_how_well() -> None:
    t = np.arange(0.0, 60.0, 0.01)
    found = Heading(HeadingSettings()).feed(t, np.full_like(t, 0.1), np.full_like(t, np.nan))
    assert found[-1, 0] == pytest.approx(0.1 * 59.99, rel=1e-6)
    assert found[-1, 1] > math.radians(45)


@pytest.mark.parametrize("has_compass", [True, False])
def test_a_gap_is_not_turned_through_at_the_rate_after_it(has_compass: bool) -> None:
    """Three seconds are missing in a turn: the compass then gives the heading at once; without one it is as before, and unsure."""
    t = np.concatenate([np.arange(0.0, 5.0, 0.01), np.arange(8.0, 12.0, 0.01)])
    true, turning = np.where(t < 6.0, 0.0, 1.5), np.where(abs(t - 6.5) < 1.6, 1.0, 0.0)
    compass = np.where(np.arange(len(t)) % 10 == 0, true if has_compass else np.nan, np.nan)
    ours = Heading()
    found = ours.feed(t, turning, compass)
    assert found[510:, 0] == pytest.approx(np.full(len(t) - 510, 1.5 if has_compass else 0.0) + 0.09, abs=0.15)
    assert found[500, 1] == pytest.approx(math.radians(8.0) if has_compass else 0.9, rel=0.1)
    assert ours.unbroken_s >= 8.0
