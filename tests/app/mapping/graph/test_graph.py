# SPDX-License-Identifier: MIT
"""The graph's derivatives against differences of its residuals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep_app.mapping.graph.fragments import Fragments
from echostep_app.mapping.graph.graph import Closure, FittedWalls, Graph
from echostep_app.mapping.graph.nodes import Nodes

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
