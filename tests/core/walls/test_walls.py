# SPDX-License-Identifier: MIT
"""The wall index and the reflectors against slow twins, and by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.walls.echo_sources import Walls, echo_sources, one_receiver
from echostep.walls.index import WallIndex, build_index, crosses_wall, crossings
from echostep.walls.source_blocks import MOST_SOURCES
from echostep.walls.tile_points import CORNER, WALL
from naive import walls as naive

Sources = list[tuple[float, float, float]]


@st.composite
def plans(draw: st.DrawFn) -> tuple[Floats, np.random.Generator]:
    """Walls at random, on a grid (so that they join, overlap and run through each other), square to it, or nearly so."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    count, style = draw(st.integers(0, 30)), draw(st.sampled_from(["free", "grid", "square", "sloppy"]))
    start, way = rng.uniform(0, 8, (count, 2)), rng.uniform(-3, 3, (count, 2))
    if style != "free":
        start, way = np.round(start), np.round(way)
    if style in ("square", "sloppy"):
        way[np.arange(count), rng.integers(0, 2, count)] = 0.0
    walls = np.hstack([start, start + way])
    if style == "sloppy":
        walls += rng.uniform(-0.003, 0.003, walls.shape)
    return walls[np.hypot(*(walls[:, 2:] - walls[:, :2]).T) > 0.1], rng


def heard(x: float, y: float, axis_rad: float, walls: Walls | WallIndex) -> Sources:
    """The sources as rows; an index has to have the table."""
    index = walls.near(np.array([x]), np.array([y])) if isinstance(walls, Walls) else walls
    block, distance_m, off_axis_rad, kind = one_receiver()
    count = echo_sources(x, y, axis_rad, index, block)
    rows = np.column_stack([distance_m, off_axis_rad, kind])[:count].tolist()
    return [(row[0], row[1], row[2]) for row in rows]


def by_kind(sources: Sources) -> list[tuple[float, float]]:
    """Of sources at one distance the order is open."""
    return sorted((round(distance_m, 8), kind) for distance_m, _, kind in sources)


@settings(max_examples=60, deadline=None)
@given(plans(), st.floats(-2, 1.5))
def test_crossing_agrees_with_shapely(plan: tuple[Floats, np.random.Generator], log_length: float) -> None:
    walls, rng = plan
    index = build_index(walls)
    for scattered_m in (1.0, 13.0):  # by the walls around all, and one by one
        a = rng.uniform(-9, 17, 2) + rng.uniform(-1, 1, (20, 2)) * scattered_m
        moves = np.hstack([a, a + rng.uniform(-1, 1, (20, 2)) * 10**log_length])
        expected = [naive.crosses(ax, ay, bx, by, walls) for ax, ay, bx, by in moves.tolist()]
        assert [crosses_wall(ax, ay, bx, by, index) for ax, ay, bx, by in moves.tolist()] == expected
        from_x, from_y, to_x, to_y = moves.T.copy()
        assert crossings(from_x, from_y, to_x, to_y, index).tolist() == expected


@settings(max_examples=100, deadline=None)
@given(plans(), st.booleans())
def test_sources_agree_with_the_slow_twin(plan: tuple[Floats, np.random.Generator], slanted: bool) -> None:
    walls, rng = plan
    owner = Walls(walls, math.radians(4.0) if slanted else 0.0)
    for _ in range(6):
        (x, y), axis = rng.uniform(-2, 10, 2), rng.uniform(-4, 4)
        found, expected = heard(x, y, axis, owner), naive.echo_sources(x, y, axis, walls)[:MOST_SOURCES]
        assert [s[0] for s in found] == pytest.approx([s[0] for s in expected], abs=1e-9)
        assert by_kind(found) == by_kind(expected)
        assert sorted(s[1] for s in found) == pytest.approx(sorted(s[1] for s in expected), abs=1e-7)


CORNER_OF_TWO = np.array([[0.0, 0.0, 4.0, 0.0], [0.0, 0.0, 0.0, 4.0]])


