"""SyncOut edges and which sample belongs to which.

In: edges that the board saw, and sample counters with their time by arrival. Out: the samples' times. Owns nothing: the state is a `SyncEdges`
that the caller keeps.

Edges and samples come in equal steps; only the number between them is unknown. Every sample votes for the edge nearest to its time by
arrival, and the vote of the last `VOTES` samples decides. From there on a sample's time is its edge's, or follows from the newest edge and the
measured period when that edge has not been seen.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.jit import kernel

VOTES = 50
KEPT = 256


class SyncEdges(Protocol):
    """The last edges in a ring (`edge` u16 count, `t_s`; `seen` so far) and votes; `newest` and `first` are unwrapped counts."""

    nominal_s: float
    period_s: float
    edge: Ints
    t_s: Floats
    seen: int
    newest: int
    newest_s: float
    first: int
    first_s: float
    vote: Ints
    voted: int
    locked: int
    offset: int  # counter minus edge, once locked


EDGES = np.dtype([
    ("nominal_s", "f8"), ("period_s", "f8"), ("edge", "i8", KEPT), ("t_s", "f8", KEPT), ("seen", "i8"), ("newest", "i8"),
    ("newest_s", "f8"), ("first", "i8"), ("first_s", "f8"), ("vote", "i8", VOTES), ("voted", "i8"), ("locked", "i8"), ("offset", "i8"),
])  # fmt: skip


def new_edges(period_s: float) -> Any:
    """No edge seen so far; `period_s` between them by the settings."""
    edges = np.zeros(1, EDGES)[0]
    edges["nominal_s"] = edges["period_s"] = period_s
    return edges


@kernel
def forget(s: SyncEdges) -> None:
    """Start anew after a restart of either side."""
    s.period_s = s.nominal_s
    s.seen = s.voted = s.locked = 0


@kernel
def add(s: SyncEdges, edge: int, t_s: float) -> None:
    """Keep an edge (u16 count) and its time."""
    if s.seen == 0:
        s.newest = s.first = edge
        s.first_s = t_s
    else:
        s.newest += (edge - s.newest) & 0xFFFF
    s.newest_s = t_s
    s.edge[s.seen % KEPT] = edge & 0xFFFF
    s.t_s[s.seen % KEPT] = t_s
    s.seen += 1
    if s.newest - s.first >= VOTES:
        period_s = (t_s - s.first_s) / (s.newest - s.first)
        s.period_s = period_s if period_s > 0.0 else s.nominal_s


@kernel
def time_of(s: SyncEdges, counter: int, by_arrival_s: float) -> float:
    """Time of the sample with this u16 counter; NaN until the vote is decided or when edges are long gone."""
    if s.seen == 0 or not abs(by_arrival_s - s.newest_s) <= 1e3 * s.nominal_s:
        return np.nan
    _vote(s, counter, by_arrival_s)
    if not s.locked:
        return np.nan
    edge = (counter - s.offset) & 0xFFFF
    for back in range(1, min(s.seen, KEPT) + 1):
        at = (s.seen - back) % KEPT
        if s.edge[at] == edge:
            if abs(s.t_s[at] - by_arrival_s) < 100 * s.nominal_s:
                return s.t_s[at]
            break
    ahead = ((edge - s.newest + 0x8000) & 0xFFFF) - 0x8000
    return s.newest_s + ahead * s.period_s


@kernel
def _vote(s: SyncEdges, counter: int, by_arrival_s: float) -> None:
    ahead = round((by_arrival_s - s.newest_s) / s.period_s)
    vote = (counter - s.newest - ahead) & 0xFFFF
    s.vote[s.voted % VOTES] = vote
    s.voted += 1
    if (s.locked and vote == s.offset) or s.voted < VOTES:
        return
    leader, support = s.vote[0], 0  # whoever has more than half of the votes leads in the end [Boyer, Moore 1981]
    for v in s.vote:
        if support == 0:
            leader = v
        support += 1 if v == leader else -1
    if np.sum(s.vote == leader) > VOTES // 2:
        s.locked, s.offset = 1, leader
