# SPDX-License-Identifier: MIT
"""A place on a drawing is known in the building as well as the drawing is there."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from echostep.localization import Building, MapFilter, Start, TrackStatus
from echostep.localization.cloud_estimate import weight_about
from echostep.localization.particles.start import DrawnPlaces
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan import Level, Plan, Pose
from echostep.walls.level_sheet import lay_out_levels

ROOM = np.array([[0, 0, 12, 0], [12, 0, 12, 8], [12, 8, 0, 8], [0, 8, 0, 0]], float)
FAR, NEAR = [11.0, 4.0, 0.8], [1.0, 4.0, 0.1]
HERE = Start(Pose(2.0, 4.0, 0.0), 0.05)


def drawing(*places: list[float]) -> Plan:
    """The room, drawn."""
    return Plan("room", (Level("0", 0.0, ROOM, place_sd=np.array(places).reshape(-1, 3)),), None, "")


def filter_on(plan: Plan, start: Start) -> MapFilter:
    laid_out = lay_out_levels(plan)
    drawn = DrawnPlaces(plan.levels)
    return MapFilter(Building(laid_out.walls, laid_out.sheet, drawn), start, 0.0, np.random.default_rng(1))


def step(number: int) -> MeasuredSegment:
    """A step of 10 cm ahead without echoes."""
    segment = PathSegment(float(number), number + 1.0, 0.1, 0.0, 0.0, 0.0, 0.01, 0.001, number)
    return MeasuredSegment(segment, np.zeros(0), np.zeros(0, np.int64), np.zeros(0))


def test_the_worst_of_the_walls_in_hearing_counts_and_else_the_nearest() -> None:
    places = DrawnPlaces(drawing(FAR, NEAR, [2.0, 4.0, 0.3]).levels)
    assert places.sd_m(1.5, 4.0, 0) == 0.3
    assert places.sd_m(11.0, 4.0, 0) == 0.8
    assert places.sd_m(-40.0, 4.0, 0) == 0.1
    assert places.sd_m(1.5, 4.0, 1) == 0.0, "no such level"
    assert not DrawnPlaces(drawing().levels).are_stated


def test_a_start_in_the_building_is_wider_on_the_drawing() -> None:
    places = DrawnPlaces(drawing(NEAR).levels)
    assert places.widened(HERE).sd_m == pytest.approx(math.hypot(0.05, 0.1))
    assert places.widened(Start()) == Start()
    assert DrawnPlaces(drawing().levels).widened(HERE) is HERE


@pytest.mark.parametrize(("sd_m", "status"), [(0.1, TrackStatus.TRACKING), (0.5, TrackStatus.UNCERTAIN)])
def test_tracking_is_claimed_where_the_drawing_allows_it(sd_m: float, status: TrackStatus) -> None:
    """The cloud is as narrow on both drawings; the stated radius holds the drawing's own error."""
    tracked = filter_on(drawing([2.0, 4.0, sd_m]), HERE)
    tracked.cloud.x_m[:], tracked.cloud.y_m[:] = 2.0, 4.0  # as if echoes had gathered it
    e = tracked.update(step(0))
    assert e.status is status
    assert math.sqrt(e.xx_m2) > 0.99 * sd_m
    assert e.protection_m > 3.0 * sd_m


def test_a_plan_that_states_nothing_is_exact() -> None:
    """The same estimates, bit for bit, as of a building without the statement."""
    plan = drawing()
    laid_out = lay_out_levels(plan)
    plain = MapFilter(Building(laid_out.walls, laid_out.sheet), HERE, 0.0, np.random.default_rng(1))
    assert [plain.update(step(k)) for k in range(3)] == [
        other for tracked in [filter_on(plan, HERE)] for other in [tracked.update(step(k)) for k in range(3)]
    ]


def test_a_map_that_may_be_off_makes_small_errors_less_likely() -> None:
    """A particle at the place: by the probability that two dimensions are off by less; at the limit: never."""
    zero, weight = np.zeros(2), np.array([0.5, 0.5])
    cloud: Any = SimpleNamespace(map_x_m=np.array([0.0, 1.0]), y_m=zero, z_m=zero, weight=weight)
    near, about = weight_about(cloud, Pose(0.0, 0.0, 0.0), 0.0, 0.4)
    assert near == pytest.approx(0.5 * (1.0 - math.exp(-0.5 * (1.0 / 0.4) ** 2)))
    assert about == pytest.approx(1.0, abs=1e-6)


def test_no_place_is_in_the_air_of_a_refused_storey() -> None:
    """A wearer who climbs there goes on, though no floor is known."""
    up = Level("1", 3.0, ROOM[:0], doubtful=ROOM, place_sd=np.array([[2.0, 4.0, 1.2]]))
    plan = Plan("two", (drawing([2.0, 4.0, 0.1]).levels[0], up), None, "")
    laid_out = lay_out_levels(plan)
    building = Building(laid_out.walls, laid_out.sheet, DrawnPlaces(plan.levels))
    x = np.array([2.0]) + laid_out.sheet.pitch_m
    assert building.log_loss_in_air(x, np.array([4.0]), 1.0) is None
