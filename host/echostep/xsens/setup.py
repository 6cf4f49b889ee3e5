"""Configuring an MT, sans-I/O: requests, acknowledgements, timeouts, retries, WakeUp and error messages.

In: bytes from the MT's port and a clock in seconds. Out: bytes to send, and in the end one sentence about what happened. Owns the exchange under way.
An acknowledgement carries the identifier of its request plus one; an error message carries a code instead [Manual 5.3.1 and 5.3.2].
"""

from __future__ import annotations

from collections import deque
from enum import Enum

from echostep.xsens.frames import ERROR, MTDATA, MTDATA2, WAKE_UP, Frame, FrameReader, encode_frame
from echostep.xsens.mtdata import PROJECT
from echostep.xsens.requests import (
    GO_TO_CONFIG,
    GO_TO_MEASUREMENT,
    WAKE_UP_ACK,
    Request,
    error_text,
    successor_requests,
)

TRIES = 4  # of each request; three is what Xsens' own library gives GoToConfig [CMT]
TIMEOUT_S = 0.25  # for an acknowledgement; before it come what the line and the host still hold of the measurements
MAX_WAKE_UPS = 20  # a device that wakes up more often has a bad supply
RATE_ERROR = 0.3  # share by which a rate that is seen for so short may be off
RATE_SPAN_S = 0.5
BACKLOG_S = 0.2  # what was waiting in the system when the port was opened comes at once

BY_HAND = "set it once with Xsens' MT Manager to calibrated data + orientation as quaternion + sample counter, float, {rate:g} Hz, 115200 Bd"


class State(Enum):
    """How far the setup is."""

    BUSY = "busy"
    CONFIGURED = "configured"  # every request was acknowledged
    UNANSWERED = "unanswered"  # no acknowledgement, but it streams what is wanted
    WRONG_MODE = "wrong mode"  # no acknowledgement, and it streams something else
    SILENT = "silent"  # nothing came, or nothing that is an Xsens frame


