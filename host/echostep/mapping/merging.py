# SPDX-License-Identifier: MIT
"""The graphs of two walks as one: the second is placed on the first, and tied to it by one loose closure.

In: two solved graphs, a `Place`. Out: a graph of both, not solved yet. Owns the tie's standard deviations. Between the last node of one walk and the
first of the next the path says nothing.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep.mapping.graph.fragments import Fragments
from echostep.mapping.graph.graph import Closure, Graph, Walls
from echostep.mapping.graph.nodes import Nodes, Pings
from echostep.mapping.placing import Place

UNKNOWN_M, UNKNOWN_RAD = 1000.0, 10.0  # standard deviations of what lies between two walks
BETWEEN_M = 30.0  # of path, that counts as walked in between: more than any limit on neighbours along the path
TIE_SD_M, TIE_SD_RAD = 0.3, math.radians(2.0)  # of a place: two cells of its images; drift of either drawing


def merged(old: Graph, new: Graph, place: Place) -> Graph:
    """Both walks in the map of `old`, with the closures of each, and the tie between them."""
    shift, n = _Moved(place), len(old.nodes)
    nodes = _nodes(old.nodes, new.nodes, shift)
    pose = np.concatenate([old.pose, shift.poses(new.pose)])
    node = n + place.node
    nearest = int(np.argmin(np.hypot(*(old.pose[:, :2] - pose[node, :2]).T)))
    tie = np.diag([TIE_SD_M**-2, TIE_SD_M**-2, TIE_SD_RAD**-2])
    closures = [*old.closures, *(shift.closure(closure, n) for closure in new.closures)]
    closures.append(Closure(nearest, node, pose[node] - pose[nearest], tie, place.log_odds))
    fragments = _fragments(old.fragments, new.fragments, n)
    none = Walls(np.zeros(0), np.zeros(0), np.full(len(fragments.node), -1))
    base = None if new.base_rad is None else old.base_rad
    return Graph(nodes, fragments, pose, none, closures, base)


class _Moved:
    """A place as a motion of poses and closures."""

    def __init__(self, place: Place) -> None:
        self._place = place
        c, s = math.cos(place.turn_rad), math.sin(place.turn_rad)
        self._turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    def poses(self, pose: Floats) -> Floats:
        """Poses (n, 3) on the old map."""
        return np.column_stack([self._place.moved(pose[:, :2]), pose[:, 2] + self._place.turn_rad])

    def closure(self, closure: Closure, first: int) -> Closure:
        """A closure between nodes that are counted from `first` on."""
        turned = self._turned
        between, information = turned @ closure.between, turned @ closure.information @ turned.T
        return Closure(closure.old + first, closure.new + first, between, information, closure.log_odds)


def _nodes(old: Nodes, new: Nodes, shift: _Moved) -> Nodes:
    return Nodes(
        np.concatenate([old.t_s, new.t_s]),
        np.concatenate([old.pose, shift.poses(new.pose)]),
        np.concatenate([old.sd_m, [UNKNOWN_M], new.sd_m]),
        np.concatenate([old.turn_sd_rad, [UNKNOWN_RAD], new.turn_sd_rad]),
        np.concatenate([old.way_m, old.way_m[-1] + BETWEEN_M + new.way_m]),
        (*old.begins, *(len(old) + begin for begin in new.begins)),
    )


def _fragments(old: Fragments, new: Fragments, first: int) -> Fragments:
    count = len(old.node)
    owner = np.where(new.ping < 0, -1, new.ping + count)
    moved = new._replace(node=new.node + first, ping=owner)
    return Fragments(*(np.concatenate([a, b]) for a, b in zip(old, moved, strict=True)))


def merged_pings(old: Pings, new: Pings, first: int) -> Pings:
    """The pings of both walks; nodes of the second are counted from `first` on."""
    return Pings(
        np.concatenate([old.at_m, new.at_m]),
        np.concatenate([old.axis_rad, new.axis_rad]),
        np.concatenate([old.range_m, new.range_m]),
        np.concatenate([old.ranger, new.ranger]),
        np.concatenate([old.off_heading_rad, new.off_heading_rad]),
        np.concatenate([old.node, new.node + first]),
        np.concatenate([old.share, new.share]),
    )
