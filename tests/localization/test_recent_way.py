# SPDX-License-Identifier: MIT
"""An unknown start in a building whose storeys are alike: each is as probable as the others, until the way tells them apart."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.evaluate.anywhere import sites
from echostep.evaluate.anywhere.walks import SimulatedWalk, simulate
from echostep.localization.recent_way import PAST_M, RecentWay
from echostep.localization.building import Building
from echostep.localization.echo_likelihood import EchoSettings, echo_model
from echostep.localization.estimate import Estimate, TrackStatus
from echostep.localization.filter_settings import FilterSettings
from echostep.localization.map_filter import MapFilter
from echostep.localization.moves import move_of
from echostep.localization.particles import Cloud, CloudSettings
from echostep.localization.start import Air, Start
from echostep.localization.usable_pings import UsablePings
from echostep.path import MeasuredSegment
from echostep.plan.model import Plan
from echostep.simulation.world.tower import STOREY_M, tower
from echostep.walls.level_sheet import lay_out_levels

STOREYS, TRUE = 3, 1
SEED = 5
WALKED_M = 30.0
ECHO = EchoSettings()
MODEL = echo_model(ECHO)


@cache
def walk() -> SimulatedWalk:
    """On level TRUE of the tower."""
    return simulate(sites.one_floor(SEED, TRUE), SEED)


def segments(walked_m: float) -> list[MeasuredSegment]:
    """Those of the first metres of the way."""
    return [m for m in walk().segments if walk().walked_m(np.array([m.segment.t1_s]))[0] < walked_m]


def building(plan: Plan) -> Building:
    laid_out = lay_out_levels(plan)
    return Building(laid_out.walls, laid_out.sheet)


@cache
def different() -> Building:
    """The tower, whose storeys differ by their doors."""
    return building(tower(STOREYS))


@cache
def alike() -> Building:
    """The level of the walk three times."""
    level = tower(STOREYS).levels[TRUE]
    levels = tuple(replace(level, name=str(k), height_m=k * STOREY_M) for k in range(STOREYS))
    return building(replace(tower(STOREYS), levels=levels))


def log_odds(where: Building, walked_m: float = WALKED_M, rise_m: float = 0.0) -> Floats:
    """Of the levels, after a way that ends with a step of this rise, against that of a cloud about its true end on TRUE."""
    way, usable = RecentWay(), UsablePings(where.background(MODEL), ECHO)
    followed = segments(walked_m)
    for measured in followed:
        is_last = measured is followed[-1]
        way.add(move_of(measured.segment), usable.take(measured)[0], rise_m if is_last else 0.0)
    end = followed[-1].segment
    start = Start(replace(walk().pose_at(end.t1_s), level=TRUE), 0.1)
    cloud = Cloud(CloudSettings(), start, end.heading1_rad, np.random.default_rng(1), where.sheet, None, where.floor)
    return way.log_odds(cloud, MODEL, where.walls)


def tracked(where: Building, start: Start, walked_m: float) -> list[Estimate]:
    settings = FilterSettings(cloud=CloudSettings(searching=60_000))
    filtered = MapFilter(where, start, walk().segments[0].segment.heading0_rad, np.random.default_rng(1), settings)
    return [filtered.update(measured) for measured in segments(walked_m)]


def test_levels_that_are_alike_are_equally_probable() -> None:
    assert log_odds(alike()) == pytest.approx([0.0] * STOREYS, abs=1e-9)


def test_doors_tell_levels_apart() -> None:
    found = log_odds(different())
    assert found[TRUE] == 0.0
    assert (np.delete(found, TRUE) < -10.0).all()


def test_on_stairs_a_new_way_begins() -> None:
    assert log_odds(different(), rise_m=0.3) == pytest.approx([0.0] * STOREYS)


def test_a_way_is_no_longer_than_it_says() -> None:
    way, usable = RecentWay(), UsablePings(different().background(MODEL), ECHO)
    for measured in walk().segments:
        way.add(move_of(measured.segment), usable.take(measured)[0], 0.0)
    assert PAST_M - 2.0 < way.length_m <= PAST_M


def test_on_levels_that_are_alike_none_is_tracked_and_all_are_listed() -> None:
    """A coarse cloud's few particles made one of them sure by chance."""
    last = tracked(alike(), Start(), WALKED_M)[-10:]
    assert all(e.status is not TrackStatus.TRACKING for e in last)
    assert all(min(e.levels) > 0.2 for e in last)
    assert all({h.level for h in e.hypotheses} == {0, 1, 2} for e in last)
    true = walk().pose_at(last[-1].t_s)
    assert np.hypot(last[-1].x_m - true.x_m, last[-1].y_m - true.y_m) < 0.5


def test_on_levels_that_differ_the_right_one_is_tracked() -> None:
    last = tracked(different(), Start(), WALKED_M)[-1]
    assert last.level == TRUE
    assert last.levels[TRUE] > 0.99


@pytest.mark.parametrize(
    ("start", "is_open"),
    [
        (Start(), True),
        (Start(level=TRUE), False),
        (Start(air=Air(0.0, 1.0)), False),
        (Start(walk().pose_at(1.0)), False),
    ],
)
def test_a_level_that_is_known_is_not_tried_on_others(start: Start, *, is_open: bool) -> None:
    where = alike()
    cloud = Cloud(CloudSettings(), start, 0.0, np.random.default_rng(1), where.sheet, None, where.floor)
    assert cloud.is_on_any_level == is_open