class MtxSetup:
    """Brings an MT from any state to measuring what the requests say; one that wakes up later is set up again.

    Call `advance` with every chunk of the port, and with b"" at least every tenth of a second.
    """

    def __init__(self, requests: tuple[Request, ...], rate_hz: float) -> None:
        """`requests`: after GoToConfig and before GoToMeasurement."""
        self._wanted = requests
        self._rate_hz = rate_hz
        self._frames = FrameReader()
        self._out: list[bytes] = []
        self.wake_ups = 0
        self.remarks: list[str] = []  # what was refused or done differently
        self._restart(None)

    def _restart(self, now_s: float | None) -> None:
        self.state = State.BUSY
        self.remarks.clear()
        self._failure = ""
        self._queue = deque((GO_TO_CONFIG, *self._wanted, GO_TO_MEASUREMENT))
        self._tries = 0
        self._deadline_s = -float("inf") if now_s is None else now_s
        self._received = 0
        self._streamed: list[
            tuple[int, int, float]
        ] = []  # identifier, length, arrival of measurements before any acknowledgement
        self._acknowledged = False

    @property
    def finished(self) -> bool:
        """Whether nothing more will be sent unless the device wakes up."""
        return self.state is not State.BUSY

    def advance(self, received: bytes, now_s: float, arrived_s: float | None = None) -> bytes:
        """Take what came, at `arrived_s` if that was not just now; returns what to send now."""
        self._received += len(received)
        for frame in self._frames.feed(received):
            self._take(frame, now_s, now_s if arrived_s is None else arrived_s)
        if not self.finished and now_s >= self._deadline_s:
            self._send_again(now_s)
        sent = b"".join(self._out)
        self._out.clear()
        return sent

    def _take(self, frame: Frame, now_s: float, arrived_s: float) -> None:
        if frame.mid == WAKE_UP:
            self._woken(now_s)
        elif frame.mid in (MTDATA, MTDATA2):
            if self.state is State.SILENT:
                self._restart(now_s)
            if len(self._streamed) < 1000:
                self._streamed.append((frame.mid, len(frame.payload), arrived_s))
        elif not self.finished:
            request = self._queue[0]
            if frame.mid == ERROR and self._tries:
                self._refused(request, error_text(frame.payload), now_s)
            elif frame.mid == request.mid + 1 and self._tries:
                self._acknowledged = True
                if request.answer is None or request.answer == frame.payload:
                    self._next(now_s)
                elif len(frame.payload) == len(request.answer):  # another length is a late answer to the request before
                    self._refused(request, f"it answers {frame.payload.hex()}", now_s)

    def _woken(self, now_s: float) -> None:
        """It just started, and measures as before unless this is acknowledged within 500 ms [LLCP, WakeUp]."""
        self.wake_ups += 1
        if self.wake_ups <= MAX_WAKE_UPS:
            self._restart(now_s)
            self._out = [encode_frame(WAKE_UP_ACK)]

    def _next(self, now_s: float) -> None:
        self._queue.popleft()
        self._tries, self._deadline_s = 0, now_s
        if not self._queue:
            self.state = State.WRONG_MODE if self._failure else State.CONFIGURED

    def _refused(self, request: Request, why: str, now_s: float) -> None:
        if request is GO_TO_CONFIG or request is GO_TO_MEASUREMENT:
            return  # it is asked again until its tries are over
        if request.legacy:
            self.remarks.append("it takes no legacy settings and sends MTData2")
            self._queue = deque((*successor_requests(self._rate_hz), GO_TO_MEASUREMENT))
            self._tries, self._deadline_s = 0, now_s
        elif request.optional:
            self.remarks.append(f"{request.name} refused: {why}")
            self._next(now_s)
        else:
            self._give_up(f"it refuses {request.name}: {why}", now_s)

    def _send_again(self, now_s: float) -> None:
        request = self._queue[0]
        if self._tries < TRIES:
            self._tries += 1
            self._deadline_s = now_s + TIMEOUT_S
            self._out.append(encode_frame(request.mid, request.payload))
        elif request.optional:
            self.remarks.append(f"{request.name} was not answered")
            self._next(now_s)
        elif request is GO_TO_CONFIG or request is GO_TO_MEASUREMENT:
            self._failure = self._failure or f"it does not answer {request.name}"
            self._judge_stream()
        else:
            self._give_up(f"it does not answer {request.name}", now_s)

    def _give_up(self, why: str, now_s: float) -> None:
        """Let it measure as it is set; the rest of the requests would not help."""
        self._failure = why
        self._queue = deque([GO_TO_MEASUREMENT])
        self._tries, self._deadline_s = 0, now_s

    def _judge_stream(self) -> None:
        """Nobody answered: what does it send?"""
        if self._acknowledged:
            self.state = State.WRONG_MODE
        elif not self._streamed:
            self.state = State.SILENT
        else:
            self.state = State.UNANSWERED if not self._misfits() else State.WRONG_MODE

    def _misfits(self) -> str:
        """What is wrong with the measurements that came; "" if nothing."""
        mid, length, _ = self._streamed[-1]
        if mid == MTDATA and length != PROJECT.length:
            return f"MTData of {length} bytes instead of {PROJECT.length}"
        times = [t for _, _, t in self._streamed if t > self._streamed[0][2] + BACKLOG_S]
        span_s = times[-1] - times[0] if times else 0.0
        rate_hz = (len(times) - 1) / span_s if span_s > RATE_SPAN_S else self._rate_hz
        if abs(rate_hz / self._rate_hz - 1.0) > RATE_ERROR:
            return f"about {rate_hz:.0f} Hz instead of {self._rate_hz:g}"
        return ""

    @property
    def verdict(self) -> str:
        """What happened and, where it helps, what to do, in one line."""
        by_hand = BY_HAND.format(rate=self._rate_hz)
        if self.state is State.CONFIGURED:
            return "MTx: configured" + "".join(f"; {remark}" for remark in self.remarks)
        if self.state is State.UNANSWERED:
            return "MTx: does not answer, but streams what is wanted: going on with it as it is"
        if self.state is State.WRONG_MODE:
            seen = f", and streams {self._misfits()}" if self._streamed and self._misfits() else ""
            return f"MTx: {self._failure}{seen}. Check the line from host to MTx (its RX), or {by_hand}"
        if self.state is State.SILENT and self._received:
            return f"MTx: {self._received} bytes came, but no frame: check that the port is the MTx's and its rate 115200 Bd"
        if self.state is State.SILENT:
            return "MTx: silent: check its supply, its cable and the port; waiting for it"
        return "MTx: being configured"
