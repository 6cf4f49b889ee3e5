# SPDX-License-Identifier: MIT
"""A walk that is drawn while it goes on.

In: measured segments as they come. Out: `Mapped` of all so far. Owns the solution so far: solved poses stay as they are until an echo moves them,
so a stretch costs one solution, not all of them again.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from echostep.arrays import Floats
from echostep.path import MeasuredSegment
from echostep_app.mapping.graph.bias import find_bias, without_bias
from echostep_app.mapping.graph.directions import right_angles_off
from echostep_app.mapping.graph.graph import Graph
from echostep_app.mapping.graph.levels import find_levels
from echostep_app.mapping.graph.nodes import nodes_of
from echostep_app.mapping.mapper import Mapped, close_loops, find_pieces, find_walls, new_graph
from echostep_app.mapping.smoothed_heading import with_smoothed_headings
from echostep_app.mapping.walls.drawing import draw

SAME_RAD = math.radians(3.0)  # of two findings: the map is turned as a whole, its shape stays


class GrowingMap:
    """Call `grow` with each stretch of a walk."""

    def __init__(self) -> None:
        self._segments: list[MeasuredSegment] = []
        self._solved: Graph | None = None
        self._bias_rad_m = 0.0

    def grow(self, segments: Sequence[MeasuredSegment]) -> Mapped:
        """The drawing of all segments so far, of which these are new.

        Once it shows that the building has two directions, or other ones, or that odometry has a bias, all is solved again.
        """
        self._segments += segments
        nodes, pings = nodes_of(with_smoothed_headings(self._segments))
        bias = find_bias(nodes, pings, self._bias_rad_m)
        if bias != self._bias_rad_m:
            self._bias_rad_m, self._solved = bias, None
        nodes, pings = without_bias(nodes, pings, bias)
        fragments, directions = find_pieces(nodes, pings)
        graph, solved, first = new_graph(nodes, fragments, directions), self._solved, 0
        graph.levels = find_levels(self._segments, nodes)
        # Headings in hindsight may make a turn on the spot large enough for a node, or too small
        is_first = solved is not None and np.array_equal(solved.nodes.t_s, nodes.t_s[: len(solved.nodes)])
        if solved is not None and is_first and _same(solved.base_rad, graph.base_rad):
            first, graph.base_rad = len(solved.nodes) - 1, solved.base_rad
            graph.pose = _continued(solved.pose, graph.pose)
            graph.closures = solved.closures
        find_walls(graph)
        known = len(graph.closures)
        undone = close_loops(graph, lambda _share: None, first)
        if undone or len(graph.closures) != known:
            find_walls(graph)
        self._solved = graph
        return Mapped(graph, pings, draw(graph, pings), directions, tuple(undone))


def _same(a: float | None, b: float | None) -> bool:
    """Whether two findings of the building's directions are one."""
    if a is None or b is None:
        return a is b
    return abs(right_angles_off(a - b)) < SAME_RAD


def _continued(solved: Floats, pose: Floats) -> Floats:
    """Poses (n, 3) of which the first (m, 3) are solved; the others follow the last of these as they follow it in `pose`."""
    last, from_ = solved[-1], pose[len(solved) - 1]
    turn = last[2] - from_[2]
    c, s = math.cos(turn), math.sin(turn)
    moved = (pose[:, :2] - from_[:2]) @ np.array([[c, s], [-s, c]]) + last[:2]
    continued = np.column_stack([moved, pose[:, 2] + turn])
    continued[: len(solved)] = solved
    return continued
