# SPDX-License-Identifier: MIT
"""A walk drawn: path and echoes -> fragments -> local walls -> loop closures -> the corrected path and its walls.

In: measured segments. Out: `Mapped`. Owns the order of the stages.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Bools
from echostep.path import MeasuredSegment
from echostep_app.mapping.graph.association import KNOWN_M, associate
from echostep_app.mapping.graph.bias import find_bias, without_bias
from echostep_app.mapping.graph.closures import APART_M, STRETCH_M, find_closure
from echostep_app.mapping.graph.directions import LEAST_EVIDENCE, Directions, find_relief
from echostep_app.mapping.graph.fragments import Fragments, find_fragments
from echostep_app.mapping.graph.graph import ROUNDS, Closure, FittedWalls, Graph, contradicted
from echostep_app.mapping.graph.levels import BETWEEN, find_levels
from echostep_app.mapping.graph.nodes import Nodes, Pings, nodes_of, rotated
from echostep_app.mapping.graph.spots import with_spots
from echostep_app.mapping.smoothed_heading import with_smoothed_headings
from echostep_app.mapping.walls.drawing import Drawing, draw

LOCAL_ROUNDS, GLOBAL_ROUNDS = 2, 3  # of association and solution, before the closures and after them
FAR_M = 0.2  # shift by a closure, up to which one round of Gauss-Newton is enough before the next one
Progress = Callable[[float], None]


@dataclass(frozen=True, slots=True)
class Mapped:
    """The solved `graph`, its `pings`, the drawing of each level, whether the walls have two directions, closures undone."""

    graph: Graph
    pings: Pings
    drawings: tuple[Drawing, ...]
    directions: Directions
    undone: tuple[Closure, ...]

    @property
    def first_level(self) -> int:
        """The level of the first flat stretch of path."""
        levels = self.graph.levels
        return 0 if levels is None else int(levels.of[levels.of != BETWEEN][0])

    @property
    def drawing(self) -> Drawing:
        """The drawing of the first level."""
        return self.drawings[self.first_level]


def map_walk(segments: Sequence[MeasuredSegment], progress: Progress = lambda _share: None) -> Mapped:
    """Draw one walk; `progress` is called with the share that is done."""
    segments = with_smoothed_headings(segments)
    nodes, pings = nodes_of(segments)
    nodes, pings = without_bias(nodes, pings, find_bias(nodes, pings))
    graph, directions = new_graph(segments, nodes, pings)
    for _ in range(LOCAL_ROUNDS):
        find_walls(graph)
    undone = close_loops(graph, progress)
    for _ in range(GLOBAL_ROUNDS):
        find_walls(graph)
    undone += _undo(graph)
    return Mapped(graph, pings, draw(graph, pings), directions, tuple(undone))


def find_pieces(nodes: Nodes, pings: Pings) -> tuple[Fragments, Directions]:
    """The pieces of walls that the pings show, and the directions that they have."""
    fragments, directions = find_relief(nodes, find_fragments(nodes, pings))
    return with_spots(nodes, pings, fragments, directions), directions


def new_graph(segments: Sequence[MeasuredSegment], nodes: Nodes, pings: Pings) -> tuple[Graph, Directions]:
    """The graph of a walk with its path as the building's directions correct it, where it has any; and the directions."""
    fragments, directions = find_pieces(nodes, pings)
    none = FittedWalls(np.zeros(0), np.zeros(0), np.full(len(fragments.node), -1))
    graph = Graph(nodes, fragments, nodes.pose.copy(), none, levels=find_levels(segments, nodes))
    if directions.evidence >= LEAST_EVIDENCE:
        pose, drift, graph.base_rad = graph.pose, directions.drift_rad, directions.base_rad
        pose[1:, :2] = pose[0, :2] + np.cumsum(rotated(np.diff(nodes.pose[:, :2], axis=0), drift[:-1]), axis=0)
        pose[:, 2] += drift
    return graph, directions


def find_walls(graph: Graph) -> None:
    """Find which fragments are of one wall, and solve; fragments detected on stairs are of walls there, which constrain the heading."""
    node = graph.fragments.node
    level = np.zeros(len(node), np.int64) if graph.levels is None else graph.levels.with_flights[node]
    graph.walls = associate(graph.nodes, graph.fragments, *graph.places(), _anchored(graph), level)
    graph.solve()


def _anchored(graph: Graph) -> Bools:
    """Which fragments are within KNOWN_M of path of an end of a closure."""
    way_m, ends = graph.nodes.way_m, np.array([(c.old, c.new) for c in graph.closures], np.int64).ravel()
    at_m, ends_m = way_m[graph.fragments.node], np.concatenate([[-np.inf], np.sort(way_m[ends]), [np.inf]])
    after = np.searchsorted(ends_m, at_m)
    anchored: Bools = np.minimum(at_m - ends_m[after - 1], ends_m[after] - at_m) < KNOWN_M
    return anchored


def close_loops(graph: Graph, progress: Progress, first: int = 0) -> list[Closure]:
    """Match stretch after stretch from node `first` on with older ones; a closure bends the path before the next stretch is matched, without one
    the next begins in the middle of the last. Returns closures that are undone.
    """
    way_m, begin, undone = graph.nodes.way_m, first, []
    while begin < len(way_m) - 1:
        progress(float((way_m[begin] - way_m[first]) / max(way_m[-1] - way_m[first], 1e-9)))
        end = int(np.searchsorted(way_m, way_m[begin] + STRETCH_M))
        end = min(max(end, begin + 1), len(way_m) - 1)
        if (closure := find_closure(graph, begin, end, way_m[begin] - APART_M)) is not None:
            moved = graph.pose[closure.new] - graph.pose[closure.old] - closure.between
            graph.closures.append(closure)
            graph.solve(ROUNDS if np.hypot(*moved[:2]) > FAR_M else 1)
            undone += _undo(graph)
            begin = end
        else:
            begin = min(max(int(np.searchsorted(way_m, way_m[begin] + 0.5 * STRETCH_M)), begin + 1), end)
    progress(1.0)
    return undone


def _undo(graph: Graph) -> list[Closure]:
    """Take closures back that the rest of the graph contradicts by more than their odds."""
    undone = []
    while graph.closures:
        odds = np.array([contradicted(graph, closure) for closure in graph.closures])
        worst = int(np.argmin(odds))
        if odds[worst] > 0.0 or math.isnan(odds[worst]):
            break
        undone.append(graph.closures.pop(worst))
        graph.solve()
    return undone
