# SPDX-License-Identifier: MIT
"""How two ways to do the same work are compared.

In: what is to be timed. Out: `Row`s: ratios of medians. Owns how it is timed: rounds of ours and the peer's are interleaved, by the CPU time of the
thread, so that a busy machine slows both alike and a switch to another program counts for neither (threads that a peer starts are not charged to it).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median

Work = Callable[[], object]


@dataclass(frozen=True, slots=True)
class Row:
    """`ratio` is how many times longer the peer takes; `wanted` of it is what we promise."""

    name: str
    ratio: float
    median_s: float
    peer_s: float
    wanted: float | None = None


@dataclass(frozen=True, slots=True)
class Scale:
    """How much is measured: rounds, poses of the cloud, walls of the office, of the city, candidates of a step."""

    rounds: int = 9
    poses: int = 10_000
    office: int = 1_000
    city: int = 1_000_000
    candidates: int = 10_000


def interleaved(ours: Work, peer: Work, rounds: int) -> tuple[float, float]:
    """Median CPU seconds of ours and of the peer's, taken in turn, after one round that is not counted."""
    times: tuple[list[float], list[float]] = ([], [])
    for k in range(rounds + 1):
        for side, work in enumerate((ours, peer)):
            began = time.thread_time()
            work()
            if k:
                times[side].append(time.thread_time() - began)
    return median(times[0]), median(times[1])


def compared(name: str, ours: Work, peer: Work, rounds: int, wanted: float | None = None) -> Row:
    own_s, peer_s = interleaved(ours, peer, rounds)
    return Row(name, peer_s / own_s, own_s, peer_s, wanted)
