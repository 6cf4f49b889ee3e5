# SPDX-License-Identifier: MIT
"""The simulation against hand-computed cases: a foot that integrates back to its path, echoes of simple walls, rows, MTx bytes, the Python board."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep_simulation.people.walker import RATE_HZ, Person, Walk, walk
from simulation.simulated import WAYPOINTS


def test_the_walk_stands_walks_and_stands_again(l_walk: Walk) -> None:
    speed = np.hypot(*np.gradient(l_walk.trunk_m, axis=0).T) * RATE_HZ
    assert speed[:2_000].max() < 0.05
    assert speed[-2_000:].max() < 0.05
    assert 0.9 < np.median(speed[5_000:-5_000]) < 1.5
    assert np.allclose(l_walk.trunk_m[0], WAYPOINTS[0], atol=0.05)
    assert np.allclose(l_walk.trunk_m[-1], WAYPOINTS[-1], atol=0.05)
    assert l_walk.heading_rad[-1] - l_walk.heading_rad[0] == pytest.approx(0.5 * math.pi, abs=0.02)


def test_a_flat_foot_is_truly_still(l_walk: Walk) -> None:
    both = l_walk.flat[1:] & l_walk.flat[:-1]
    assert 0.3 < l_walk.flat[4_000:-4_000].mean() < 0.5
    assert np.abs(np.diff(l_walk.foot_m, axis=0)[both]).max() < 1e-12
    assert np.abs(np.diff(l_walk.foot_rpy_rad, axis=0)[both]).max() < 1e-12


def test_the_trunk_passes_over_the_foot_in_the_middle_of_its_stance(l_walk: Walk) -> None:
    starts = np.flatnonzero(np.diff(l_walk.flat.astype(int)) == 1) + 1
    ends = np.flatnonzero(np.diff(l_walk.flat.astype(int)) == -1)[1:]
    for start, end in zip(starts[:-1], ends, strict=True):
        middle = (start + end) // 2
        dx, dy = l_walk.foot_m[middle, :2] - l_walk.trunk_m[middle]
        heading = l_walk.heading_rad[middle]
        forward = dx * math.cos(heading) + dy * math.sin(heading)
        left = dy * math.cos(heading) - dx * math.sin(heading)
        assert abs(forward) < 0.05
        assert left == pytest.approx(-0.08, abs=0.05)


def test_a_person_stops_turns_on_the_spot_and_goes_back() -> None:
    walked = walk(((0.0, 0.0), (4.0, 0.0, 2.0), (0.0, 0.0)), Person(), np.random.default_rng(1))
    speed = np.hypot(*np.gradient(walked.trunk_m, axis=0).T) * RATE_HZ
    paused = (np.abs(walked.trunk_m[:, 0] - 4.0) < 0.02) & (speed < 0.01) & walked.flat
    assert 1.5 < paused.sum() / RATE_HZ < 4.0
    assert np.degrees(np.abs(np.gradient(walked.heading_rad)) * RATE_HZ).max() < 200.0
    assert np.cos(walked.heading_rad[-1] - walked.heading_rad[0]) == pytest.approx(-1.0, abs=1e-3)
    assert np.allclose(walked.trunk_m[-1], 0.0, atol=0.02)


def test_the_foot_moves_as_feet_do(l_walk: Walk) -> None:
    velocity = np.diff(l_walk.foot_m, axis=0) * RATE_HZ
    force = np.diff(velocity, axis=0) * RATE_HZ
    assert 3.0 < np.abs(velocity[:, :2]).max() < 6.0
    assert np.abs(force).max() < 60.0
    assert 0.05 < np.ptp(l_walk.foot_m[:, 2]) < 0.25
    assert l_walk.foot_m[:, 2].min() == pytest.approx(l_walk.foot_m[0, 2], abs=0.005)
    assert np.degrees(l_walk.foot_rpy_rad[:, 1].max()) == pytest.approx(60.0, abs=10.0)
    assert np.degrees(l_walk.foot_rpy_rad[:, 1].min()) == pytest.approx(-22.0, abs=5.0)


def test_leg_rates_are_those_of_a_gait(l_walk: Walk) -> None:
    for rate in (l_walk.thigh_rad_s, l_walk.calf_rad_s):
        swing = np.cumsum(rate) / RATE_HZ
        middle = swing[5_000:-5_000]
        assert 30.0 < np.degrees(middle.max() - middle.min()) < 85.0
        assert abs(swing[-1]) < math.radians(8.0)
        assert np.degrees(np.abs(rate)).max() < 500.0
