"""One clock: board ticks, the MTx sample counter and arrival times -> `t_s`.

In: board messages and MTx samples with their time of arrival, many at once. Out: `t_s`, seconds of the board's clock since its first reset
(without a board: of the MTx's counter). Owns every clock; nothing else converts time, and nothing here waits for a timer.

The board's ticks are the clock. MTx samples are tied to it by SyncOut edges when the wire is there, else by the lower envelopes of both
ports' arrival times. A device that restarts gets a new epoch, placed by arrival times.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.jit import kernel
from echostep.timing import arrival_envelope as arrival
from echostep.timing import device_clock as clocks
from echostep.timing import sync_edges as sync
from echostep.timing.device_clock import DeviceClock
from echostep.timing.sync_edges import SyncEdges

TICK_S = 0.5e-6
BOARD_LATENCY_S = 0.001  # a frame waits for the next USB millisecond at best
SILENT, PLAIN, FIRST_WORD = -3, -2, -1  # kinds of board messages; a kind from 0 on is a SyncOut edge


@dataclass(frozen=True, slots=True)
class MtxTiming:
    """How the MTx is set: its rate, and how long its bytes take at best (processing and 59 bytes at 115200 Bd)."""

    rate_hz: float = 100.0
    latency_s: float = 0.0071

    def __post_init__(self) -> None:
        """Raise ValueError for a rate that no MTx has."""
        if not 1.0 <= self.rate_hz <= 2000.0:
            raise ValueError(f"[mtx] rate_hz: {self.rate_hz} is not a rate of an MTx")


@dataclass(frozen=True, slots=True)
class Arrivals:
    """Messages of one port in order: `value` (n,) ticks or counter, `row` (n,) of the chunk that completed each, `t_arrival_ns` (n,) of that.

    `kind` (n,): `SILENT` (no time in it), `PLAIN`, `FIRST_WORD` of a board that may have restarted, or the count of a SyncOut edge.
    """

    value: Ints
    row: Ints
    t_arrival_ns: Ints
    kind: Ints


@dataclass(frozen=True, slots=True)
class Times:
    """`board_s`, `mtx_s`: `t_s` of each message, NaN for one that cannot be true or has no time.

    `board_at`, `mtx_at`: place of each among the messages of both ports in order of arrival. By that place, `board_newest_s` and
    `mtx_newest_s`: how far either port has come once this message is in, NaN before its first one.
    """

    board_s: Floats
    mtx_s: Floats
    board_at: Ints
    mtx_at: Ints
    board_newest_s: Floats
    mtx_newest_s: Floats


class Timeline:
    """`t_s` for everything that arrives; equal messages in equal order get equal times, in whatever portions they come."""

    def __init__(self, timing: MtxTiming) -> None:
        self.timing = timing
        self._board = clocks.new_clock(TICK_S, 1 << 32)
        self._mtx = clocks.new_clock(1.0 / timing.rate_hz, 1 << 16)
        self._edges = sync.new_edges(1.0 / timing.rate_hz)

    @property
    def synchronised(self) -> bool:
        """Whether SyncOut edges time the MTx samples."""
        return bool(self._edges["locked"])

    @property
    def board_restarts(self) -> int:
        """How often the board's clock has begun anew."""
        return int(self._board["restarts"])

    def arrival_ns(self, t_s: float) -> int:
        """When undelayed bytes of that moment arrive, on the host's clock; 0 before anything has come."""
        clock = self._board if self._board["started"] else self._mtx
        return max(round(arrival.to_arrival_s(clock, t_s) * 1e9), 0)

    def times(self, board: Arrivals, mtx: Arrivals) -> Times:
        """Times of a portion's messages; a board message comes before a sample of the same row."""
        nb, nm = len(board.value), len(mtx.value)
        found = Times(
            np.empty(nb),
            np.empty(nm),
            np.empty(nb, np.int64),
            np.empty(nm, np.int64),
            np.empty(nb + nm),
            np.empty(nb + nm),
        )
        _tell(
            self._board, self._mtx, self._edges, self.timing.latency_s,
            board.value, board.row, board.t_arrival_ns, board.kind, mtx.value, mtx.row, mtx.t_arrival_ns,
            found.board_s, found.mtx_s, found.board_at, found.mtx_at, found.board_newest_s, found.mtx_newest_s,
        )  # fmt: skip
        return found


@kernel
def _tell(
    board: DeviceClock, mtx: DeviceClock, edges: SyncEdges, latency_s: float,
    ticks: Ints, board_row: Ints, board_ns: Ints, kind: Ints, counter: Ints, mtx_row: Ints, mtx_ns: Ints,
    board_s: Floats, mtx_s: Floats, board_at: Ints, mtx_at: Ints, board_newest_s: Floats, mtx_newest_s: Floats,
) -> None:  # fmt: skip
    """Fill the columns of `Times`, message by message in order of arrival."""
    b, m = 0, 0
    for at in range(len(ticks) + len(counter)):
        if m == len(counter) or (b < len(ticks) and board_row[b] <= mtx_row[m]):
            board_s[b] = _board_time(board, edges, ticks[b], board_ns[b], kind[b])
            board_at[b] = at
            b += 1
        else:
            mtx_s[m] = _mtx_time(board, mtx, edges, counter[m], mtx_ns[m], latency_s)
            mtx_at[m] = at
            m += 1
        board_newest_s[at] = clocks.now_s(board)
        mtx_newest_s[at] = mtx.newest_s


@kernel
def _board_time(board: DeviceClock, edges: SyncEdges, ticks: int, t_arrival_ns: int, kind: int) -> float:
    if kind == SILENT:
        return np.nan
    restarts = board.restarts
    t_s = clocks.read(board, ticks, t_arrival_ns, kind == FIRST_WORD)
    if board.restarts != restarts:
        sync.forget(edges)
    if kind >= 0 and not np.isnan(t_s):
        sync.add(edges, kind, t_s)
    return t_s


@kernel
def _mtx_time(
    board: DeviceClock, mtx: DeviceClock, edges: SyncEdges, counter: int, t_arrival_ns: int, latency_s: float
) -> float:
    """`t_s` of an MTx sample, always later than the one before; NaN for a counter that cannot be true."""
    restarts = mtx.restarts
    device_s = clocks.read(mtx, counter, t_arrival_ns, False)
    if np.isnan(device_s):
        return np.nan
    if mtx.restarts != restarts:
        sync.forget(edges)
    t_s = device_s
    if board.started:
        sampled_s = arrival.to_arrival_s(mtx, device_s) - latency_s
        by_arrival_s = arrival.to_device_s(board, (sampled_s + BOARD_LATENCY_S) * 1e9 * 1e-9)
        by_edge_s = sync.time_of(edges, counter, by_arrival_s)
        t_s = by_arrival_s if np.isnan(by_edge_s) else by_edge_s
    if t_s <= mtx.newest_s:
        t_s = mtx.newest_s + 1e-6
    mtx.newest_s = t_s
    return t_s
