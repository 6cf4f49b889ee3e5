# SPDX-License-Identifier: MIT
"""What is known of the place of drawn walls in the building: as the path since the last return."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.arrays import Floats
from echostep_app.mapping.graph.fragments import Fragments
from echostep_app.mapping.graph.graph import Closure, FittedWalls, Graph
from echostep_app.mapping.graph.nodes import Nodes
from echostep_app.mapping.walls.place_sd import MOST_SD_M, SCALE_SD, Heard, PlacedPiece, are_known, place_covariances

STEP_SD_M, STEP_M, COUNT = 0.03, 0.9, 61  # of each step of path; its length; nodes
COURSE = 17  # the first node more than 15 m from the start


def path_alone(pose: Floats, way_m: Floats, turn_sd_rad: float, closures: list[Closure]) -> Graph:
    """A path (n, 3) that has heard no wall."""
    gaps = len(pose) - 1
    nodes = Nodes(way_m, pose, np.full(gaps, STEP_SD_M), np.full(gaps, turn_sd_rad), way_m)
    none, integers = np.zeros(0), np.zeros(0, np.int64)
    pieces = Fragments(integers, np.zeros((0, 2)), none, none, none, none, integers, integers)
    graph = Graph(nodes, pieces, pose.copy(), FittedWalls(none, none, integers), closures)
    graph.solve()
    return graph


def straight(turn_sd_rad: float, closures: list[Closure] | None = None) -> Graph:
    """A path along the x axis."""
    pose = np.zeros((COUNT, 3))
    pose[:, 0] = STEP_M * np.arange(COUNT)
    return path_alone(pose, pose[:, 0], turn_sd_rad, closures or [])


def sds(graph: Graph, node: int) -> Floats:
    """Standard deviations along x and y of the place of a node."""
    (covariance,) = place_covariances(graph, [Heard(graph.pose[node, :2], np.array([node]))])
    deviations: Floats = np.sqrt(np.diag(covariance))
    return deviations


def test_a_place_is_known_as_well_as_the_way_to_it() -> None:
    """Along the way: the steps and the scale; across it the steps, of which those to the place 15 m away turn the frame."""
    graph = straight(1e-4)
    for node in (20, 40, 60):
        along, across = sds(graph, node)
        assert along == pytest.approx(math.hypot(STEP_SD_M * math.sqrt(node), SCALE_SD * STEP_M * node), rel=0.02)
        steps = node - COURSE + COURSE * (1.0 - node / COURSE) ** 2
        assert across == pytest.approx(STEP_SD_M * math.sqrt(steps), rel=0.02)
    drifting = [sds(straight(math.radians(0.3)), node)[1] for node in (20, 40, 60)]
    assert drifting[0] < drifting[1] < drifting[2]
    assert drifting[2] > 2.0 * sds(graph, 60)[1]


def test_a_return_makes_the_place_known() -> None:
    """The course and the last node are tied to the first: half of the way is the farthest from what is known, and no more the end."""
    ties = [
        Closure(0, node, np.array([STEP_M * node, 0.0, 0.0]), np.diag([1e4, 1e4, 1e4]), 20.0)
        for node in (COURSE, COUNT - 1)
    ]
    lost, tied = straight(math.radians(0.3)), straight(math.radians(0.3), ties)
    assert sds(tied, COUNT - 1)[1] < 0.1 * sds(lost, COUNT - 1)[1]
    assert sds(tied, 40)[1] > 1.5 * sds(tied, COUNT - 1)[1]


@given(st.floats(-3.0, 3.0), st.floats(-50.0, 50.0), st.floats(-50.0, 50.0))
def test_a_map_that_is_laid_elsewhere_is_as_well_known(turn: float, x_m: float, y_m: float) -> None:
    """The start, and the direction to the first place 15 m away, are the frame: it may lie anywhere."""
    graph = straight(math.radians(0.3))
    here = place_covariances(graph, [Heard(np.array([36.0, 1.0]), np.array([40]))])[0]
    c, s = math.cos(turn), math.sin(turn)
    moved = np.array([[c, -s], [s, c]])
    nodes = graph.nodes
    pose = np.column_stack([nodes.pose[:, :2] @ moved.T + [x_m, y_m], nodes.pose[:, 2] + turn])
    other = Graph(
        Nodes(nodes.t_s, pose, nodes.sd_m, nodes.turn_sd_rad, nodes.way_m), graph.fragments, pose, graph.walls
    )
    other.solve()
    there = place_covariances(other, [Heard(moved @ [36.0, 1.0] + [x_m, y_m], np.array([40]))])[0]
    np.testing.assert_allclose(moved.T @ there @ moved, here, atol=1e-6)


def test_a_wall_is_known_where_its_place_is() -> None:
    """One whose pieces are, one whose pieces are not, one that no ping is left of."""
    at = np.zeros(2)
    placed = [PlacedPiece(0, at, 0.1, 9.0), PlacedPiece(0, at, 0.2, 9.0), PlacedPiece(1, at, 1.1 * MOST_SD_M, 9.0)]
    assert are_known(3, placed).tolist() == [True, False, False]
