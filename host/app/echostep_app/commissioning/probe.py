# SPDX-License-Identifier: MIT
"""Reads a board and an MTx for a few seconds, for `echostep doctor`, `calibrate` and `flash`.

In: ports. Out: `ProbeResult`: messages, rates, losses, and the data for the drift of the board's clock. Owns the ports while it reads.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from echostep.board.frames import BoardReader, StaleFirmwareError, encode
from echostep.board.messages import (
    CheckGyros,
    ClockQuery,
    ClockReply,
    Compass,
    Configure,
    Foot,
    Gyros,
    Identify,
    Magnetic,
    Message,
    Motion,
    Ping,
    Pressure,
    PressureMode,
    Schedule,
    SelfTest,
    Sync,
)
from echostep.board.reports import BoardReports
from echostep.errors import EchostepError
from echostep.ports.chunks import BOARD, MTX, Chunk
from echostep.timing.timeline import TICKS_PER_S, MtxTiming
from echostep.xsens import MtxReader
from echostep.xsens.reader import warm_up
from echostep_app.board.subscription import SUBSCRIBE_ELECTRICAL, BoardSubscription
from echostep_app.ports.arrival_clock import now_s as clock_s
from echostep_app.ports.serial_ports import SerialPorts
from echostep_app.recording.device import LISTENED_BYTES
from echostep_app.xsens.startup import MtxStart

BAUD = {BOARD: 115200, MTX: 115200}
QUERY_PERIOD_S = 0.2  # of clock queries
HEALTH_S = 1.6  # by then every gyro has reported its health
SELF_TEST_S = 2.2  # for a self-test and its report
SETTLED_S = 0.7  # of board time after the first message; until then buffered bytes arrive
MTX_WINDOW_S = 1.5  # for the rate of the MTx
LEAST_REPLIES = 8  # for a drift
LEAST_BOARD_S = 3.0  # of a board that starts during the probe: all its streams run 1 s after the start
LEAST_RATE_S = 1.0  # for rates


_KEPT: dict[type[Message], str] = {  # of which all are kept, in which field of the result
    Ping: "pings", Gyros: "gyros", Compass: "compass", Pressure: "pressures", Foot: "foot", Motion: "axes", Magnetic: "axes",
}  # fmt: skip


@dataclass(slots=True)
class ProbeResult:
    """Data received in `seconds`. `ticks`: times of the board's messages by kind, unwrapped, counted from the first message.

    `replies` to clock queries are (sent_s, arrived_s, ticks).
    """

    seconds: float = 0.0
    reports: BoardReports = field(default_factory=BoardReports)
    ticks: dict[str, list[int]] = field(default_factory=dict)
    pings: list[Ping] = field(default_factory=list)
    gyros: list[Gyros] = field(default_factory=list)
    compass: list[Compass] = field(default_factory=list)
    pressures: list[Pressure] = field(default_factory=list)
    axes: list[Motion | Magnetic] = field(default_factory=list)  # in the order of their arrival
    foot: list[Foot] = field(default_factory=list)  # of a foot board
    replies: list[tuple[float, float, int]] = field(default_factory=list)
    bytes_of: Counter[str] = field(default_factory=Counter)
    first_bytes: dict[str, bytes] = field(default_factory=dict)  # by port, enough to identify the device
    rejected: int = 0
    lost: int = 0
    stale_firmware: str = ""  # why the board's firmware does not fit; empty when it fits
    mtx_messages: list[str] = field(default_factory=list)
    mtx_fault: str = ""
    mtx_product: str = ""  # its product code
    mtx_times_s: list[float] = field(default_factory=list)  # arrival of each sample, s after the start
    notices: list[str] = field(default_factory=list)

    @property
    def rates_hz(self) -> dict[str, float]:
        """Messages per second of the board's clock, by kind, after SETTLED_S; empty when less than LEAST_RATE_S came after it."""
        last = max((t[-1] for t in self.ticks.values()), default=0)
        first = SETTLED_S * TICKS_PER_S
        span_s = (last - first) / TICKS_PER_S
        if span_s < LEAST_RATE_S:
            return {}
        return {kind: sum(t > first for t in ticks) / span_s for kind, ticks in self.ticks.items()}

    @property
    def mtx_hz(self) -> float:
        """Samples per second of this computer's clock over the last MTX_WINDOW_S; NaN when too few arrived."""
        late = [t for t in self.mtx_times_s if t > self.seconds - MTX_WINDOW_S]
        return (len(late) - 1) / (late[-1] - late[0]) if len(late) > 10 and late[-1] > late[0] else math.nan


@dataclass(frozen=True, slots=True)
class Drift:
    """Limits of the rate error of the board's clock against this computer's (ppm, + is fast), and the median answer time."""

    low_ppm: float
    high_ppm: float
    answer_s: float

    @property
    def least_ppm(self) -> float:
        """The least error within the limits."""
        return max(self.low_ppm, -self.high_ppm, 0.0)


def drift_of(result: ProbeResult) -> Drift | None:
    """Limits from causality: a reply's ticks were read after its query was sent, and before it arrived.

    A line of ticks against time that runs through all these intervals has a slope between the steepest one that any
    pair of replies demands and the flattest one. None for too few replies, or when no line fits: a clock was set.
    """
    if len(result.replies) < LEAST_REPLIES:
        return None
    sent_s, arrived_s, ticks = np.array(result.replies, float).T
    i, j = np.nonzero(np.subtract.outer(ticks, ticks).T > 0.0)  # j is after i
    board_s = (ticks[j] - ticks[i]) / TICKS_PER_S
    longest_s, shortest_s = arrived_s[j] - sent_s[i], sent_s[j] - arrived_s[i]
    if not len(i) or np.any(longest_s <= 0.0):
        return None
    low = float(np.max(board_s / longest_s))
    high = float(np.min(board_s / np.where(shortest_s > 0.0, shortest_s, 1e-9)))
    if high < low:
        return None
    return Drift((low - 1.0) * 1e6, (high - 1.0) * 1e6, float(np.median(arrived_s - sent_s)))


