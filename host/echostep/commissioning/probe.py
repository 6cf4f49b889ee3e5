"""Listening to a board and an MTx for a few seconds, for `echostep doctor` and `echostep calibrate`.

In: ports. Out: `ProbeResult`: what they said, how often, and how the board's clock runs against this computer's. Owns the ports while it listens.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from echostep.board.frames import BoardReader, StaleFirmwareError, encode
from echostep.board.health import BoardReports
from echostep.board.messages import (
    CheckGyros,
    ClockQuery,
    ClockReply,
    Compass,
    Gyros,
    Identify,
    Message,
    Ping,
    SelfTest,
    Sync,
)
from echostep.errors import EchostepError
from echostep.ports.chunks import BOARD, MTX, Chunk, SerialPorts
from echostep.timing.timeline import MtxTiming
from echostep.xsens import MtxReader
from echostep.xsens.reader import warm_up
from echostep.xsens.startup import MtxStart

BAUD = {BOARD: 115200, MTX: 115200}
TICKS_PER_S = 2_000_000
ASK_S = 0.2  # between two clock queries
HEALTH_S = 1.6  # by then every gyro has spoken
TEST_S = 2.2  # for a self-test and its report
SETTLED_S = 0.7  # of board time after the first message: what waited in the port has come


@dataclass(slots=True)
class ProbeResult:
    """What was heard in `seconds`. `ticks` are those of the board's messages by kind, unwrapped from the first one.

    `replies` of the clock are (sent_s, arrived_s, ticks).
    """

    seconds: float = 0.0
    words: BoardReports = field(default_factory=BoardReports)
    ticks: dict[str, list[int]] = field(default_factory=dict)
    pings: list[Ping] = field(default_factory=list)
    gyros: list[Gyros] = field(default_factory=list)
    compass: list[Compass] = field(default_factory=list)
    replies: list[tuple[float, float, int]] = field(default_factory=list)
    bytes_of: Counter[str] = field(default_factory=Counter)
    rejected: int = 0
    lost: int = 0
    stale: str = ""  # the board's schema is another one
    mtx_says: list[str] = field(default_factory=list)
    mtx_wrong: str = ""
    mtx_times_s: list[float] = field(default_factory=list)  # of its samples, as they arrived
    notices: list[str] = field(default_factory=list)

    @property
    def rates_hz(self) -> dict[str, float]:
        """Messages per second of the board's clock, after the first moments."""
        last = max((t[-1] for t in self.ticks.values()), default=0)
        first = SETTLED_S * TICKS_PER_S
        span_s = (last - first) / TICKS_PER_S
        if span_s < 1.0:
            return {}
        return {kind: sum(t > first for t in ticks) / span_s for kind, ticks in self.ticks.items()}

    @property
    def mtx_hz(self) -> float:
        """Samples per second of this computer's clock in the last second and a half; NaN when too few came."""
        late = [t for t in self.mtx_times_s if t > self.seconds - 1.5]
        return (len(late) - 1) / (late[-1] - late[0]) if len(late) > 10 and late[-1] > late[0] else math.nan


@dataclass(frozen=True, slots=True)
class Drift:
    """How the board's clock runs against this computer's: parts per million (+: fast), its standard deviation, and the usual answer time."""

    ppm: float
    sd_ppm: float
    answer_s: float


def drift_of(heard: ProbeResult) -> Drift | None:
    """A straight line through the faster half of the replies, each with the weight of its haste; None when there are too few."""
    if len(heard.replies) < 8:
        return None
    sent_s, arrived_s, ticks = np.array(heard.replies, float).T
    took_s = arrived_s - sent_s
    quick = took_s <= np.median(took_s)
    host_s = 0.5 * (sent_s + arrived_s)[quick]
    board_s = ticks[quick] / TICKS_PER_S
    weight = np.maximum(took_s[quick], 1e-4) ** -2.0
    weight /= weight.sum()
    host_s -= weight @ host_s
    board_s -= weight @ board_s
    spread = float(weight @ host_s**2)
    if quick.sum() < 4 or spread == 0.0:
        return None
    slope = float(weight @ (host_s * board_s)) / spread
    rest = board_s - slope * host_s
    sd = math.sqrt(float(weight**2 @ (rest * host_s) ** 2)) / spread  # [White 1980]: whatever each reply's own error
    return Drift((slope - 1.0) * 1e6, sd * 1e6, float(np.median(took_s)))


