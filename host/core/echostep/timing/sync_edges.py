# SPDX-License-Identifier: MIT
"""Assignment of SyncOut edges to MTx samples, which gives the time of each sample.

In: edges that the board has timed; sample counters with their time by arrival. Out: times of samples. Owns nothing: the caller keeps the
`SyncEdges`.

The MTx gives one edge per sample, so counter - edge count is a constant offset (mod 65536), which is unknown at first. Each sample votes for the
offset of the edge nearest to its time by arrival. An offset with more than half of the last `VOTES` votes is locked. Then the time of a sample is
the time of its edge; if the board has not reported that edge, it is extrapolated from the newest edge by the measured period.

An edge that comes too early is not from the MTx, but interference on the wire: it is not counted. Taken for a sample, it would move the times of half
a second by a period, and turn a swinging foot by 0.1 rad.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from echostep.arrays import Floats, Ints, record_dtype
from echostep.jit import kernel, part

VOTES = 50  # samples: half a second at 100 Hz
KEPT = 256  # edges in the ring: more than two seconds at 100 Hz
OUTDATED_PERIODS = 1e3  # farther from the newest edge than this, a sample has no time by edges, assumed
MATCH_PERIODS = 100  # largest distance of a matching edge from the time by arrival, assumed
EARLY_PERIODS = 0.2  # an edge that comes more than this before its time is a stray one; crystals and stamps differ by 1e-4 of a period
MOST_STRAYS = 3  # in a row; more of them mean a clock that has changed, assumed


class SyncEdges(Protocol):
    """The newest edges and votes, each in a ring."""

    nominal_s: float  # period by the settings
    period_s: float  # period as measured, the nominal one before VOTES edges
    edge: Ints  # (KEPT,) u16 count of each edge
    t_s: Floats  # (KEPT,) its time
    seen: int  # edges since the reset
    newest: int  # count of the newest edge, unwrapped
    newest_s: float
    first: int  # count of the first edge since the reset
    first_s: float
    vote: Ints  # (VOTES,) offsets voted for
    voted: int  # votes since the reset
    locked: int
    offset: int  # counter minus edge count (mod 65536), once locked
    strays: int  # stray edges since the reset, which the board has counted too
    strays_in_row: int
    all_strays: int  # since the beginning


EDGES = record_dtype(SyncEdges, edge=KEPT, t_s=KEPT, vote=VOTES)


def new_edges(period_s: float) -> Any:
    """State without any edge; `period_s`: time between two edges by the settings."""
    edges = np.zeros(1, EDGES)[0]
    edges["nominal_s"] = edges["period_s"] = period_s
    return edges


@part
def reset(s: SyncEdges) -> None:
    """Discard all edges and votes, after a restart of the board or the MTx."""
    s.period_s = s.nominal_s
    s.seen = s.voted = s.locked = s.strays = s.strays_in_row = 0


@kernel
def add(s: SyncEdges, edge: int, t_s: float) -> None:
    """Add an edge (u16 count) and its time, and measure the period; a stray edge is counted and left out."""
    if _is_stray(s, (edge - s.strays - s.newest) & 0xFFFF, t_s):
        s.strays += 1
        s.strays_in_row += 1
        s.all_strays += 1
        if s.strays_in_row > MOST_STRAYS:
            reset(s)
        return
    s.strays_in_row = 0
    edge = (edge - s.strays) & 0xFFFF
    if s.seen == 0 or t_s - s.newest_s > KEPT * s.nominal_s:
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


@part
def _is_stray(s: SyncEdges, steps: int, t_s: float) -> bool:
    """Whether an edge, `steps` counts after the newest one, comes too early."""
    measured = s.locked == 1 and s.newest - s.first >= VOTES
    return measured and 0 < steps < VOTES and t_s < s.newest_s + (steps - EARLY_PERIODS) * s.period_s


@kernel
def time_of(s: SyncEdges, counter: int, by_arrival_s: float) -> float:
    """Time of the sample with this u16 counter; NaN until an offset is locked, or long after the last edge."""
    if s.seen == 0 or not abs(by_arrival_s - s.newest_s) <= OUTDATED_PERIODS * s.nominal_s:
        return np.nan
    _vote(s, counter, by_arrival_s)
    if not s.locked:
        return np.nan
    edge = (counter - s.offset) & 0xFFFF
    for back in range(1, min(s.seen, KEPT) + 1):
        slot = (s.seen - back) % KEPT
        if s.edge[slot] == edge:
            if abs(s.t_s[slot] - by_arrival_s) < MATCH_PERIODS * s.nominal_s:
                return s.t_s[slot]
            break
    ahead = ((edge - s.newest + 0x8000) & 0xFFFF) - 0x8000
    t_s = s.newest_s + ahead * s.period_s
    return t_s if abs(t_s - by_arrival_s) < MATCH_PERIODS * s.nominal_s else np.nan


@part
def _vote(s: SyncEdges, counter: int, by_arrival_s: float) -> None:
    """Add the vote of one sample, and lock the offset that has the majority of the last votes."""
    ahead = round((by_arrival_s - s.newest_s) / s.period_s)
    vote = (counter - s.newest - ahead) & 0xFFFF
    s.vote[s.voted % VOTES] = vote
    s.voted += 1
    if (s.locked and vote == s.offset) or s.voted < VOTES:
        return
    # Majority: a value with more than half of the votes is the leader at the end [Boyer, Moore 1981].
    leader, support = s.vote[0], 0
    for v in s.vote:
        if support == 0:
            leader = v
        support += 1 if v == leader else -1
    if np.sum(s.vote == leader) > VOTES // 2:
        s.locked, s.offset = 1, leader
