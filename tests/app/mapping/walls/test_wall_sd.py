# SPDX-License-Identifier: MIT
"""What is known of the distance of drawn walls from the path beside them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.arrays import Floats, Ints
from echostep_app.mapping.graph.graph import Closure, Graph
from echostep_app.mapping.graph.nodes import Pings
from echostep_app.mapping.walls.lines import Lines
from echostep_app.mapping.walls.segments import Run
from echostep_app.mapping.walls.wall_sd import distance_derivatives, distance_variances, wall_sds
from mapping.walls.test_place_sd import STEP_SD_M, path_alone

COUNT = 21  # nodes of a passage, a metre apart
LINE_SD_M = 0.03


def there_and_back(closures: list[Closure]) -> Graph:
    """A passage along the x axis, and one back 1 m beside it; the heading is known, so only the way in between tells how far apart they are."""
    x = np.arange(COUNT, dtype=np.float64)
    pose = np.zeros((2 * COUNT, 3))
    pose[:, 0], pose[COUNT:, 1] = np.concatenate([x, x[::-1]]), 1.0
    return path_alone(pose, np.arange(2.0 * COUNT), 1e-4, closures)


def pings_of(graph: Graph, node: Ints) -> tuple[Pings, Floats]:
    """A ping of the left ranger at each of these nodes, and their places."""
    count = len(node)
    places = graph.pose[node]
    none, left = np.zeros(count), np.zeros(count, np.int64)
    pings = Pings(places[:, :2], places[:, 2], np.full(count, 2.0), left, none, node, none)
    return pings, places


def wall_beside(graph: Graph, low_m: float, high_m: float, heard: Ints) -> float:
    """Standard deviation of a wall at y = 2 m between two places along x, that pings of the nodes `heard` found."""
    pings, places = pings_of(graph, np.arange(len(graph.nodes)))
    of = np.where(np.isin(pings.node, heard), 0, -1)
    one = np.ones(1)
    lines = Lines(0.5 * math.pi * one, 2.0 * one, LINE_SD_M * one, -high_m * one, -low_m * one, one > 0.0)
    return float(wall_sds(graph, pings, places, lines, [Run(0, -high_m, -low_m, 99.0)], of)[0])


def test_a_wall_is_known_as_well_as_the_way_between_its_two_passages() -> None:
    """Heard on the way there only: from the way back it is as far as 40 steps of path are wrong; at the turn, as 2 steps."""
    graph, end = there_and_back([]), COUNT - 1
    far = wall_beside(graph, -0.4, 0.4, np.array([0]))
    near = wall_beside(graph, end - 0.4, end + 0.4, np.array([end]))
    drift_m = STEP_SD_M * math.sqrt(2 * COUNT - 1)
    assert far == pytest.approx(math.hypot(LINE_SD_M, drift_m / math.sqrt(2.0)), rel=0.05), "from one of two places"
    assert near == pytest.approx(math.hypot(LINE_SD_M, STEP_SD_M / math.sqrt(2.0)), rel=0.1)


def test_a_return_makes_the_wall_known() -> None:
    """The end of the way back is tied to its begin, to a centimetre."""
    closure = Closure(0, 2 * COUNT - 1, np.array([0.0, 1.0, 0.0]), np.diag([1e4, 1e4, 1e4]), 20.0)
    assert wall_beside(there_and_back([closure]), -0.4, 0.4, np.array([0])) < 1.1 * LINE_SD_M


def test_a_wall_without_pings_is_known_as_its_line() -> None:
    graph = there_and_back([])
    assert wall_beside(graph, 0.0, 5.0, np.zeros(0, np.int64)) == pytest.approx(LINE_SD_M)


def test_a_wall_out_of_reach_of_a_passage_does_not_ask_it() -> None:
    """A wall along which only one passage leads within 5 m, whatever the other did."""
    graph = there_and_back([])
    graph.pose[COUNT:, 1] -= 10.0
    assert wall_beside(graph, -0.4, 0.4, np.array([0])) == pytest.approx(LINE_SD_M, rel=0.01)


def test_variances_are_those_of_the_whole_covariance() -> None:
    """Against the inverse of the normal matrix, for a wall that several nodes heard."""
    graph = there_and_back([])
    own, places = np.array([2, 3, 3, 35]), np.array([0, 7, 3, 38])
    jacobian, _ = graph.linearized()
    covariance = np.linalg.inv((jacobian.T @ jacobian).toarray())
    moves = distance_derivatives(graph.pose, 1.0, own, places, len(covariance))
    expected = np.einsum("ki,kl,li->i", moves, covariance, moves)
    np.testing.assert_allclose(distance_variances(graph, 1.0, own, places), expected, rtol=1e-5)


@given(
    st.floats(-3.0, 3.0), st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(-math.pi, math.pi),
    st.lists(st.integers(0, 9), min_size=1, max_size=6), st.integers(0, 2**32 - 1),
)  # fmt: skip
def test_a_drawing_that_is_moved_as_a_whole_is_as_well_known(
    turn: float, x_m: float, y_m: float, normal_rad: float, own: list[int], seed: int
) -> None:
    """A rigid motion of all poses changes no distance of a wall from the path."""
    pose = np.random.default_rng(seed).normal(0.0, 10.0, (10, 3))
    moves = distance_derivatives(pose, normal_rad, np.array(own), np.arange(10), 34)
    motion = np.column_stack([x_m - turn * pose[:, 1], y_m + turn * pose[:, 0], np.full(10, turn)])
    np.testing.assert_allclose(motion.ravel() @ moves[:30], 0.0, atol=1e-9)