class _Listener:
    """One conversation with both ports."""

    def __init__(self, ports: SerialPorts, names: Mapping[str, str], check_gyros: bool) -> None:
        self.heard = ProbeResult()
        self._ports, self._names, self._check = ports, names, check_gyros
        self._board, self._mtx = BoardReader(), MtxReader()
        self._start = MtxStart(MtxTiming().rate_hz, lambda sent: ports.send(MTX, sent), self.heard.mtx_says.append)
        self._began_s = time.monotonic()
        self._sequence = 0
        self._asked: dict[int, float] = {}
        self._first: int | None = None
        self.extra_s = 0.0

    def run(self, seconds: float) -> None:
        """Listen for so long, and longer for a self-test that was asked for."""
        if BOARD in self._names:
            self._send(Identify())
        for chunk in self._ports.chunks():
            now_s = time.monotonic() - self._began_s
            if chunk is not None:
                self._take(chunk)
            self._follow_mtx(chunk)
            if BOARD in self._names and not self.heard.stale:
                self._ask(now_s)
            if now_s >= seconds + self.extra_s:
                break
        self.heard.seconds = time.monotonic() - self._began_s
        self.heard.rejected, self.heard.lost = self._board.counts.rejected, self._board.counts.lost
        self.heard.notices += self._ports.notices

    def _send(self, message: Message) -> None:
        self._ports.send(BOARD, encode(message, self._sequence))
        self._sequence += 1

    def _ask(self, now_s: float) -> None:
        if now_s >= ASK_S * len(self._asked):
            self._asked[len(self._asked)] = time.monotonic()
            self._send(ClockQuery(len(self._asked) - 1))
        if self._check and now_s > HEALTH_S and self.heard.words.gyros:
            self._check = False
            if any(said.self_test != SelfTest.PASSED for said in self.heard.words.gyros.values()):
                self.extra_s = TEST_S
                self._send(CheckGyros())

    def _take(self, chunk: Chunk) -> None:
        heard = self.heard
        heard.bytes_of[chunk.port] += len(chunk.data)
        arrived_s = chunk.t_arrival_ns * 1e-9
        if chunk.port == MTX:
            heard.mtx_times_s += [arrived_s - self._began_s] * len(self._mtx.feed(chunk.data))
            return
        if heard.stale:
            return
        try:
            for message in self._board.feed(chunk.data):
                self._hear(message, arrived_s)
        except StaleFirmwareError as error:
            heard.stale = str(error)

    def _hear(self, message: Message, arrived_s: float) -> None:
        heard = self.heard
        heard.words.take(message)
        ticks: int = getattr(message, "ticks", 0)
        self._first = ticks if self._first is None else self._first
        since = (ticks - self._first + (1 << 31)) % (1 << 32) - (1 << 31)
        heard.ticks.setdefault(type(message).__name__, []).append(since)
        if isinstance(message, ClockReply) and message.token in self._asked:
            heard.replies.append((self._asked[message.token], arrived_s, since))
        elif isinstance(message, Ping):
            heard.pings.append(message)
        elif isinstance(message, Gyros):
            heard.gyros.append(message)
        elif isinstance(message, Compass):
            heard.compass.append(message)

    def _follow_mtx(self, chunk: Chunk | None) -> None:
        if MTX not in self._names or self.heard.mtx_wrong:
            return
        try:
            self._start.follow(chunk)
        except EchostepError as error:
            self.heard.mtx_wrong = str(error)


def listen(names: Mapping[str, str], seconds: float, *, check_gyros: bool = False) -> ProbeResult:
    """Listen to the ports (URLs by `BOARD`, `MTX`); raises EchostepError when one cannot be opened.

    `check_gyros` asks for a self-test when the last one has not passed.
    """
    warm_up()
    BoardReader().feed(encode(Sync(0, 0), 0))  # compiles its kernel before anything waits for it
    ports = SerialPorts(names, BAUD)
    try:
        listener = _Listener(ports, names, check_gyros)
        listener.run(seconds)
    finally:
        ports.close()
    return listener.heard
