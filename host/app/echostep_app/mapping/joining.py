# SPDX-License-Identifier: MIT
"""Several walks through one building as one drawing.

In: solved walks by name, in any order, each of unknown start. Out: `Mapped`, `Join`s. Owns the conditions under which two walks are of one building:
a place without a rival, most of the walls in common there, and two closures between the walks; and the standard deviations of the loose closure
that ties the second walk to the first. Between the last node of one walk and the first of the next the path gives no constraint.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep_app.mapping.graph.fragments import Fragments
from echostep_app.mapping.graph.graph import Closure, FittedWalls, Graph
from echostep_app.mapping.graph.nodes import Nodes, Pings
from echostep_app.mapping.mapper import Mapped, Progress, close_loops, drawn, settle
from echostep_app.mapping.placing import Place, find_place

UNKNOWN_M, UNKNOWN_RAD = 1000.0, 10.0  # standard deviations of the motion between two walks
BETWEEN_M = 30.0  # of path, that counts as walked in between: more than any limit on neighbours along the path
TIE_SD_M, TIE_SD_RAD = 0.3, math.radians(2.0)  # of a place: two cells of its images; drift of either drawing
LEAST_LOG_ODDS = math.log(1e3)  # of a place; the best of two buildings had 30 to 1
LEAST_COMMON_M, LEAST_SHARE = 12.0, 0.75  # of wall in common; its share, against walls in each other's free floor
LEAST_CLOSURES = 2  # between two walks, beside the tie itself


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
    none = FittedWalls(np.zeros(0), np.zeros(0), np.full(len(fragments.node), -1))
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


class Join(NamedTuple):
    """Where walk `name` was placed; `closures`: found between it and the walks before it."""

    name: str
    place: Place
    closures: tuple[Closure, ...]


def join_walks(
    walks: Sequence[tuple[str, Mapped]], progress: Progress = lambda _share: None
) -> tuple[Mapped, tuple[Join, ...]]:
    """One drawing in the map of the first walk; raises EchostepError where a walk has no certain place on the others."""
    for name, walk in walks:
        if (levels := walk.graph.levels) is not None:
            raise EchostepError(
                f"{name}: leads over {len(levels.height_m)} floors; walks are joined, or fitted to a plan, on one only: draw it by itself"
            )
    (first, whole), *left = walks
    joins: list[Join] = []
    while left:
        refused: list[str] = []
        for k, (name, walk) in enumerate(left):
            outcome = _joined(whole, walk, name)
            if not isinstance(outcome, str):
                whole, join = outcome
                joins.append(join)
                del left[k]
                break
            refused.append(f"{name} {outcome}")
        else:
            known = ", ".join([first, *(join.name for join in joins)])
            raise EchostepError(
                f"{refused[0]} on the walls of {known}: is it another building, another floor, or did the walks pass no room in"
                " common? Walk through places that were walked before, or draw it by itself"
            )
        progress(len(joins) / (len(walks) - 1))
    return drawn(whole), tuple(joins)


def _joined(whole: Mapped, walk: Mapped, name: str) -> tuple[Mapped, Join] | str:
    """All walks and this one, or why it has no place."""
    place = find_place(whole.graph, walk.graph)
    if place is None:
        return "shows no wall"
    if (doubt := doubt_of(place)) is not None:
        return doubt
    graph, first = merged(whole.graph, walk.graph, place), len(whole.graph.nodes)
    tie = graph.closures[-1]
    undone = settle(graph)
    undone += close_loops(graph, lambda _share: None, first, float(graph.nodes.way_m[first]))
    undone += settle(graph)
    between = tuple(c for c in graph.closures if c.old < first <= c.new and c is not tie)
    if len(between) < LEAST_CLOSURES or not any(c is tie for c in graph.closures):
        return f"fits on {place.common_m:.0f} m of wall, but not in detail,"
    pings = merged_pings(whole.pings, walk.pings, first)
    all_undone = (*whole.undone, *walk.undone, *undone)
    return replace(whole, graph=graph, pings=pings, undone=all_undone), Join(name, place, between)


def doubt_of(place: Place) -> str | None:
    """Why a place is not certain; None if it is."""
    if place.common_m < LEAST_COMMON_M or place.common_m < LEAST_SHARE * (place.common_m + place.against_m):
        return "fits nowhere"
    if place.rivals:
        return f"fits at {place.rivals + 1} places about as well"
    return "has no certain place" if place.log_odds < LEAST_LOG_ODDS else None
