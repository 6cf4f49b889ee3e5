# SPDX-License-Identifier: MIT
"""Uncertainty of drawn walls against the nearby path.

In: a solved graph, the pieces of lines that are walls, pings. Out: a standard deviation of each. Owns the number of places used. The standard
deviation is not of a wall's place on the map but of its distance from nearby places, over all passages: a drawing that is turned or
shifted as a whole serves a person as well as another, one whose passages do not fit together is worse.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats, Ints
from echostep_app.mapping.graph.fragments import FARTHEST_M
from echostep_app.mapping.graph.graph import Graph
from echostep_app.mapping.graph.nodes import Pings
from echostep_app.mapping.walls.lines import Lines
from echostep_app.mapping.walls.segments import Run

# Most places on the path beside a wall, each in the middle of its share: each costs a solution with the graph's factor. With 64 the result
# differs by 3 % (18 simulated walks)
PLACES = 4


def wall_sds(graph: Graph, pings: Pings, poses: Floats, lines: Lines, runs: list[Run], of: Ints) -> Floats:
    """Standard deviation (n,) of each run: root mean square over its distances from nearby places, combined with its line's own.

    `poses` (k, 3): corrected place and axis of each ping; `of` (k,): the line that explains it.
    """
    return np.array([math.hypot(lines.sd_m[run.line], _path_sd_m(graph, pings, poses, lines, run, of)) for run in runs])


def _path_sd_m(graph: Graph, pings: Pings, poses: Floats, lines: Lines, run: Run, of: Ints) -> float:
    """Standard deviation that the path between a run and the places beside it adds; zero if no ping of its own is left."""
    normal_rad = float(lines.normal_rad[run.line])
    c, s = math.cos(normal_rad), math.sin(normal_rad)
    across, along = c * poses[:, 0] + s * poses[:, 1] - lines.rho_m[run.line], c * poses[:, 1] - s * poses[:, 0]
    beside = (along >= run.low_m) & (along <= run.high_m) & (np.abs(across) < FARTHEST_M)
    own = pings.node[beside & (of == run.line)]
    if not len(own):
        return 0.0
    places = np.unique(pings.node[beside])
    chosen = places[np.unique(((np.arange(PLACES) + 0.5) / PLACES * len(places)).astype(np.int64))]
    return math.sqrt(float(distance_variances(graph, normal_rad, own, chosen).mean()))


def distance_variances(graph: Graph, normal_rad: float, own: Ints, places: Ints) -> Floats:
    """Variance (m,) of the distance of a wall from each of the nodes `places` (m,), as factored last.

    `own` (k,): node of each ping that detected the wall, which moves with their mean and turns with them.
    """
    assert graph.factor is not None
    moves = distance_derivatives(graph.pose, normal_rad, own, places, graph.factor.shape[0])
    variance: Floats = (moves * graph.factor.solve(moves)).sum(0)
    return np.maximum(variance, 0.0)


def distance_derivatives(pose: Floats, normal_rad: float, own: Ints, places: Ints, unknowns: int) -> Floats:
    """Derivatives (unknowns, m) of the distances by all poses (n, 3); a motion of them all as one rigid body changes none."""
    normal = np.array([math.cos(normal_rad), math.sin(normal_rad)])
    wall = np.array([-normal[1], normal[0]])
    moves = np.zeros((unknowns, len(places)))
    node, count = np.unique(own, return_counts=True)
    weight = (count / count.sum())[:, None]
    moves[3 * node], moves[3 * node + 1] = weight * normal[0], weight * normal[1]
    moves[3 * node + 2] = weight * ((pose[node, :2] @ wall)[:, None] - pose[places, :2] @ wall)
    column = np.arange(len(places))
    moves[3 * places, column] -= normal[0]
    moves[3 * places + 1, column] -= normal[1]
    return moves