class _Probe:
    """Reads the ports, queries the board's clock and sets up the MTx."""

    def __init__(
        self, ports: SerialPorts, names: Mapping[str, str], check_gyros: bool, schedule: Schedule | None = None
    ) -> None:
        self.result = ProbeResult()
        self._ports, self._names, self._check_gyros, self._schedule = ports, names, check_gyros, schedule
        self._board, self._mtx = BoardReader(), MtxReader()
        self._subscription = BoardSubscription()
        self._start = MtxStart(MtxTiming().rate_hz, lambda sent: ports.send(MTX, sent), self.result.mtx_messages.append)
        self._start_s = clock_s()
        self._sequence = 0
        self._query_sent_s: dict[int, float] = {}
        self._first_ticks: int | None = None
        self._first_message_s = math.inf  # after the start
        self._least_board_s = LEAST_BOARD_S if check_gyros else 0.0
        self.extra_s = 0.0

    def run(self, seconds: float) -> None:
        """Read for `seconds`, and longer for a self-test that was requested, or a board that has just started."""
        if BOARD in self._names:
            self._send(Identify())
            if self._schedule is not None:
                self._configure(self._schedule)
        for chunk in self._ports.chunks():
            now_s = clock_s() - self._start_s
            if chunk is not None:
                self._receive(chunk)
            self._set_up_mtx(chunk)
            if BOARD in self._names and not self.result.stale_firmware:
                self._query_board(now_s)
            self._first_message_s = min(self._first_message_s, now_s if self._first_ticks is not None else math.inf)
            late_s = self._first_message_s + self._least_board_s if self._first_message_s <= seconds else 0.0
            if now_s >= max(seconds + self.extra_s, late_s):
                break
        if self._schedule is not None:
            self._configure(Schedule.CONCURRENT)
        self.result.seconds = clock_s() - self._start_s
        self.result.rejected, self.result.lost = self._board.counts.rejected, self._board.counts.lost
        self.result.notices += self._ports.notices
        self.result.mtx_product = self._start.product

    def _configure(self, schedule: Schedule) -> None:
        """Set the board as after a start, but for this schedule."""
        self._send(Configure(0xFF, schedule, 200, 10, PressureMode.HIGH_SPEED))

    def _send(self, message: Message) -> None:
        self._ports.send(BOARD, encode(message, self._sequence))
        self._sequence += 1

    def _query_board(self, now_s: float) -> None:
        if now_s >= QUERY_PERIOD_S * len(self._query_sent_s):
            self._query_sent_s[len(self._query_sent_s)] = clock_s()
            self._send(ClockQuery(len(self._query_sent_s) - 1))
        if self._check_gyros and now_s > HEALTH_S and self.result.reports.gyros:
            self._check_gyros = False
            if any(report.self_test != SelfTest.PASSED for report in self.result.reports.gyros.values()):
                self.extra_s = SELF_TEST_S
                self._send(CheckGyros())

    def _receive(self, chunk: Chunk) -> None:
        result = self.result
        result.bytes_of[chunk.port] += len(chunk.data)
        if len(first := result.first_bytes.get(chunk.port, b"")) < LISTENED_BYTES:
            result.first_bytes[chunk.port] = first + chunk.data
        arrived_s = chunk.t_arrival_ns * 1e-9
        if chunk.port == MTX:
            result.mtx_times_s += [arrived_s - self._start_s] * len(self._mtx.feed(chunk.data))
            return
        if result.stale_firmware:
            return
        try:
            for message in self._board.feed(chunk.data):
                self._add_message(message, arrived_s)
        except StaleFirmwareError as error:
            result.stale_firmware = str(error)

    def _add_message(self, message: Message, arrived_s: float) -> None:
        result = self.result
        result.reports.add(message)
        if self._subscription.is_due(message):
            self._send(SUBSCRIBE_ELECTRICAL)
        ticks: int = getattr(message, "ticks", 0)
        self._first_ticks = ticks if self._first_ticks is None else self._first_ticks
        elapsed = (ticks - self._first_ticks + (1 << 31)) % (1 << 32) - (1 << 31)
        result.ticks.setdefault(type(message).__name__, []).append(elapsed)
        if isinstance(message, ClockReply) and message.token in self._query_sent_s:
            result.replies.append((self._query_sent_s[message.token], arrived_s, elapsed))
        elif name := _KEPT.get(type(message)):
            getattr(result, name).append(message)

    def _set_up_mtx(self, chunk: Chunk | None) -> None:
        if MTX not in self._names or self.result.mtx_fault:
            return
        try:
            self._start.advance(chunk)
        except EchostepError as error:
            self.result.mtx_fault = str(error)


def probe(
    names: Mapping[str, str], seconds: float, *, check_gyros: bool = False, schedule: Schedule | None = None
) -> ProbeResult:
    """Read the ports (URLs by `BOARD`, `MTX`) for `seconds`; raises EchostepError when one cannot be opened.

    `check_gyros` requests a self-test of the gyros when the last one has not passed; `schedule`: of the pings, while it reads.
    """
    warm_up()
    BoardReader().feed(encode(Sync(0, 0), 0))  # compiles its kernel before bytes arrive
    ports = SerialPorts(names, BAUD)
    try:
        running = _Probe(ports, names, check_gyros, schedule)
        running.run(seconds)
    finally:
        ports.close()
    return running.result
