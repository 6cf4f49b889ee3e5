# SPDX-License-Identifier: MIT
"""The graph's derivatives against differences of its residuals; the first course."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan import Pose
from echostep_app.mapping.graph.fragments import Fragments
from echostep_app.mapping.graph.graph import Closure, FittedWalls, Graph
from echostep_app.mapping.graph.nodes import Nodes
from echostep_app.mapping.mapper import map_walk
from echostep_app.mapping.plan import plan_of

STEP = 1e-6


def bent_path_along_walls(seed: int) -> Graph:
    """A path that turns, pieces ahead, abeam and behind it that lie exactly on their walls: there weights do not change to first order."""
    rng = np.random.default_rng(seed)
    n, walls = 8, 3
    turns, steps = rng.normal(0.0, 0.4, n), rng.uniform(0.5, 1.5, n)
    heading = np.cumsum(turns)
    pose = np.column_stack([np.cumsum(steps * np.cos(heading)), np.cumsum(steps * np.sin(heading)), heading])
    odometry = pose + rng.normal(0.0, 0.05, (n, 3))
    nodes = Nodes(np.linspace(0.0, n - 1.0, n), odometry, np.full(n - 1, 0.03), np.full(n - 1, 0.01), np.cumsum(steps))
    normal, rho = rng.uniform(-math.pi, math.pi, walls), rng.uniform(1.0, 3.0, walls)
    of, node = np.arange(2 * n) % walls, np.repeat(np.arange(n), 2)
    normals = np.column_stack([np.cos(normal), np.sin(normal)])[of]
    along = rng.uniform(-2.0, 2.0, 2 * n)[:, None] * np.column_stack([-normals[:, 1], normals[:, 0]])
    off = rho[of][:, None] * normals + along - pose[node, :2]
    c, s = np.cos(pose[node, 2]), np.sin(pose[node, 2])
    centre = np.column_stack([c * off[:, 0] + s * off[:, 1], c * off[:, 1] - s * off[:, 0]])
    sds = np.full(2 * n, 0.04)
    pieces = Fragments(
        node,
        centre,
        normal[of] - pose[node, 2],
        np.full(2 * n, 0.5),
        sds,
        sds,
        np.full(2 * n, 9),
        np.zeros(0, np.int64),
    )
    between = pose[6] - pose[1] + rng.normal(0.0, 0.1, 3)
    closure = Closure(1, 6, between, np.diag([100.0, 50.0, 400.0]), 10.0)
    return Graph(nodes, pieces, pose, FittedWalls(normal, rho, of), [closure])


def moved(graph: Graph, unknown: int, by: float) -> Floats:
    """The residuals with one unknown changed."""
    count = graph.pose.size
    pose, wall = graph.pose.copy(), np.column_stack([graph.walls.normal_rad, graph.walls.rho_m])
    if unknown < count:
        pose.flat[unknown] += by
    else:
        wall.flat[unknown - count] += by
    walls = FittedWalls(wall[:, 0], wall[:, 1], graph.walls.of)
    return Graph(graph.nodes, graph.fragments, pose, walls, graph.closures).linearized()[1]


@pytest.mark.parametrize("seed", range(5))
def test_the_derivatives_are_those_of_the_residuals(seed: int) -> None:
    graph = bent_path_along_walls(seed)
    jacobian, _ = graph.linearized()
    unknowns = jacobian.shape[1]
    slopes = [(moved(graph, k, STEP) - moved(graph, k, -STEP)) / (2.0 * STEP) for k in range(unknowns)]
    np.testing.assert_allclose(jacobian.toarray(), np.column_stack(slopes), rtol=1e-4, atol=1e-4)


# Of the heading at the beginnings of the first strides from their course, as simulated feet have it
TOE_DEG = (-8.0, -7.0, -3.0)


def walk(straight_m: int) -> list[MeasuredSegment]:
    """So many strides of a metre straight on, then a corridor of 40 m to the left."""
    found: list[MeasuredSegment] = []
    courses = [0.0] * straight_m + [0.5 * math.pi] * 40
    for k, course in enumerate(courses):
        after = courses[min(k + 1, len(courses) - 1)]
        toe, next_toe = (math.radians(TOE_DEG[j]) if j < len(TOE_DEG) else 0.0 for j in (k, k + 1))
        t_s = k + np.arange(0.0, 1.0, 0.04)
        heard = np.full(len(t_s), 1.0 if course else math.nan)
        segment = PathSegment(
            k, k + 1.0, math.cos(course), math.sin(course), course + toe, after + next_toe, 0.02, math.radians(0.6), k
        )
        found.append(MeasuredSegment(segment, t_s, np.arange(len(t_s)) % 2, heard))
    return found


@pytest.mark.parametrize("straight_m", [1, 2, 3, 6])
def test_the_drawing_is_turned_by_the_first_strides(straight_m: int) -> None:
    """However soon the wearer turns, the corridor leads north when the first stride is said to lead east, though the toe points 8 degrees off."""
    mapped = map_walk(walk(straight_m))
    plan, _ = plan_of(mapped, Pose(0.0, 0.0, 0.0), "turned")
    x0, y0, x1, y1 = max(plan.levels[0].walls.tolist(), key=lambda w: math.hypot(w[2] - w[0], w[3] - w[1]))
    off = math.atan2(y1 - y0, x1 - x0) % math.pi - 0.5 * math.pi
    assert abs(math.degrees(off)) < 0.5