@pytest.mark.parametrize("gap", [0.0, 0.004, -0.004])
def test_walls_that_continue_each_other_have_no_edge(gap: float) -> None:
    walls = Walls(np.array([[-5.0, 2.0, 0.0, 2.0], [gap, 2.0, 5.0, 2.0]]))
    assert all(kind == WALL for _, _, kind in heard(0.1, 0.0, math.pi / 2, walls))


@pytest.mark.parametrize("overshoot", [0.0, 0.004, -0.004])
def test_a_wall_that_ends_on_another_is_heard_from_its_side_alone(overshoot: float) -> None:
    walls = Walls(np.array([[-5.0, 2.0, 5.0, 2.0], [0.0, 6.0, 0.0, 2.0 - overshoot]]))
    assert [kind for _, _, kind in heard(0.3, 0.0, math.pi / 2, walls)] == [WALL]
    assert CORNER in [kind for _, _, kind in heard(0.5, 4.0, -math.pi / 2, walls)]


OFF_THE_PLAN = [(1e9, 0.0), (math.nan, 0.0), (0.0, math.inf), (-1e300, 1e300), (math.nan, math.nan)]


@pytest.mark.parametrize("point", OFF_THE_PLAN)
def test_places_off_the_plan_hear_nothing(point: tuple[float, float]) -> None:
    walls = Walls(CORNER_OF_TWO)
    index = walls.near(np.array([point[0]]), np.array([point[1]]))
    assert heard(*point, 0.0, index) == []
    if abs(point[0]) < 1e10:
        assert not crosses_wall(*point, 2.0, 1.0, index)
        assert not crosses_wall(2.0, 1.0, *point, index)
    assert heard(1.0, 1.0, math.nan, index) == []


def test_walls_without_length_change_nothing() -> None:
    points = np.array([[1.0, 0.5, 1.0, 0.5], [math.nan, 0.0, 1.0, 1.0], [0.0, 0.0, math.inf, 0.0]])
    walls = Walls(np.vstack([CORNER_OF_TWO, points]))
    assert heard(1.0, 1.0, -math.pi / 2, walls) == heard(1.0, 1.0, -math.pi / 2, Walls(CORNER_OF_TWO)) != []
    assert not crosses_wall(1.0, 0.2, 1.0, 0.8, walls.index)


def test_tables_of_many_tiles_stay_right() -> None:
    rng = np.random.default_rng(5)
    walls = np.hstack([(start := rng.uniform(0, 20, (60, 2))), start + rng.uniform(-3, 3, (60, 2))])
    owner = Walls(walls)
    for _ in range(20):
        x, y = rng.uniform(0, 20, (2, 10))
        owner.near(x, y, 0.7)
    for x, y, axis in zip(*rng.uniform(0, 20, (2, 300)), rng.uniform(-3, 3, 300), strict=True):
        assert heard(x, y, axis, owner) == heard(x, y, axis, Walls(walls))


def test_an_index_given_out_before_stays_right() -> None:
    rng = np.random.default_rng(6)
    walls = np.hstack([(start := rng.uniform(0, 20, (60, 2))), start + rng.uniform(-3, 3, (60, 2))])
    owner = Walls(walls)
    old = owner.near(np.array([3.0]), np.array([3.0]), 2.0)
    owner.near(*rng.uniform(0, 20, (2, 200)))
    for x, y, axis in zip(*rng.uniform(1, 5, (2, 100)), rng.uniform(-3, 3, 100), strict=True):
        assert heard(x, y, axis, old) == heard(x, y, axis, owner)
    with pytest.raises(LookupError, match="no table"):
        heard(12.0, 12.0, 0.0, old)


def test_a_plan_in_millimetres_is_refused() -> None:
    with pytest.raises(EchostepError, match="metres"):
        build_index(np.array([[0.0, 0.0, 90_000.0, 0.0], [0.0, 0.0, 0.0, 90_000.0]]))
