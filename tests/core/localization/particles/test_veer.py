# SPDX-License-Identifier: MIT
"""A path that turns on each metre of a straight way, as by unequal wheels: the cloud learns by how much, if it is told that there may be a bias."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.localization import Building, CloudSettings, FilterSettings, MapFilter, Start
from echostep.localization.grid.search import Search
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan import Pose
from echostep.walls.echo_sources import Walls

VEER_DEG, STEP_M, WAY_M = 3.0, 0.5, 40
START = Pose(1.0, 1.2, 0.0)
CORRIDOR = Building(Walls(np.array([[0, 0, 60, 0], [60, 0, 60, 2], [60, 2, 0, 2], [0, 2, 0, 0]], float)), None)


def segments() -> list[MeasuredSegment]:
    """Straight along the corridor; the path turns to the left by VEER_DEG on each metre, and states a hundredth of that as chance."""
    found, heading, turn = [], 0.0, math.radians(VEER_DEG) * STEP_M
    for k in range(round(WAY_M / STEP_M)):
        middle = heading + 0.5 * turn
        segment = PathSegment(
            float(k), k + 1.0, STEP_M * math.cos(middle), STEP_M * math.sin(middle), heading, heading + turn,
            sd_m=0.01, turn_sd_rad=math.radians(0.1), step=k,
        )  # fmt: skip
        ranges: Floats = np.array([2.0 - START.y_m, START.y_m])
        found.append(MeasuredSegment(segment, np.array([k + 0.5, k + 0.5]), np.array([0, 1]), ranges))
        heading += turn
    return found


def headings_deg(veer_sd_deg: float) -> Floats:
    """Estimated headings on the last quarter of the way; truly 0."""
    settings = FilterSettings(cloud=CloudSettings(start_veer_sd_deg=veer_sd_deg))
    tracked = MapFilter(CORRIDOR, Start(START), 0.0, np.random.default_rng(1), settings)
    every = [tracked.update(measured) for measured in segments()]
    veer = tracked.belief.tracked.cloud.veer_rad_m
    assert np.degrees(veer.mean()) == pytest.approx(-VEER_DEG if veer_sd_deg else 0.0, abs=0.5)
    return np.degrees([e.heading_rad for e in every[3 * len(every) // 4 :]])


def test_a_bias_is_learnt_by_the_walls() -> None:
    assert np.abs(headings_deg(2.0)).mean() < 2.0


@pytest.mark.slow
def test_without_a_prior_of_one_the_heading_lags() -> None:
    assert np.abs(headings_deg(0.0)).mean() > 3.0


def test_a_search_that_has_found_a_place_learns_one() -> None:
    settings = FilterSettings(cloud=CloudSettings(start_veer_sd_deg=2.0))
    found = MapFilter(CORRIDOR, Start(), 0.0, np.random.default_rng(1), settings)
    assert isinstance(found.cloud, Search)
    found.cloud.grid.begin_about(np.array([START.x_m]), np.array([START.y_m]), np.array([0.01]), 1.0)
    found.update(segments()[0])
    assert not found.cloud.is_searching
    assert np.degrees(found.cloud.veer_rad_m.std()) > 1.0
