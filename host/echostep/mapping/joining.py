# SPDX-License-Identifier: MIT
"""Several walks through one building as one drawing.

In: solved walks by name, in any order, each of unknown start. Out: `Mapped`, `Join`s. Owns what is enough to say that two walks are of one building:
a place that leaves no other, most of the walls in common there, and two closures between the walks.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from echostep.errors import EchostepError
from echostep.mapping.graph.graph import Closure
from echostep.mapping.mapper import Mapped, Progress, close_loops, drawn, settle
from echostep.mapping.merging import merged, merged_pings
from echostep.mapping.placing import Place, find_place

LEAST_LOG_ODDS = math.log(1e3)  # of a place; the best of two buildings had 30 to 1
LEAST_COMMON_M, LEAST_SHARE = 12.0, 0.75  # of wall in common; of it, against walls in each other's free floor
LEAST_CLOSURES = 2  # between two walks, beside the tie itself


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
        if (storeys := walk.graph.storeys) is not None:
            raise EchostepError(
                f"{name}: leads over {len(storeys.height_m)} storeys; walks are joined, or fitted to a plan, on one only: draw it by itself"
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
                f"{refused[0]} on the walls of {known}: is it another building, another storey, or did the walks pass no room in"
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
    """Why a place is not certain; None where it is."""
    if place.common_m < LEAST_COMMON_M or place.common_m < LEAST_SHARE * (place.common_m + place.against_m):
        return "fits nowhere"
    if place.rivals:
        return f"fits at {place.rivals + 1} places about as well"
    return "has no certain place" if place.log_odds < LEAST_LOG_ODDS else None
