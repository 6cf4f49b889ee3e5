"""The wall index against shapely, and by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

import naive
from echostep.errors import EchostepError
from echostep.walls import CONE_RAD, EAR_REACH_M, FAR_M, build_index, crosses_wall, reflectors


def random_walls(rng: np.random.Generator, n: int) -> np.ndarray:
    start = rng.uniform(0, 20, (n, 2))
    return np.hstack([start, start + rng.uniform(-4, 4, (n, 2))])


def test_crossing_agrees_with_shapely() -> None:
    rng = np.random.default_rng(1)
    walls = random_walls(rng, 40)
    index = build_index(walls)
    moves = np.hstack([rng.uniform(0, 20, (400, 2)), rng.uniform(-2, 2, (400, 2))])
    moves[:, 2:] += moves[:, :2]
    expected = [naive.crosses(move[0], move[1], move[2], move[3], walls) for move in moves]
    assert [crosses_wall(move[0], move[1], move[2], move[3], index) for move in moves] == expected
    assert 50 < sum(expected) < 350


def test_reflectors_agree_with_shapely() -> None:
    rng = np.random.default_rng(2)
    walls = random_walls(rng, 25)
    index = build_index(walls)
    heard = 0
    for _ in range(300):
        x, y, axis = rng.uniform(0, 20), rng.uniform(0, 20), rng.uniform(-math.pi, math.pi)
        distance, angle = naive.facing_wall(x, y, axis, walls, CONE_RAD, EAR_REACH_M)
        found, off_axis, _ = reflectors(x, y, axis, index)
        if math.isinf(distance):
            assert found == FAR_M
        else:
            heard += 1
            assert found == pytest.approx(distance, abs=1e-9)
            assert off_axis == pytest.approx(angle, abs=1e-6)
    assert heard > 60


def test_a_wall_end_is_an_edge() -> None:
    index = build_index(np.array([[1.0, 2.0, 5.0, 2.0]]))
    distance, _, edge = reflectors(0.0, 0.0, math.atan2(2.0, 1.0), index)
    assert distance == FAR_M
    assert edge == pytest.approx(math.hypot(1.0, 2.0))


def test_a_wall_hides_what_is_behind_it() -> None:
    slanted = [-1.0, 0.5, 1.0, 1.5]
    index = build_index(np.array([[-5.0, 3.0, 5.0, 3.0], slanted]))
    straight, _, _ = reflectors(0.0, 0.0, math.pi / 2, index)
    assert straight == pytest.approx(
        2.0 / math.sqrt(5.0)
    )  # the slanted wall's own perpendicular, 26.6 degrees off the axis
    assert reflectors(3.0, 0.0, math.pi / 2, index)[0] == pytest.approx(3.0)


@pytest.mark.parametrize("point", [(1e9, 0.0), (math.nan, 0.0), (0.0, math.inf), (-1e300, 1e300)])
def test_points_off_the_plan_hear_nothing(point: tuple[float, float]) -> None:
    index = build_index(np.array([[0.0, 0.0, 1.0, 0.0]]))
    assert reflectors(*point, 0.0, index) == (FAR_M, 0.0, FAR_M)
    assert not crosses_wall(*point, 0.0, 1.0, index) or math.isfinite(point[0])


def test_no_walls() -> None:
    index = build_index(np.zeros((0, 4)))
    assert reflectors(0.0, 0.0, 0.0, index) == (FAR_M, 0.0, FAR_M)
    assert not crosses_wall(0.0, 0.0, 5.0, 5.0, index)


def test_a_plan_in_millimetres_is_refused() -> None:
    with pytest.raises(EchostepError, match="metres"):
        build_index(np.array([[0.0, 0.0, 90_000.0, 0.0], [0.0, 0.0, 0.0, 90_000.0]]))
