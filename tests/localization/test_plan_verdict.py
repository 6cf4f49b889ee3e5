# SPDX-License-Identifier: MIT
"""Whether the plan fits, and what is said of a place on a plan that may not."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from echostep.localization.belief import ALIKE_M, EARLY_M, FAILS, PLAN_FITS, START_ERROR_M, PlanVerdict
from echostep.localization.building import Building
from echostep.localization.estimate import SURE, Estimate, TrackStatus
from echostep.localization.map_filter import MapFilter
from echostep.localization.particles.start import Start
from echostep.localization.settings import UNPLANNED_DOOR, FilterSettings
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan.model import Pose
from echostep.walls.echo_sources import Walls

ROOM = Building(Walls(np.array([[0, 0, 12, 0], [12, 0, 12, 8], [12, 8, 0, 8], [0, 8, 0, 0]], float)), None)
NONE, NO_RANGERS = np.zeros(0), np.zeros(0, np.int64)
WALL = Pose(3.0, 4.0, 0.0)
BEFORE = 6.0  # log-odds of a believed cloud


def after_failed_searches(failed: int, confirmed_m: float = 0.0) -> Estimate:
    """The estimate at the end of a step from a known place, after so many failed searches and so much path of a believed cloud."""
    start = Start(Pose(6.0, 4.0, 0.0), 0.05)
    map_filter = MapFilter(ROOM, start, 0.0, np.random.default_rng(1), FilterSettings())
    for _ in range(failed):
        map_filter._plan.fail_search()
    map_filter._plan.confirm(confirmed_m)
    step = PathSegment(0.0, 1.0, 0.1, 0.0, 0.0, 0.0, sd_m=0.01, turn_sd_rad=0.001, step=0, anchor_sd_m=0.0)
    return map_filter.update(MeasuredSegment(step, NONE, NO_RANGERS, NONE))


@pytest.mark.parametrize("failed", [1, 2, 3])
def test_a_place_is_as_sure_as_the_plan_that_it_is_on(failed: int) -> None:
    estimate = after_failed_searches(failed)
    assert estimate.plan_fits < SURE
    assert estimate.right < estimate.plan_fits
    assert estimate.status is not TrackStatus.TRACKING


@pytest.mark.parametrize(("failed", "confirmed_m"), [(0, 0.0), (1, -ALIKE_M * math.log(FAILS))])
def test_a_plan_that_fits_takes_nothing(failed: int, confirmed_m: float) -> None:
    estimate = after_failed_searches(failed, confirmed_m)
    assert estimate.plan_fits == pytest.approx(PLAN_FITS)
    assert estimate.status is TrackStatus.TRACKING


@pytest.mark.parametrize(
    ("after_m", "away_m", "fits"), [(10.0, 1.0, True), (10.0, 2 * START_ERROR_M, False), (30.0, 1.0, False)]
)
def test_a_start_that_was_a_little_wrong_says_nothing_of_the_plan(after_m: float, away_m: float, fits: bool) -> None:
    verdict = PlanVerdict()
    verdict.reject_start(0.5 * EARLY_M)
    rejected = verdict.probability
    verdict.find(after_m, away_m)
    assert rejected < SURE
    if fits:
        assert verdict.probability == pytest.approx(PLAN_FITS)
    else:
        assert 0.5 < verdict.probability < rejected


@pytest.mark.parametrize("reject", [PlanVerdict.reject_start, PlanVerdict.reject_found])
def test_a_cloud_that_was_right_after_all_says_nothing_of_the_plan(
    reject: Callable[[PlanVerdict, float], None],
) -> None:
    verdict = PlanVerdict()
    reject(verdict, 0.5 * EARLY_M)
    assert verdict.probability < SURE
    for _ in range(3):
        verdict.agree()
    assert verdict.probability == pytest.approx(PLAN_FITS)


def test_a_late_rejection_takes_nothing() -> None:
    verdict = PlanVerdict()
    verdict.reject_found(2.0 * EARLY_M)
    verdict.agree()
    assert verdict.probability == pytest.approx(PLAN_FITS)


def test_one_wall_that_was_never_built_leaves_a_confirmed_plan_sure() -> None:
    verdict = PlanVerdict()
    verdict.confirm(1_000.0)
    told = [verdict.pass_walls(WALL, 1.0, UNPLANNED_DOOR) for _ in range(3)]
    assert told == [UNPLANNED_DOOR, 0.0, 0.0]
    assert verdict.probability > SURE
    verdict.pass_walls(Pose(20.0, 4.0, 0.0), 1.0, UNPLANNED_DOOR)
    assert verdict.probability < SURE


def test_a_way_through_a_wall_counts_however_many_strides_it_takes() -> None:
    verdict = PlanVerdict()
    for k in range(4):
        verdict.pass_walls(Pose(0.3 * k, 4.0, 0.0), 0.3, 0.3 * UNPLANNED_DOOR)
    assert verdict.probability < PLAN_FITS


def test_the_edges_of_doors_are_no_walls_gone_through() -> None:
    verdict = PlanVerdict()
    for k in range(20):
        verdict.pass_walls(Pose(5.0 * k, 4.0, 0.0), 5.0, math.log(0.1))
    assert verdict.probability == pytest.approx(PLAN_FITS)


def test_a_wall_that_is_not_there_costs_its_price_once() -> None:
    building = Building(Walls(np.array([[1, -5, 1, 5]], float)), None)
    map_filter = MapFilter(building, Start(Pose(0.0, 0.0, 0.0), 0.01), 0.0, np.random.default_rng(1))
    for values in map_filter.cloud.arrays[:3]:
        values[:] = 0.0
    map_filter.tracked.has_contracted = True
    costs = []
    for k, dx_m in enumerate([2.0, -2.0]):
        map_filter.tracked.plausibility.log_odds = BEFORE
        step = PathSegment(k, k + 1.0, dx_m, 0.0, 0.0, 0.0, sd_m=0.01, turn_sd_rad=0.001, step=k, anchor_sd_m=0.0)
        map_filter.update(MeasuredSegment(step, NONE, NO_RANGERS, NONE))
        costs.append(BEFORE - map_filter.tracked.plausibility.log_odds)
    assert costs == pytest.approx([-UNPLANNED_DOOR, 0.0], abs=0.3)


def test_a_plan_that_states_an_error_is_charged_less_for_a_wall() -> None:
    exact, inexact = PlanVerdict(), PlanVerdict(plan_sd_m=0.1)
    for verdict in (exact, inexact):
        verdict.pass_walls(WALL, 1.0, UNPLANNED_DOOR)
    assert exact.probability < inexact.probability < PLAN_FITS
    assert inexact.probability > SURE
