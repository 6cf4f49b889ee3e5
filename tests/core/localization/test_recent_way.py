# SPDX-License-Identifier: MIT
"""A search in a building whose storeys are alike, and its second pass along the way: levels are as probable as the echoes make them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.echoes.likelihood import EchoSettings, echo_model
from echostep.echoes.unplanned import UsablePings
from echostep.height.levels import Air
from echostep.localization import Building, CloudSettings, Estimate, MapFilter, Start, TrackStatus
from echostep.localization.motion import height_change, move_of
from echostep.localization.particles.cloud import PASSING, cloud_about
from echostep.localization.window import MOST_PIECES, PAST_M, RecentWay
from echostep.particles.arrays import Move
from echostep.particles.limits import BELIEVED
from echostep.path import MeasuredSegment
from echostep.plan import Plan, Pose
from echostep.ports.chunks import portion_of
from echostep.tracker import Tracker
from echostep.walls.level_sheet import lay_out_levels
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.people.walker import Person
from echostep_simulation.scenario import Scenario
from echostep_simulation.world.tower import STOREY_M, tower

pytestmark = pytest.mark.slow

STOREYS, TRUE, WRONG = 3, 1, 2
SEED = 5
WALKED_M = 30.0
ECHO, SETTINGS = EchoSettings(), CloudSettings()
MODEL = echo_model(ECHO)
ANYWHERE = Start()
TOUR = (
    (1.49, 4.07), (3.17, 3.42), (3.63, 2.67), (25.2, 1.31), (3.47, 2.67), (3.37, 5.87), (3.47, 2.67), (24.47, 0.27),
    (24.33, -1.23), (23.34, -2.34), (24.47, -0.33), (24.47, 0.27), (20.72, 2.0), (5.19, 0.89),
)  # fmt: skip


class Walk(NamedTuple):
    """`segments` as the filter gets them; `truth` (n, 5): t_s, x, y, heading, height of the floor."""

    segments: list[MeasuredSegment]
    truth: Floats


@cache
def walk() -> Walk:
    """On level TRUE of the tower, which is all there is of it."""
    level = replace(tower(STOREYS).levels[TRUE], height_m=0.0)
    plan = replace(tower(STOREYS), levels=(level,), connectors=(), start=None)
    scenario = Scenario(plan, TOUR, SEED, PythonBoard(SEED), Person(corner_m=0.3))
    pieces = Tracker(plan, waits=True).front_end.process(portion_of(list(scenario.chunks())))
    return Walk([piece for piece in pieces if isinstance(piece, MeasuredSegment)], scenario.truth)


def segments(walked_m: float) -> list[MeasuredSegment]:
    """Those of the first metres of the way."""
    t_s, x, y, _, _ = walk().truth.T
    way_m = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    return [m for m in walk().segments if np.interp(m.segment.t1_s, t_s, way_m) < walked_m]


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


def way_in(where: Building, walked_m: float = WALKED_M) -> RecentWay:
    way, usable = RecentWay(Start(), 0.0), UsablePings(where.background(MODEL), ECHO)
    for measured in segments(walked_m):
        way.add(move_of(measured.segment), usable.take(measured)[0], height_change(measured, 0.0))
    return way


def true_end(level: int) -> tuple[Pose, float]:
    """True pose at the end of the way, on this level, and the trunk's heading in the walk frame."""
    last = segments(WALKED_M)[-1].segment
    t_s, x, y, heading, _ = walk().truth.T
    x_m, y_m, heading_rad = (float(np.interp(last.t1_s, t_s, values)) for values in (x, y, np.unwrap(heading)))
    return Pose(x_m, y_m, heading_rad, level), last.heading1_rad


def level_shares(where: Building, start: Start = ANYWHERE) -> list[float]:
    """Probability of each level after the second pass of a cloud that has gathered at the true place, but on level WRONG; `start`: of the search."""
    pose, walk_heading_rad = true_end(WRONG)
    rng = np.random.default_rng(1)
    cloud = cloud_about(SETTINGS, Start(pose, 0.2), walk_heading_rad, rng, where.sheet, None, where.floor)
    cloud.is_on_any_level = start.is_on_any_level
    way_in(where).pass_again(cloud, MODEL, where.walls)
    assert (len(cloud.x_m) <= PASSING) == cloud.is_on_any_level
    true, _ = true_end(TRUE)
    assert np.hypot(cloud.weight @ cloud.map_x_m - true.x_m, cloud.weight @ cloud.y_m - true.y_m) < 0.3
    return np.bincount(cloud.level, cloud.weight, STOREYS).tolist()


def tracked(where: Building, seed: int = 1) -> list[Estimate]:
    """Estimates from an unknown start."""
    filtered = MapFilter(where, Start(), walk().segments[0].segment.heading0_rad, np.random.default_rng(seed))
    return [filtered.update(measured) for measured in segments(WALKED_M)]


def test_levels_that_are_alike_are_about_as_probable_after_the_second_pass() -> None:
    assert level_shares(alike()) == pytest.approx([1.0 / STOREYS] * STOREYS, abs=0.25)


def test_doors_tell_the_true_level_by_the_second_pass() -> None:
    assert level_shares(different())[TRUE] > BELIEVED


@pytest.mark.parametrize("start", [Start(level=WRONG), Start(air=Air(0.0, 1.0))])
def test_a_level_that_is_known_stays(start: Start) -> None:
    assert level_shares(alike(), start)[WRONG] == pytest.approx(1.0)


def test_the_way_has_a_bound() -> None:
    assert PAST_M - 2.0 < way_in(different(), 1000.0).length_m <= PAST_M


def test_standing_does_not_lengthen_the_way_for_ever() -> None:
    way, standing = way_in(different(), 3.0), walk().segments[0]
    pings = UsablePings(different().background(MODEL), ECHO).take(standing)[0]
    for _ in range(MOST_PIECES + 10):
        way.add(Move(0.0, 0.0, 0.0, 0.0), pings, height_change(standing, 0.0))
    assert len(way) == MOST_PIECES


def test_on_levels_that_are_alike_none_is_tracked_and_all_are_listed() -> None:
    """A coarse cloud's few particles made one of them sure by chance. The share of one level in one draw is 0.09 to 0.5."""
    last = [e for seed in range(1, 4) for e in tracked(alike(), seed)[-10:]]
    assert all(e.status is not TrackStatus.TRACKING for e in last)
    assert np.mean([e.levels for e in last], axis=0).min() > 0.1
    assert all({h.level for h in e.hypotheses} == {0, 1, 2} for e in last)
    true, _ = true_end(TRUE)
    assert np.hypot(last[-1].x_m - true.x_m, last[-1].y_m - true.y_m) < 0.5


def test_on_levels_that_differ_the_right_one_is_tracked() -> None:
    last = tracked(different())[-1]
    assert (last.level, last.status) == (TRUE, TrackStatus.TRACKING)
