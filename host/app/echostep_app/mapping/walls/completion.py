# SPDX-License-Identifier: MIT
"""A partial or old plan, completed and corrected by walks that were placed on it.

In: a level of the plan, the solved graph in its frame, the drawing. Out: the level with new walls added, and walls that echoes passed marked as
doubtful. Owns the limits. A wall out of the rangers' reach stays as it was.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import shapely

from echostep.arrays import Bools, Floats, spans
from echostep.plan import Level
from echostep_app.mapping.graph.graph import Graph
from echostep_app.mapping.graph.nodes import Pings
from echostep_app.mapping.walls.drawing import Drawing
from echostep_app.mapping.walls.evidence import (
    CELL_M,
    MARGIN_M,
    Cells,
    add_crossings,
    cell_counts,
    is_straight,
    ping_poses,
)
from echostep_app.mapping.walls.lines import Lines

SMOOTH_M = 0.4  # of wall, over which pings are counted together
# Pings through a place of a wall, and their number per ping that detected it, that make it doubtful
LEAST_PASSED, PASSED_ODDS = 4.0, 2.0
LEAST_DOUBTFUL_M, LEAST_NEW_M = 0.6, 0.6  # of a piece
KNOWN_M = 0.3  # a drawn wall this near to one of the plan is that wall
SAMPLE_M = 0.05


class Completed(NamedTuple):
    """`level`: the plan's level with the findings; lengths of new and of doubtful walls."""

    level: Level
    new_m: float
    doubtful_m: float


def complete(level: Level, graph: Graph, pings: Pings, drawing: Drawing) -> Completed:
    """The level, corrected."""
    cells = _counts(level.walls, graph, pings)
    standing, doubtful = [np.zeros((0, 4))], [level.doubtful]
    for k, wall in enumerate(level.walls):
        there, gone = _split(wall, _passed(cells, k, float(np.hypot(*(wall[2:] - wall[:2])))))
        standing.append(there)
        doubtful.append(gone)
    new_walls = _unknown(drawing.walls, np.concatenate([*standing, level.windows, level.solid[len(level.walls) :]]))
    gone = np.concatenate(doubtful)
    walls = np.round(np.concatenate([*standing, new_walls]), 3)
    completed = replace(level, walls=walls, doubtful=np.round(gone, 3))
    return Completed(completed, _length_m(new_walls), _length_m(gone) - _length_m(level.doubtful))


def _counts(walls: Floats, graph: Graph, pings: Pings) -> Cells:
    """Pings that each cell of each wall (n, 4) explains, and pings that passed it."""
    dx, dy = (walls[:, 2:] - walls[:, :2]).T
    normal = np.arctan2(dx, -dy)
    c, s = np.cos(normal), np.sin(normal)
    rho = c * walls[:, 0] + s * walls[:, 1]
    low = c * walls[:, 1] - s * walls[:, 0]
    high = c * walls[:, 3] - s * walls[:, 2]
    lines = Lines(
        normal, rho, np.zeros(len(rho)), np.minimum(low, high), np.maximum(low, high), np.ones(len(rho), np.bool_)
    )
    poses = ping_poses(graph, pings)
    cells = cell_counts(lines, poses, pings.range_m, np.ones(len(poses), np.bool_), is_straight(graph, pings))
    add_crossings(lines, graph.paths(), cells)
    for k in np.flatnonzero(low > high):
        size = int(cells.size[k])
        cells.heard[k, :size], cells.passed[k, :size] = cells.heard[k, :size][::-1], cells.passed[k, :size][::-1]
    return cells


def _passed(cells: Cells, k: int, length_m: float) -> Bools:
    """Which cells of wall k, from its first end on, are doubtful."""
    first, count = round(MARGIN_M / CELL_M), max(1, round(length_m / CELL_M))
    window = np.ones(round(SMOOTH_M / CELL_M))
    answered, passed = (np.convolve(c[k], window, "same")[first : first + count] for c in (cells.heard, cells.passed))
    doubtful: Bools = (passed >= LEAST_PASSED) & (passed > PASSED_ODDS * answered)
    return doubtful


def _split(wall: Floats, gone: Bools) -> tuple[Floats, Floats]:
    """The pieces of a wall (4,) that stand, and the doubtful ones; short doubts do not count."""
    edges = spans(gone)
    edges = edges[(edges[:, 1] - edges[:, 0]) * CELL_M >= LEAST_DOUBTFUL_M]
    shares = np.minimum(edges / max(len(gone), 1), 1.0)
    cuts = np.concatenate([[0.0], shares.ravel(), [1.0]]).reshape(-1, 2)
    cuts = cuts[cuts[:, 1] > cuts[:, 0]]
    return _between(wall, cuts), _between(wall, shares)


def _between(wall: Floats, shares: Floats) -> Floats:
    """Pieces (n, 4) of a wall (4,) between shares (n, 2) of its length."""
    a, along = wall[:2], wall[2:] - wall[:2]
    return np.concatenate([a + shares[:, :1] * along, a + shares[:, 1:] * along], axis=1)


def _unknown(drawn: Floats, known: Floats) -> Floats:
    """Pieces (n, 4) of drawn walls that are not walls of the plan."""
    tree = shapely.STRtree(shapely.linestrings(known.reshape(-1, 2, 2))) if len(known) else None
    pieces = [np.zeros((0, 4))]
    for wall in drawn:
        count = max(1, math.ceil(float(np.hypot(*(wall[2:] - wall[:2]))) / SAMPLE_M))
        share = (np.arange(count) + 0.5) / count
        points = shapely.points(wall[:2] + share[:, None] * (wall[2:] - wall[:2]))
        new = np.ones(count, np.bool_)
        if tree is not None:
            new[tree.query(points, predicate="dwithin", distance=KNOWN_M)[0]] = False
        edges = spans(new)
        edges = edges[(edges[:, 1] - edges[:, 0]) * SAMPLE_M >= LEAST_NEW_M]
        pieces.append(_between(wall, edges / count))
    return np.concatenate(pieces)


def _length_m(walls: Floats) -> float:
    """Length of all walls."""
    return float(np.hypot(*(walls[:, 2:] - walls[:, :2]).T).sum())
