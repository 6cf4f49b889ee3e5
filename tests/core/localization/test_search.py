# SPDX-License-Identifier: MIT
"""A search of the building: which pings it takes, when it has found a place, and when it is begun anew."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.echoes.range_table import AFTER_ECHO, AFTER_SILENCE, INDEPENDENT_M, USED_M, TablePings
from echostep.localization import Building, MapFilter, Start
from echostep.localization.grid.search import FOUND_REST, Search
from echostep.particles.arrays import PingBatch
from echostep.path import UNOBSERVED_SD_M, MeasuredSegment, PathSegment
from echostep.walls.echo_sources import Walls

NONE, NO_RANGERS = np.zeros(0), np.zeros(0, np.int64)
ROOM = Building(Walls(np.array([[0, 0, 12, 0], [12, 0, 12, 8], [12, 8, 0, 8], [0, 8, 0, 0]], float)), None)


def pings(range_m: float, count: int, travel_m: float = 1.0) -> PingBatch:
    """So many of ranger 0 at the beginning, all with this range (0: silent) and way since the one before."""
    one = np.ones(count)
    travels = travel_m * one
    return PingBatch(0.0 * one, one, range_m * one, one, np.zeros(count, np.int64), travels, one, 0.0 * one, one, one)


def gather(search: Search, share: float) -> None:
    """Give this share of the weight to the middle of the room, and the rest to all of it."""
    there = np.full(50, 6.05), np.full(50, 4.05), np.linspace(0.0, 6.2, 50)
    search.begin_about(*there, share)


def searching(map_filter: MapFilter) -> Search:
    search = map_filter.belief.tracked.cloud
    assert isinstance(search, Search)
    return search


def test_a_ping_counts_by_the_way_since_the_one_before() -> None:
    used, powers = TablePings(), []
    for way_m in (0.0, 0.5 * INDEPENDENT_M, 3.0 * INDEPENDENT_M):
        ping = used.take(pings(1.2, 1, way_m), 0, is_straight=True)
        assert ping is not None
        powers.append(ping.power)
    assert powers == pytest.approx([1.0, 0.5, 1.0])


def test_pings_from_nearly_one_place_are_used_once() -> None:
    used, three = TablePings(), pings(1.2, 3, 0.6 * USED_M)
    assert [used.take(three, k, is_straight=True) is not None for k in range(3)] == [True, False, True]


def test_pings_in_a_turn_are_left_to_the_way_after_it() -> None:
    used, three = TablePings(), pings(1.2, 3, USED_M)
    found = [used.take(three, k, is_straight=k != 1) for k in range(3)]
    assert found[1] is None
    assert found[2] is not None
    assert found[2].power == pytest.approx(2.0 * USED_M / INDEPENDENT_M)


def test_a_ping_knows_whether_that_before_it_was_silent() -> None:
    used, after = TablePings(), []
    for range_m in (0.0, 1.2, 0.0, 0.0):
        ping = used.take(pings(range_m, 1), 0, is_straight=True)
        assert ping is not None
        after.append(ping.after)
    assert after == [AFTER_SILENCE, AFTER_SILENCE, AFTER_ECHO, AFTER_SILENCE]


@pytest.mark.parametrize(("share", "is_searching"), [(0.8, True), (1.0 - 0.3 * FOUND_REST, False)])
def test_a_search_is_over_when_nearly_all_of_its_weight_is_in_one_place(share: float, is_searching: bool) -> None:
    search = searching(MapFilter(ROOM, Start(), 0.0, np.random.default_rng(1)))
    gather(search, share)
    found = search.found()
    assert (found is None) == is_searching
    shown = found or search.particles
    near = np.hypot(shown.x_m - 6.05, shown.y_m - 4.05) < 0.5
    assert float(shown.weight @ near) == pytest.approx(share, abs=0.02)


def test_particles_show_a_search_as_it_is_weighed() -> None:
    """As a meeting does."""
    search = searching(MapFilter(ROOM, Start(), 0.0, np.random.default_rng(1)))
    assert len(search.states.x_m) == len(search)
    search.reweight(np.where(search.states.x_m < 6.0, -3.0, 0.0))
    assert search.found() is None
    east = float(search.particles.weight @ (search.particles.x_m > 6.0))
    assert east == pytest.approx(1.0 / (1.0 + math.exp(-3.0)), abs=0.02)


def test_a_search_turns_with_the_walk_frame() -> None:
    """Straight ahead is where it was on the map, and so is the heading."""
    map_filter = MapFilter(ROOM, Start(), 0.0, np.random.default_rng(1))
    searching(map_filter).begin_about(np.full(9, 6.05), np.full(9, 4.05), np.full(9, 0.1), 1.0)
    map_filter.turn_walk_frame(0.5 * math.pi)
    map_filter.update(MeasuredSegment(a_step(0.0, -1.0), NONE, NO_RANGERS, NONE))
    place = map_filter.cloud
    assert float(place.weight @ place.x_m) == pytest.approx(7.05, abs=0.15)
    assert float(place.weight @ place.turn_rad) == pytest.approx(0.1 + 0.5 * math.pi, abs=0.1)


def a_step(dx_m: float, dy_m: float, k: int = 0) -> PathSegment:
    return PathSegment(k, k + 1.0, dx_m, dy_m, 0.0, 0.0, sd_m=0.01, turn_sd_rad=0.001, step=k, anchor_sd_m=0.0)


def test_a_search_that_has_left_all_ground_begins_anew() -> None:
    map_filter = MapFilter(ROOM, Start(), 0.0, np.random.default_rng(1))
    map_filter.update(MeasuredSegment(a_step(60.0, 0.0), NONE, NO_RANGERS, NONE))
    assert np.isfinite(map_filter.cloud.x_m).all()
    inside = (map_filter.cloud.x_m > 0.0) & (map_filter.cloud.x_m < 12.0)
    assert inside.mean() > 0.9


def test_a_search_that_moves_unobserved_begins_about_where_it_was() -> None:
    search = searching(MapFilter(ROOM, Start(), 0.0, np.random.default_rng(1)))
    gather(search, 0.9)
    step = PathSegment(0.0, 2.0, 0.0, 0.0, 0.0, 0.0, sd_m=1.1 * UNOBSERVED_SD_M, turn_sd_rad=0.1, step=0)
    assert step.unobserved
    after = MapFilter(ROOM, Start(), 0.0, np.random.default_rng(1))
    after.belief.tracked.cloud = search
    after.update(MeasuredSegment(step, NONE, NO_RANGERS, NONE))
    cloud = search.particles
    assert search.found() is None
    assert 0.5 < float(cloud.weight @ (np.hypot(cloud.x_m - 6.05, cloud.y_m - 4.05) < 3.0 * step.sd_m)) < 0.95


def test_a_search_in_a_room_begins_there() -> None:
    outline = np.array([[0, 0], [6, 0], [6, 8], [0, 8]], float)
    search = searching(MapFilter(ROOM, Start(room_m=outline), 0.0, np.random.default_rng(1)))
    assert search.draw(1000).x_m.max() < 6.3
