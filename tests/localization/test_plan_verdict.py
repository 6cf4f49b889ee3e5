# SPDX-License-Identifier: MIT
"""What is said of a place on a plan that may not be the building's."""

from __future__ import annotations

import numpy as np
import pytest

from echostep.localization.building import Building
from echostep.localization.estimate import SURE, Estimate, TrackStatus
from echostep.localization.filter_settings import FilterSettings
from echostep.localization.map_filter import MapFilter
from echostep.localization.particles import CloudSettings
from echostep.localization.plan_verdict import FOUND_WITHIN_M, PLAN_FITS
from echostep.localization.start import Start
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan.model import Pose
from echostep.walls.echo_sources import Walls

ROOM = Building(Walls(np.array([[0, 0, 12, 0], [12, 0, 12, 8], [12, 8, 0, 8], [0, 8, 0, 0]], float)), None)
NONE, NO_RANGERS = np.zeros(0), np.zeros(0, np.int64)


def after_failed_searches(failed: int, confirmed_m: float = 0.0) -> Estimate:
    """The estimate at the end of a step from a known place, after so many failed searches and so much path of a believed cloud."""
    settings = FilterSettings(cloud=CloudSettings(searching=5_000))
    start = Start(Pose(6.0, 4.0, 0.0), 0.05)
    map_filter = MapFilter(ROOM, start, 0.0, np.random.default_rng(1), settings)
    for _ in range(failed):
        map_filter._plan.fail_search()
    map_filter._plan.confirm(confirmed_m)
    step = PathSegment(0.0, 1.0, 0.1, 0.0, 0.0, 0.0, sd_m=0.01, turn_sd_rad=0.001, step=0, anchor_sd_m=0.0)
    return map_filter.update(MeasuredSegment(step, NONE, NO_RANGERS, NONE))


@pytest.mark.parametrize("failed", [1, 2, 3])
def test_no_place_is_surer_than_the_plan(failed: int) -> None:
    estimate = after_failed_searches(failed)
    assert estimate.plan_fits < SURE
    assert estimate.right <= estimate.plan_fits
    assert estimate.status is not TrackStatus.TRACKING


@pytest.mark.parametrize(("failed", "confirmed_m"), [(0, 0.0), (1, FOUND_WITHIN_M)])
def test_a_plan_that_fits_takes_nothing(failed: int, confirmed_m: float) -> None:
    estimate = after_failed_searches(failed, confirmed_m)
    assert estimate.plan_fits == pytest.approx(PLAN_FITS)
    assert estimate.status is TrackStatus.TRACKING
