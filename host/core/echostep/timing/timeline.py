# SPDX-License-Identifier: MIT
"""Timeline: board ticks, MTx sample counters and arrival times -> `t_s`.

In: board messages and MTx samples with their time of arrival, many at once. Out: `t_s`, seconds of the board's clock since its first reset
(without a board: of the MTx's counter). Owns every clock; no other module converts time, and nothing here waits for a timer.

The board's ticks are the clock. SyncOut edges tie MTx samples to it if connected, else the lower envelopes of both ports' arrival times. Samples of
a foot board replace the MTx's: their value is the ticks of that board's own clock.
A device that restarts gets a new epoch, set by arrival times.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.jit import kernel, part
from echostep.timing import arrival_envelope as arrival
from echostep.timing import device_clock as clocks
from echostep.timing import sync_edges as sync
from echostep.timing.arrival_envelope import CONFIRMING
from echostep.timing.device_clock import DeviceClock
from echostep.timing.sync_edges import SyncEdges

TICKS_PER_S = 2_000_000  # of the board's counter [protocol/messages.toml, ticks]
TICK_S = 1.0 / TICKS_PER_S
BOARD_LATENCY_S = 0.001  # at best: a frame waits for the next USB millisecond
MIN_STEP_S = 1e-6  # between two MTx samples: times must increase
SILENT, PLAIN, FIRST_MESSAGE = -3, -2, -1  # kinds of board messages; a kind from 0 on is the count of a SyncOut edge


@dataclass(frozen=True, slots=True)
class MtxTiming:
    """How the MTx is set: its rate, and how long its bytes take at best (processing and 59 bytes at 115200 Bd)."""

    rate_hz: float = 100.0
    latency_s: float = 0.0071

    def __post_init__(self) -> None:
        """Raise ValueError for a rate that no MTx has."""
        if not 1.0 <= self.rate_hz <= 2000.0:
            raise ValueError(f"rate_hz: {self.rate_hz} is not a rate of an MTx")


class Arrivals(NamedTuple):
    """Messages of one port in order: `value` (n,) ticks or counter, `row` (n,) of the chunk that completed each, `t_arrival_ns` (n,) of that chunk.

    `kind` (n,): `SILENT` (without a time), `PLAIN`, `FIRST_MESSAGE` of a board that may have restarted, or the count of a SyncOut edge.
    """

    value: Ints
    row: Ints
    t_arrival_ns: Ints
    kind: Ints


class Times(NamedTuple):
    """`board_s` (b,), `mtx_s` (m,): `t_s` of each message, NaN if it is impossible or has no time.

    `board_message_index` (b,), `mtx_message_index` (m,): index of each message among those of both ports in order of arrival. By that index,
    `board_newest_s` and `mtx_newest_s` (b + m,): newest time of each port after this message, NaN before its first one.
    `board_restarts` (b,): how often the board's clock has restarted up to this message.
    """

    board_s: Floats
    mtx_s: Floats
    board_message_index: Ints
    mtx_message_index: Ints
    board_newest_s: Floats
    mtx_newest_s: Floats
    board_restarts: Ints


class Timeline:
    """`t_s` of each message; it does not depend on the portions in which messages come."""

    def __init__(self, timing: MtxTiming) -> None:
        self.timing = timing
        self._board = clocks.new_clock(TICK_S, 1 << 32)
        self._mtx = clocks.new_clock(1.0 / timing.rate_hz, 1 << 16)
        self._edges = sync.new_edges(1.0 / timing.rate_hz)
        self._foot_latency_s = timing.latency_s

    def expect_foot_board(self) -> None:
        """From now on the foot's samples come from a foot board; call this before the first sample."""
        self._mtx = clocks.new_clock(TICK_S, 1 << 32)
        self._foot_latency_s = BOARD_LATENCY_S

    @property
    def synchronised(self) -> bool:
        """Whether SyncOut edges time the MTx samples."""
        return bool(self._edges["locked"])

    @property
    def board_restarts(self) -> int:
        """Restarts of the board's clock."""
        return int(self._board["restarts"])

    @property
    def contradicted(self) -> int:
        """Messages whose arrival time contradicts the counter of their device."""
        return int(self._board["contradicted"] + self._mtx["contradicted"])

    @property
    def clock_steps(self) -> int:
        """Steps and standstills of the host's clock."""
        return int(self._board["steps"] + self._mtx["steps"])

    @property
    def stray_edges(self) -> int:
        """Edges on the board's SyncOut input that did not come from the MTx."""
        return int(self._edges["all_strays"])

    def arrival_ns(self, t_s: float) -> int:
        """Arrival time, on the host's clock, of undelayed bytes about `t_s`; 0 before any message."""
        clock = self._board if self._board["started"] else self._mtx
        return max(round(arrival.to_arrival_s(clock, t_s) * 1e9), 0)

    def times(self, board: Arrivals, mtx: Arrivals) -> Times:
        """Times of a portion's messages; a board message comes before a sample of the same row."""
        nb, nm = len(board.value), len(mtx.value)
        times = Times(
            np.empty(nb),
            np.empty(nm),
            np.empty(nb, np.int64),
            np.empty(nm, np.int64),
            np.empty(nb + nm),
            np.empty(nb + nm),
            np.empty(nb, np.int64),
        )
        _assign_times(self._board, self._mtx, self._edges, self._foot_latency_s, board, mtx, times)
        return times


