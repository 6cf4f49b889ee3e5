# SPDX-License-Identifier: MIT
"""The belief: probabilities as without logarithms, mass that is conserved, and what becomes of clouds."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.localization import Building, CloudSettings, Estimate, FilterSettings, MapFilter, Start, TrackStatus
from echostep.localization.belief import (
    ANOTHER_M,
    BY_CHANCE,
    HERE_M,
    LEAST,
    PLAN_FITS,
    TEMPER,
    Belief,
    CloudHypothesis,
    CrossedWalls,
)
from echostep.localization.grid.search import Search
from echostep.localization.particles.cloud import Cloud, cloud_about
from echostep.localization.particles.start import STATED, wide
from echostep.localization.settings import UNPLANNED_DOOR
from echostep.particles.limits import SURE
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan import Pose
from echostep.walls.echo_sources import Walls
from naive.belief import ANOTHER, ELSEWHERE, THIS, NaiveBelief

ROOM = Building(Walls(np.array([[0, 0, 30, 0], [30, 0, 30, 8], [30, 8, 0, 8], [0, 8, 0, 0]], float)), None)
HERE, THERE = Pose(3.0, 4.0, 0.0), Pose(25.0, 4.0, 0.0)
SMALL = CloudSettings(size=100, largest=1000)
NONE, NO_RANGERS = np.zeros(0), np.zeros(0, np.int64)


def no_cloud() -> Cloud:
    """All of a cloud that a belief looks at."""
    return cast(Cloud, SimpleNamespace(is_searching=False))


def no_search() -> Search:
    """All of a search that a belief looks at."""
    return cast(Search, SimpleNamespace(is_searching=True))


def total(belief: Belief) -> float:
    """The weights of all hypotheses of this building."""
    return math.exp(belief.log_elsewhere) + sum(math.exp(each.log_weight) for each in belief.clouds)


log_ratios = st.floats(-8.0, 8.0)
steps = st.lists(
    st.one_of(
        st.tuples(st.just("weigh"), log_ratios, log_ratios),
        st.tuples(st.just("move"), st.floats(0.0, 60.0), st.just(0.0)),
        st.tuples(st.just("leave"), st.floats(0.0, 0.5), st.just(0.0)),
        st.tuples(st.just("search"), log_ratios, st.just(0.0)),
    ),
    max_size=12,
)


@given(st.floats(0.05, 0.95), st.floats(0.05, 0.95), steps)
def test_probabilities_are_those_without_logarithms(
    prior: float, fits: float, taken: list[tuple[str, float, float]]
) -> None:
    belief, naive = (Belief(no_cloud(), prior, fits), NaiveBelief(prior, fits, {THIS: HERE_M, ANOTHER: ANOTHER_M}))
    for name, one, other in taken:
        if name == "weigh":
            for each, log_ratio in zip(belief.clouds, (one, other), strict=False):
                each.weigh(log_ratio / TEMPER, 0.0)
            belief.judge_plan()
            naive.weigh({"tracked": math.exp(one), "search": math.exp(other)})
        elif name == "move":
            belief.judge_plan(one)
            naive.weigh({}, one)
        elif name == "leave":
            belief.leave(one)
            naive.leave(one)
        else:
            belief.begin_search(no_search(), one / TEMPER)
            naive.begin_search(math.exp(one))
    p = naive.place
    given = belief.plan_fits if belief.plan_fits < SURE else 1.0
    assert math.exp(belief.tracked.log_weight) == pytest.approx(p["tracked"], rel=1e-6)
    assert belief.probability(belief.tracked) == pytest.approx(given * math.exp(belief.tracked.log_weight))
    assert belief.plan_fits == pytest.approx(naive.plan_fits, rel=1e-6)
    assert math.exp(belief.log_elsewhere) == pytest.approx(p[ELSEWHERE], rel=1e-6, abs=1e-300)


@pytest.mark.parametrize(("log_ratio", "is_tracked"), [(-3.0, False), (3.0, True)])
def test_a_place_that_is_found_is_tracked_if_it_is_likelier(log_ratio: float, is_tracked: bool) -> None:
    cloud, search = no_cloud(), no_search()
    belief = Belief(cloud, 0.5, PLAN_FITS)
    belief.begin_search(search, 0.0)
    assert belief.search is not None
    belief.search.weigh(log_ratio / TEMPER, 0.0)
    belief.judge_plan()
    belief.prune()
    assert belief.tracked.cloud is cloud  # a search that has found nothing yet is no place
    found = no_cloud()
    belief.find(belief.search, found)
    assert math.exp(belief.log_elsewhere) == pytest.approx(BY_CHANCE / (1.0 + math.exp(-log_ratio)), rel=1e-6)
    belief.prune()
    assert (belief.tracked.cloud is found) == is_tracked
    assert total(belief) == pytest.approx(1.0)
    belief.merge()
    assert belief.search is None
    assert total(belief) == pytest.approx(1.0)


def test_a_search_that_is_improbable_ends_and_a_cloud_that_is_lets_the_search_be_tracked() -> None:
    for log_ratio, survivor in ((1.1 * math.log(LEAST), 0), (-1.1 * math.log(LEAST), 1)):
        clouds = no_cloud(), no_search()
        belief = Belief(clouds[0], 0.5, PLAN_FITS)
        belief.begin_search(clouds[1], 0.0)
        belief.clouds[1].weigh(log_ratio / TEMPER, 0.0)
        belief.judge_plan()
        belief.prune()
        assert belief.tracked.cloud is clouds[survivor]
        assert belief.search is None
        assert total(belief) == pytest.approx(1.0)


def test_a_new_search_takes_the_place_of_one_that_is_tracked() -> None:
    belief = Belief(no_search(), 0.4, PLAN_FITS)
    begun = no_search()
    belief.begin_search(begun, 0.0)
    assert belief.tracked.cloud is begun
    assert belief.search is None
    assert belief.tracked.log_weight == pytest.approx(0.0)
    assert belief.plan_fits == pytest.approx(PLAN_FITS)


def test_what_is_told_of_a_cloud_says_nothing_of_the_plan() -> None:
    belief = Belief(no_cloud(), 0.3, PLAN_FITS)
    belief.raise_to(belief.tracked, 0.2)
    assert math.exp(belief.tracked.log_weight) == pytest.approx(0.3)
    belief.raise_to(belief.tracked, 0.8)
    assert math.exp(belief.tracked.log_weight) == pytest.approx(0.8)
    assert math.exp(belief.log_elsewhere) == pytest.approx(0.2)
    assert belief.plan_fits == pytest.approx(PLAN_FITS)


def test_a_plan_on_which_nothing_is_explained_is_another_buildings() -> None:
    """However long: the probability stays a number."""
    belief = Belief(no_cloud(), STATED, PLAN_FITS)
    for _ in range(100):
        belief.tracked.weigh(-50.0, -6.0)
        belief.judge_plan(5.0)
        belief.begin_search(no_search(), -50.0)
    assert belief.plan_fits < 1e-6
    assert total(belief) == pytest.approx(1.0)


def test_one_wall_that_was_never_built_costs_its_price_once() -> None:
    walls, at = CrossedWalls(), Pose(3.0, 4.0, 0.0)
    assert [walls.charge(at, 1.0, UNPLANNED_DOOR) for _ in range(3)] == [UNPLANNED_DOOR, 0.0, 0.0]
    assert walls.charge(Pose(3.0, 4.0, 0.0, 1), 1.0, UNPLANNED_DOOR) == UNPLANNED_DOOR
    assert walls.charge(Pose(20.0, 4.0, 0.0), 1.0, UNPLANNED_DOOR) == UNPLANNED_DOOR


def test_a_way_through_a_wall_counts_however_many_strides_it_takes() -> None:
    walls = CrossedWalls()
    charged = [walls.charge(Pose(0.3 * k, 4.0, 0.0), 0.3, 0.3 * UNPLANNED_DOOR) for k in range(6)]
    assert sum(charged) == pytest.approx(0.9 * UNPLANNED_DOOR)


def test_the_edges_of_doors_cost_nothing() -> None:
    walls = CrossedWalls()
    assert [walls.charge(Pose(0.0, 4.0, 0.0), 5.0, math.log(0.7)) for _ in range(20)] == [0.0] * 20
    assert walls.charge(Pose(0.0, 4.0, 0.0), 5.0, math.log(0.1)) == math.log(0.1)


def filter_at(pose: Pose) -> MapFilter:
    return MapFilter(ROOM, Start(pose), 0.0, np.random.default_rng(1), FilterSettings(cloud=SMALL))


def after_a_step(of: MapFilter) -> Estimate:
    """The estimate after a step of 0.1 m without pings."""
    step = PathSegment(0.0, 1.0, 0.1, 0.0, 0.0, 0.0, sd_m=0.01, turn_sd_rad=0.001, step=1, anchor_sd_m=0.0)
    return of.update(MeasuredSegment(step, NONE, NO_RANGERS, NONE))


def with_found(at: Pose, weight: float) -> MapFilter:
    """A filter that tracks HERE, and whose search has found `at` with this weight."""
    two = filter_at(HERE)
    found = cloud_about(SMALL, Start(at, 0.1, 0.05), 0.0, np.random.default_rng(1))
    two.belief.tracked.log_weight = math.log(1.0 - weight)
    two.belief.search = CloudHypothesis(found, math.log(weight))
    two.belief.log_elsewhere = -math.inf
    return two


@pytest.mark.parametrize(("weight", "pose"), [(0.3, HERE), (0.7, THERE)])
def test_of_two_places_the_likelier_is_the_position(weight: float, pose: Pose) -> None:
    two = with_found(THERE, weight)
    estimate = after_a_step(two)
    assert abs(estimate.x_m - pose.x_m) < 0.5
    assert estimate.status is TrackStatus.UNCERTAIN
    assert sorted(round(place.x_m) for place in estimate.hypotheses) == [3, 25]
    assert estimate.hypotheses[0].probability == pytest.approx(0.7, abs=0.02)


def test_a_place_that_is_found_twice_is_one() -> None:
    one = with_found(HERE, 0.5)
    estimate = after_a_step(one)
    assert one.belief.search is None
    assert estimate.right > 0.95


@pytest.mark.parametrize(("fits", "status"), [(PLAN_FITS, TrackStatus.TRACKING), (0.7, TrackStatus.UNCERTAIN)])
def test_a_place_is_as_sure_as_the_plan_that_it_is_on(fits: float, status: TrackStatus) -> None:
    on_it = filter_at(HERE)
    on_it.belief = Belief(on_it.belief.tracked.cloud, 0.999, fits)
    estimate = after_a_step(on_it)
    assert estimate.plan_fits == pytest.approx(fits, abs=0.01)
    assert estimate.right == pytest.approx(0.999 * (fits if fits < SURE else 1.0), abs=0.01)
    assert estimate.status is status


@pytest.mark.parametrize(("start", "status"), [(Start(HERE), TrackStatus.UNCERTAIN), (Start(), TrackStatus.LOST)])
def test_a_cloud_that_is_doubted_is_searched_for_and_not_claimed(start: Start, status: TrackStatus) -> None:
    doubted = filter_at(HERE)
    doubted._way.begin = wide(start)  # as long as all of the way from there is known; then anywhere
    doubted.belief = Belief(doubted.belief.tracked.cloud, 0.2, PLAN_FITS)
    estimate = after_a_step(doubted)
    assert doubted.belief.search is not None
    assert doubted.belief.search.cloud.is_searching
    assert estimate.right < SURE
    assert estimate.status is status


def test_a_wall_that_is_not_there_costs_a_believed_cloud_its_price_once() -> None:
    building = Building(Walls(np.array([[1, -5, 1, 5]], float)), None)
    through = MapFilter(building, Start(Pose(0.0, 0.0, 0.0), 0.01), 0.0, np.random.default_rng(1))
    for values in through.cloud.arrays[:3]:
        values[:] = 0.0
    costs = []
    for k, dx_m in enumerate([2.0, -2.0]):
        through.belief = Belief(through.belief.tracked.cloud, 0.99999, 0.999)
        step = PathSegment(k, k + 1.0, dx_m, 0.0, 0.0, 0.0, sd_m=0.01, turn_sd_rad=0.001, step=k, anchor_sd_m=0.0)
        fits = through.update(MeasuredSegment(step, NONE, NO_RANGERS, NONE)).plan_fits
        costs.append(math.log(fits / (1.0 - fits)) - math.log(0.999 / 0.001))
    assert costs[0] < -4.0
    assert costs[1] == pytest.approx(0.0, abs=0.1)
