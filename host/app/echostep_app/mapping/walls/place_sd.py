# SPDX-License-Identifier: MIT
"""How well the place of drawn walls is known in the building: the error grows with the path since the last return.

In: a solved graph, pieces of lines that are walls, pings. Out: `PlacedPiece`s. Owns the frame in which they are stated: the start, and the direction
to the first place COURSE_M away, are known, as by two taps. Walls that a return ties to the start are known as the return is, walls beyond it as
the path is.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Floats, Ints
from echostep_app.mapping.graph.graph import Graph
from echostep_app.mapping.graph.nodes import Pings
from echostep_app.mapping.walls.lines import Lines
from echostep_app.mapping.walls.segments import Run

COURSE_M = 15.0  # from the start to the place that gives the direction
SCALE_SD = 0.005  # of all lengths of a walk: the three surveyed hallways of gx5_gcp are 0.1, 0.4 and 0.7 % too long
PIECE_M = 4.0  # of wall, whose places are known alike: a stretch of path beside it has half a closure's length
OFF_M = 0.5  # a wall is drawn where it is farther off with a probability of 0.05 at most; assumed: half of a passage
MOST_SD_M = OFF_M / 1.96
AT_ONCE = 64  # pieces that are solved together: an hour's walk has 15,000 unknowns, each 8 bytes of two columns


class PlacedPiece(NamedTuple):
    """A piece of run number `run` about `at_m` (x, y): standard deviation across the wall, and along the worst axis."""

    run: int
    at_m: Floats
    across_sd_m: float
    sd_m: float


class Heard(NamedTuple):
    """A place (x, y) in the map, and the nodes (k,) of the pings that detected it: it moves with their mean and turns with them."""

    at_m: Floats
    node: Ints


def placed_pieces(
    graph: Graph, pings: Pings, poses: Floats, lines: Lines, runs: list[Run], of: Ints
) -> list[PlacedPiece]:
    """All runs in pieces that were heard; `poses` (k, 3): corrected place and axis of each ping; `of` (k,): the line that explains it."""
    which, heard = [], []
    for number, run in enumerate(runs):
        for piece in _pieces(pings, poses, lines, run, of):
            which.append(number)
            heard.append(piece)
    covariance = place_covariances(graph, heard)
    placed = []
    for number, piece, own in zip(which, heard, covariance, strict=True):
        normal_rad = float(lines.normal_rad[runs[number].line])
        normal = np.array([math.cos(normal_rad), math.sin(normal_rad)])
        line_sd_m = float(lines.sd_m[runs[number].line])
        across, worst = (
            math.sqrt(max(v, 0.0)) for v in (float(normal @ own @ normal), float(np.linalg.eigvalsh(own)[-1]))
        )
        placed.append(PlacedPiece(number, piece.at_m, math.hypot(across, line_sd_m), math.hypot(worst, line_sd_m)))
    return placed


def are_known(walls: int, placed: list[PlacedPiece]) -> Bools:
    """Which of this many walls are known well enough to be drawn."""
    variance, count = np.zeros(walls), np.zeros(walls)
    for piece in placed:
        variance[piece.run] += piece.across_sd_m**2
        count[piece.run] += 1.0
    known: Bools = (count > 0.0) & (variance < count * MOST_SD_M**2)
    return known


def _pieces(pings: Pings, poses: Floats, lines: Lines, run: Run, of: Ints) -> list[Heard]:
    """A run in pieces of PIECE_M or less that own pings."""
    normal_rad, rho_m = float(lines.normal_rad[run.line]), float(lines.rho_m[run.line])
    c, s = math.cos(normal_rad), math.sin(normal_rad)
    along = c * poses[:, 1] - s * poses[:, 0]
    edges = np.linspace(run.low_m, run.high_m, math.ceil((run.high_m - run.low_m) / PIECE_M) + 1)
    pieces = []
    for low, high in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        own = pings.node[(of == run.line) & (along >= low) & (along <= high)]
        middle = 0.5 * (low + high)
        if len(own):
            pieces.append(Heard(np.array([c * rho_m - s * middle, s * rho_m + c * middle]), own))
    return pieces


def place_covariances(graph: Graph, places: list[Heard]) -> Floats:
    """Covariances (n, 2, 2) of places against the start and the course of the path, as factored last."""
    assert graph.factor is not None
    covariance = np.zeros((len(places), 2, 2))
    for first in range(0, len(places), AT_ONCE):
        part = places[first : first + AT_ONCE]
        moves = np.concatenate([_derivatives(graph, heard) for heard in part], axis=1)
        solved = graph.factor.solve(moves).reshape(-1, len(part), 2)
        covariance[first : first + len(part)] = np.einsum("uni,unj->nij", moves.reshape(-1, len(part), 2), solved)
    arm = np.array([heard.at_m for heard in places]).reshape(-1, 2) - graph.pose[0, :2]
    both: Floats = 0.5 * (covariance + covariance.transpose(0, 2, 1))
    return both + SCALE_SD**2 * arm[:, :, None] * arm[:, None, :]


def _derivatives(graph: Graph, heard: Heard) -> Floats:
    """Derivatives (unknowns, 2) of a place by all poses; a motion of them all as one rigid body changes none."""
    assert graph.factor is not None
    moves = np.zeros((graph.factor.shape[0], 2))
    node, count = np.unique(heard.node, return_counts=True)
    weight = count / count.sum()
    for axis in (0, 1):
        moves[3 * node + axis, axis] = weight
    moves[3 * node + 2] = weight[:, None] * _turned(heard.at_m - graph.pose[node, :2])
    start, course = graph.pose[0, :2], course_node(graph.pose)
    chord = graph.pose[course, :2] - start
    across = _turned(chord) / max(float(chord @ chord), 1e-9)  # derivative of the direction by the node that gives it
    arm = _turned(heard.at_m - start)
    for axis in (0, 1):
        moves[axis] += arm * across[axis]
        moves[axis, axis] -= 1.0
        moves[3 * course + axis] -= arm * across[axis]
    return moves


def _turned(arm: Floats) -> Floats:
    """How the end of each arm (..., 2) moves when it is turned."""
    return np.stack([-arm[..., 1], arm[..., 0]], axis=-1)


def course_node(pose: Floats) -> int:
    """The first node COURSE_M from the start; of a shorter walk, one near its farthest."""
    away_m = np.hypot(*(pose[:, :2] - pose[0, :2]).T)
    return int(np.argmax(away_m > min(COURSE_M, 0.9 * float(away_m.max()))))