@kernel
def _assign_times(
    board_clock: DeviceClock, mtx_clock: DeviceClock, edges: SyncEdges, latency_s: float,
    board: Arrivals, mtx: Arrivals, times: Times,
) -> None:  # fmt: skip
    """Fill the columns of `times`, message by message in order of arrival."""
    b, m = 0, 0
    for message_index in range(len(board.value) + len(mtx.value)):
        if m == len(mtx.value) or (b < len(board.value) and board.row[b] <= mtx.row[m]):
            steps = board_clock.steps
            times.board_s[b] = _board_time(board_clock, edges, board.value[b], board.t_arrival_ns[b], board.kind[b])
            if board_clock.steps != steps:
                mtx_clock.started = 0  # begun again on the clock after the step
            times.board_message_index[b] = message_index
            times.board_restarts[b] = board_clock.restarts
            b += 1
        else:
            times.mtx_s[m] = _mtx_time(board_clock, mtx_clock, edges, mtx.value[m], mtx.t_arrival_ns[m], latency_s)
            times.mtx_message_index[m] = message_index
            m += 1
        times.board_newest_s[message_index] = clocks.now_s(board_clock)
        times.mtx_newest_s[message_index] = mtx_clock.newest_s


@part
def _board_time(board: DeviceClock, edges: SyncEdges, ticks: int, t_arrival_ns: int, kind: int) -> float:
    """`t_s` of a board message; a SyncOut edge is kept, a restart discards the edges."""
    if kind == SILENT:
        return np.nan
    restarts = board.restarts
    t_s = clocks.read(board, ticks, t_arrival_ns, kind == FIRST_MESSAGE, True)
    if board.restarts != restarts:
        sync.reset(edges)
    if kind >= 0 and not np.isnan(t_s):
        sync.add(edges, kind, t_s)
    return t_s


@part
def _mtx_time(
    board: DeviceClock, mtx: DeviceClock, edges: SyncEdges, counter: int, t_arrival_ns: int, latency_s: float
) -> float:
    """`t_s` of an MTx sample, later than the one before; NaN for an impossible counter.

    Only samples that are far behind several times in a row are believed: the newest time was wrong.
    """
    restarts = mtx.restarts
    device_s = clocks.read(mtx, counter, t_arrival_ns, False, not board.started)
    if np.isnan(device_s):
        return np.nan
    if mtx.restarts != restarts:
        sync.reset(edges)
    t_s = device_s
    if board.started:
        sampled_s = arrival.to_arrival_s(mtx, device_s) - latency_s
        by_arrival_s = arrival.to_device_s(board, (sampled_s + BOARD_LATENCY_S) * 1e9 * 1e-9)
        by_edge_s = sync.time_of(edges, counter, by_arrival_s)
        t_s = by_arrival_s if np.isnan(by_edge_s) else by_edge_s
    if t_s < mtx.newest_s - clocks.BEHIND_S:
        mtx.behind += 1
        if mtx.behind < CONFIRMING:
            return np.nan
    elif t_s <= mtx.newest_s:
        t_s = mtx.newest_s + MIN_STEP_S
    mtx.behind = 0
    mtx.newest_s = t_s
    return t_s
