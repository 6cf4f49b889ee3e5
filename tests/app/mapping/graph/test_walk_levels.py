# SPDX-License-Identifier: MIT
"""Walks over stairs: each level is drawn, and the stairs that join them (simulated)."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan import Plan, parse_plan
from echostep_app.mapping.graph.levels import BETWEEN, find_levels
from echostep_app.mapping.graph.nodes import nodes_of
from echostep_app.mapping.mapper import Mapped, map_walk
from echostep_app.mapping.picture import draw_picture
from echostep_app.mapping.plan import Walked, plan_of
from echostep_app.plan.check import check_plan
from echostep_app.plan.writer import plan_json
from echostep_simulation.people.walker import Waypoint
from echostep_simulation.world.tower import CORRIDOR_Y, STOREY_M, stairs_from, tower
from echostep_studies.bench.sites import Site
from echostep_studies.bench.tours import clearance_m
from echostep_studies.bench.walks import SimulatedWalk, simulate

pytestmark = pytest.mark.slow

NO_PINGS = (np.zeros(0), np.zeros(0, np.int64), np.zeros(0))


def up_and_down() -> tuple[Waypoint, ...]:
    """Along the lowest corridor and back, up, the same there, down again, and along the lowest corridor."""
    way: list[Waypoint] = [(2.0, CORRIDOR_Y, 0.0, 0.0), (25.0, CORRIDOR_Y, 0.0, 0.0), (1.0, CORRIDOR_Y, 0.0, 0.0)]
    way += [*stairs_from(0, up=True), (25.0, CORRIDOR_Y, 0.0, STOREY_M), (1.0, CORRIDOR_Y, 0.0, STOREY_M)]
    down = [*reversed(stairs_from(0, up=True)[:-1]), (1.0, CORRIDOR_Y, 0.0, 0.0)]
    return (*way, *down, (20.0, CORRIDOR_Y, 0.0, 0.0))


@pytest.fixture(scope="module")
def walk() -> SimulatedWalk:
    """Two levels of the tower."""
    return simulate(Site(tower(2), up_and_down()), 7)


@pytest.fixture(scope="module")
def mapped(walk: SimulatedWalk) -> Mapped:
    """The same, drawn."""
    return map_walk(walk.segments)


@pytest.fixture(scope="module")
def drawn(walk: SimulatedWalk, mapped: Mapped) -> tuple[Plan, Walked]:
    """The plan of it."""
    return plan_of(mapped, walk.pose_at(walk.segments[0].segment.t0_s), "tower")


@pytest.mark.long
def test_each_level_has_its_walls(drawn: tuple[Plan, Walked]) -> None:
    plan, _ = drawn
    assert [level.name for level in plan.levels] == ["0", "1"]
    assert plan.levels[1].height_m == pytest.approx(STOREY_M, abs=0.3)
    for level, built in zip(plan.levels, tower(2).levels, strict=True):
        heard = level.walls[level.walls[:, [0, 2]].mean(1) > 2.0]  # without the well's, which are drawn about the path
        length = np.hypot(*(heard[:, 2:] - heard[:, :2]).T)
        assert length.sum() > 25.0
        assert np.quantile(away_m(heard, built.walls), 0.8) < 0.35


def away_m(walls: Floats, true: Floats) -> Floats:
    """Distance of eleven places on each wall from the nearest true one."""
    shares = np.linspace(0.0, 1.0, 11)[:, None, None]
    points = (walls[:, :2] + shares * (walls[:, 2:] - walls[:, :2])).reshape(-1, 2)
    return np.array([clearance_m(x, y, true) for x, y in points.tolist()])


def test_the_stairs_join_them_and_the_check_finds_nothing_wrong(drawn: tuple[Plan, Walked], tmp_path: Path) -> None:
    """Up and down is one stairs, in the stairwell; the plan is one that is read back."""
    plan, walked = drawn
    (stairs,) = plan.connectors
    assert stairs.levels == (0, 1)
    x, y = stairs.outline_m.mean(axis=0)
    assert -4.5 < x < 0.5
    assert 0.0 < y < 3.0
    assert check_plan(plan) == []
    read = parse_plan(plan_json(plan).encode())
    assert [len(level.walls) for level in read.levels] == [len(level.walls) for level in plan.levels]
    draw_picture(tmp_path / "levels.png", plan, walked)
    assert (tmp_path / "levels.png").stat().st_size > 1000


def test_no_return_joins_two_levels(mapped: Mapped) -> None:
    """The corridors are alike and above each other; coming down again is a return to the lower one."""
    levels = mapped.graph.levels
    assert levels is not None
    pairs = [(int(levels.of[c.old]), int(levels.of[c.new])) for c in mapped.graph.closures]
    assert pairs
    assert all(old == new for old, new in pairs)


def test_walls_of_the_stairwell_hold_the_path_over_the_stairs(mapped: Mapped) -> None:
    """Each way over the stairs hears walls, which are of no level and of no other way."""
    graph, levels = mapped.graph, mapped.graph.levels
    assert levels is not None
    place = levels.with_flights
    assert (place[levels.of != BETWEEN] == levels.of[levels.of != BETWEEN]).all()
    assert np.unique(place).tolist() == [0, 1, 2, 3]
    node, wall = graph.fragments.node, graph.walls.of
    for flight in (2, 3):
        heard = wall[(place[node] == flight) & (wall >= 0)]
        assert len(heard) > 5
        assert not np.isin(heard, wall[place[node] != flight]).any()


def stepped(rises: Floats, *, foot: bool = True) -> list[MeasuredSegment]:
    """Steps of 0.7 m that climb by so much each; without a foot the height is known by pressure, to 0.3 m."""
    rng, segments, height = np.random.default_rng(1), [], 0.0
    for k, rise in enumerate(rises.tolist()):
        height += rise
        s = PathSegment(0.6 * k, 0.6 * (k + 1), 0.7, 0.0, 0.0, 0.0, 0.02, 0.001, k)
        felt = rise + 0.01 * rng.standard_normal()
        s = replace(s, rise_m=felt, rise_sd_m=0.02) if foot else s
        heard = 100.0 + height + 0.3 * rng.standard_normal(5)
        segments.append(MeasuredSegment(s, *NO_PINGS, heard))
    return segments


@pytest.mark.parametrize("foot", [True, False])
def test_levels_are_told_apart_by_the_climb(foot: bool) -> None:
    """Up two levels by a landing each, down one: three levels, one of them twice."""
    flat, flight, landing = np.zeros(40), np.full(4, 0.42), np.zeros(2)
    up = np.concatenate([flight, landing, flight])
    segments = stepped(np.concatenate([flat, up, flat, up, flat, -up, flat]), foot=foot)
    nodes, _ = nodes_of(segments)
    levels = find_levels(segments, nodes)
    assert levels is not None
    assert levels.height_m == pytest.approx([0.0, 3.36, 6.72], abs=0.4)
    on_level = levels.of[levels.of != BETWEEN]
    assert on_level[np.flatnonzero(np.diff(on_level, prepend=-2))].tolist() == [0, 1, 2, 1]
    assert np.mean(levels.of == BETWEEN) < 0.25
    assert [sorted((int(levels.of[a]), int(levels.of[b]))) for a, b in levels.stairs] == [[0, 1], [1, 2], [1, 2]]


def test_sills_ramps_and_drift_are_no_levels() -> None:
    """A few steps up and down, a ramp of 6 %, and 1 cm of error in each step for 200 m."""
    steps = np.concatenate([np.zeros(20), np.full(3, 0.17), np.zeros(20), np.full(3, -0.17), np.zeros(20)])
    ramp = np.concatenate([np.full(30, 0.042), np.zeros(20)])
    for rises in (steps, ramp, np.full(280, 0.01), np.zeros(0)):
        segments = stepped(np.concatenate([np.zeros(20), rises]))
        assert find_levels(segments, nodes_of(segments)[0]) is None


def test_pressure_alone_that_no_board_sends_is_one_level() -> None:
    segments = [replace(m, height_m=np.zeros(0)) for m in stepped(np.full(60, 0.4), foot=False)]
    assert math.isinf(segments[0].segment.rise_sd_m)
    assert find_levels(segments, nodes_of(segments)[0]) is None
