# SPDX-License-Identifier: MIT
"""A walk drawn: path and echoes -> fragments -> local walls -> loop closures -> the corrected path and its walls.

In: measured segments of one walk on one storey. Out: `Mapped`. Owns the order of the stages.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Bools, Floats
from echostep.mapping.association import KNOWN_M, associate
from echostep.mapping.closures import STRETCH_M, find_closure
from echostep.mapping.directions import LEAST_EVIDENCE, Directions, find_directions
from echostep.mapping.drawing import Drawing, draw
from echostep.mapping.fragments import Fragments, find_fragments
from echostep.mapping.graph import Closure, Graph, Walls, contradicted
from echostep.mapping.nodes import Nodes, Pings, nodes_of
from echostep.path import MeasuredSegment

LOCAL_ROUNDS, GLOBAL_ROUNDS = 2, 3  # of association and solution, before the closures and after them
Progress = Callable[[float], None]


@dataclass(frozen=True, slots=True)
class Mapped:
    """The solved `graph` of a walk, its `pings`, what is drawn, whether the building has two directions, and closures that were undone."""

    graph: Graph
    pings: Pings
    drawing: Drawing
    directions: Directions
    undone: tuple[Closure, ...]


def map_walk(segments: Sequence[MeasuredSegment], progress: Progress = lambda _share: None) -> Mapped:
    """Draw one walk; `progress` is told the share that is done."""
    nodes, pings = nodes_of(segments)
    fragments = find_fragments(nodes, pings)
    directions = find_directions(nodes, fragments)
    graph = _new_graph(nodes, fragments, directions)
    for _ in range(LOCAL_ROUNDS):
        _associate(graph)
    undone = _close_loops(graph, progress)
    for _ in range(GLOBAL_ROUNDS):
        _associate(graph)
    undone += _undo(graph)
    return Mapped(graph, pings, draw(graph, pings), directions, tuple(undone))


def _new_graph(nodes: Nodes, fragments: Fragments, directions: Directions) -> Graph:
    """The graph with its path as the building's directions correct it, where it has any."""
    none = Walls(np.zeros(0), np.zeros(0), np.full(len(fragments.node), -1))
    if directions.evidence < LEAST_EVIDENCE:
        return Graph(nodes, fragments, nodes.pose.copy(), none)
    pose, drift = nodes.pose.copy(), directions.drift_rad
    c, s = np.cos(drift[:-1]), np.sin(drift[:-1])
    dx, dy = np.diff(nodes.pose[:, :2], axis=0).T
    pose[1:, :2] = pose[0, :2] + np.cumsum(np.column_stack([c * dx - s * dy, s * dx + c * dy]), axis=0)
    pose[:, 2] += drift
    return Graph(nodes, fragments, pose, none, base_rad=directions.base_rad)


def _associate(graph: Graph) -> None:
    graph.walls = associate(graph.nodes, graph.fragments, *graph.places(), _anchored(graph))
    graph.solve()


def _anchored(graph: Graph) -> Bools:
    """Which fragments are within KNOWN_M of path of an end of a closure."""
    way_m = graph.nodes.way_m
    ends_m = (
        np.sort(way_m[[node for c in graph.closures for node in (c.old, c.new)]]) if graph.closures else np.zeros(0)
    )
    if not len(ends_m):
        return np.zeros(len(graph.fragments.node), np.bool_)
    at = way_m[graph.fragments.node]
    k = np.clip(np.searchsorted(ends_m, at), 1, len(ends_m) - 1) if len(ends_m) > 1 else np.zeros(len(at), np.int64)
    nearest: Floats = np.minimum(np.abs(at - ends_m[k]), np.abs(at - ends_m[np.maximum(k - 1, 0)]))
    found: Bools = nearest < KNOWN_M
    return found


def _close_loops(graph: Graph, progress: Progress) -> list[Closure]:
    """Match stretch after stretch with what is older; a closure bends the path before the next stretch is matched. Returns those undone."""
    way_m, begin, undone = graph.nodes.way_m, 0, []
    while begin < len(way_m) - 1:
        progress(float(way_m[begin] / max(way_m[-1], 1e-9)))
        end = int(np.searchsorted(way_m, way_m[begin] + STRETCH_M))
        end = min(max(end, begin + 1), len(way_m) - 1)
        if (closure := find_closure(graph, begin, end)) is not None:
            graph.closures.append(closure)
            graph.solve()
            undone += _undo(graph)
        begin = end
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
