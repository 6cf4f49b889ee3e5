# SPDX-License-Identifier: MIT
"""Configuring an MT, sans-I/O: requests, acknowledgements, timeouts, retries, WakeUp and error messages.

In: bytes from the MT's port, and a clock in seconds. Out: bytes to send, and the result in one line. Owns the requests that are not yet acknowledged.

    GoToConfig -> requests -> GoToMeasurement      each until its acknowledgement, or TRIES times
    CONFIGURED     all acknowledged
    UNANSWERED     no acknowledgement, and samples with everything that is needed come at the wanted rate
    WRONG_MODE     a request failed, or the stream has another format
    SILENT         no acknowledgement and no measurement
A WakeUp starts again at any time, and so does a measurement in SILENT. A device that never answered is asked for GoToConfig again until it does.

An acknowledgement carries the identifier of its request plus one; an error message carries a code instead [Manual 5.3.1 and 5.3.2].
The product code tells the kind of MT; the MTx's successors are the MTi 1 and 600 series.
"""

from __future__ import annotations

import re
from collections import deque
from enum import Enum
from typing import NamedTuple

import numpy as np

from echostep.xsens.frames import ERROR, MTDATA, MTDATA2, WAKE_UP, Frame, FrameReader, encode_frame
from echostep.xsens.mtdata import PROJECT
from echostep.xsens.mtdata2 import decode_mtdata2, find_packets
from echostep.xsens.reader import MtxReader
from echostep_app.xsens.requests import (
    GO_TO_CONFIG,
    GO_TO_MEASUREMENT,
    REQUEST_FIRMWARE,
    REQUEST_PRODUCT,
    WAKE_UP_ACK,
    Request,
    error_text,
)

# By series, of MTi [MTi 1-series and MTi 600-series data sheets, as remembered: compare them with a copy]
FORCE_RANGE_G = {"1": 16.0, "600": 10.0}
_TEXT = re.compile(r"[ -~]+")


def product_text(code: bytes) -> str:
    """The product code as text, "" unless it is printable, padded with blanks or zeros [LLCP, ProductCode]."""
    text = code.rstrip(b"\0").decode("latin-1").strip()
    return text if _TEXT.fullmatch(text) else ""


def force_range_g(product: str) -> float | None:
    """Largest force in g of an MTi by its product code, as `MTi-3-8A7G6`; None if unknown."""
    match = re.match(r"MTi-(\d+)", product)
    if match is None:
        return None
    number = int(match[1])
    return FORCE_RANGE_G.get("1" if number < 10 else "600" if 600 <= number < 700 else "")


TRIES = 4  # of each request: one more than Xsens' own library makes for GoToConfig [CMT]
FIRST_TRIES = 7  # of GoToConfig: a device whose queue of samples is long answers after more than a second
AGAIN_S = 1.0  # between two later requests to a device that has never answered; assumed
TIMEOUT_S = 0.25  # for an acknowledgement: buffered measurements arrive before it
MAX_WAKE_UPS = 20  # after more wake-ups the setup is not started again: the supply is bad
RATE_ERROR = 0.3  # largest relative error of the measured rate: it is measured over a short time
RATE_SPAN_S = 0.5  # least time over which a rate is measured; assumed
BACKLOG_S = 0.2  # measurements of this time are not used for the rate: buffered ones come at once
MAX_MEASUREMENTS = 1000  # kept for the rate; assumed

CHECK_LINE = "Check the line from host to MTx (its RX)"
BY_HAND = "set it once with Xsens' MT Manager to calibrated data + orientation as quaternion + sample counter, float, {rate:g} Hz, 115200 Bd"


class State(Enum):
    """State of the setup."""

    BUSY = "busy"
    CONFIGURED = "configured"  # every request was acknowledged
    UNANSWERED = "unanswered"  # no acknowledgement, but usable samples at the wanted rate
    WRONG_MODE = "wrong mode"  # a request failed, or no acknowledgement and the stream has another format
    SILENT = "silent"  # no acknowledgement and no measurement


class _Measurement(NamedTuple):
    """Identifier, payload and arrival time of one measurement message."""

    mid: int
    payload: bytes
    arrived_s: float


class MtxSetup:
    """Sets an MT, in whatever state it is, by requests, and starts its measurement; sets it again after each WakeUp.

    Call `advance` with every chunk of the port, and with b"" at least every 0.1 s.
    """

    def __init__(self, requests: tuple[Request, ...], rate_hz: float) -> None:
        """`requests`: to be sent between GoToConfig and GoToMeasurement."""
        self._requests = requests
        self._rate_hz = rate_hz
        self._frames = FrameReader()
        self._out: list[bytes] = []
        self.wake_ups = 0
        self.remarks: list[str] = []  # refused or replaced requests, for `verdict`
        self._restart(None)

    def _restart(self, now_s: float | None) -> None:
        """Begin again with GoToConfig; it is due at once."""
        self.state = State.BUSY
        self.remarks.clear()
        self._failure = ""
        self._queue = deque((GO_TO_CONFIG, *self._requests, GO_TO_MEASUREMENT))
        self._tries = 0
        self._deadline_s = -float("inf") if now_s is None else now_s
        self._received = 0
        self._measurements: list[_Measurement] = []  # since the restart, at most MAX_MEASUREMENTS
        self._reader = MtxReader()  # counts the usable ones
        self._acknowledged = False
        self._answers: dict[str, bytes] = {}  # by the request's name

    @property
    def finished(self) -> bool:
        """Whether all requests are done; only a WakeUp, a first answer, or a measurement in SILENT starts again."""
        return self.state is not State.BUSY

    def advance(self, received: bytes, now_s: float, arrived_s: float | None = None) -> bytes:
        """Process received bytes, which arrived at `arrived_s` (now when None); returns the bytes to send now."""
        self._received += len(received)
        for frame in self._frames.feed(received):
            self._handle(frame, now_s, now_s if arrived_s is None else arrived_s)
        if not self.finished:
            self._reader.feed_batch(received)
        if now_s >= self._deadline_s and not self.finished:
            self._send_due(now_s)
        elif now_s >= self._deadline_s and not self._acknowledged:
            self._deadline_s = now_s + AGAIN_S
            self._out.append(encode_frame(GO_TO_CONFIG.mid, GO_TO_CONFIG.payload))
        sent = b"".join(self._out)
        self._out.clear()
        return sent

    def _handle(self, frame: Frame, now_s: float, arrived_s: float) -> None:
        """Process one frame: a WakeUp, a measurement, an error message or an acknowledgement."""
        if frame.mid == WAKE_UP:
            self._handle_wake_up(now_s)
        elif frame.mid in (MTDATA, MTDATA2):
            if self.state is State.SILENT:
                self._restart(now_s)
            if len(self._measurements) < MAX_MEASUREMENTS:
                self._measurements.append(_Measurement(frame.mid, frame.payload, arrived_s))
        elif self.finished:
            if frame.mid == GO_TO_CONFIG.mid + 1 and not self._acknowledged:
                self._restart(now_s)
        else:
            request = self._queue[0]
            if frame.mid == ERROR and self._tries:
                self._handle_refusal(request, error_text(frame.payload), now_s)
            elif frame.mid == request.mid + 1 and self._tries:
                self._acknowledged = True
                fault = request.fault(frame.payload)
                if fault:
                    self._handle_refusal(request, fault, now_s)
                elif fault is not None:  # else a late answer to the request before
                    self._answers[request.name] = frame.payload
                    self._next_request(now_s)

    def _handle_wake_up(self, now_s: float) -> None:
        """Acknowledge a WakeUp and begin again; without an acknowledgement within 500 ms the device measures as before [LLCP, WakeUp]."""
        self.wake_ups += 1
        if self.wake_ups <= MAX_WAKE_UPS:
            self._restart(now_s)
            self._out = [encode_frame(WAKE_UP_ACK)]

    def _next_request(self, now_s: float) -> None:
        """Go on with the next request, or finish after the last one."""
        self._queue.popleft()
        self._tries, self._deadline_s = 0, now_s
        if not self._queue:
            self.state = State.WRONG_MODE if self._failure else State.CONFIGURED

    def _handle_refusal(self, request: Request, why: str, now_s: float) -> None:
        """Handle a refused request: repeat, replace by requests of the MTx's successors, skip, or abandon the setup."""
        if request is GO_TO_CONFIG or request is GO_TO_MEASUREMENT:
            return  # it is sent again until its tries are over
        if request.instead:
            self.remarks.append(request.remark)
            self._queue = deque((*request.instead, GO_TO_MEASUREMENT))
            self._tries, self._deadline_s = 0, now_s
        elif request.optional:
            self.remarks.append(f"{request.name} refused: {why}")
            self._next_request(now_s)
        else:
            self._abandon(f"it refuses {request.name}: {why}", now_s)

    def _send_due(self, now_s: float) -> None:
        """Send the current request again after its timeout; after TRIES times it has failed."""
        request = self._queue[0]
        if self._tries < (FIRST_TRIES if request is GO_TO_CONFIG else TRIES):
            self._tries += 1
            self._deadline_s = now_s + TIMEOUT_S
            self._out.append(encode_frame(request.mid, request.payload))
        elif request.optional:
            self.remarks.append(f"{request.name} was not answered")
            self._next_request(now_s)
        elif request is GO_TO_CONFIG or request is GO_TO_MEASUREMENT:
            self._failure = self._failure or f"it does not answer {request.name}{self._within}"
            self._conclude_unanswered()
        else:
            self._abandon(f"it does not answer {request.name}{self._within}", now_s)

    def _abandon(self, why: str, now_s: float) -> None:
        """Skip the remaining requests and start the measurement with the present settings."""
        self._failure = why
        self._queue = deque([GO_TO_MEASUREMENT])
        self._tries, self._deadline_s = 0, now_s

    def _conclude_unanswered(self) -> None:
        """Final state when GoToConfig or GoToMeasurement got no answer, by the received measurements."""
        if self._acknowledged:
            self.state = State.WRONG_MODE
        elif not self._measurements:
            self.state = State.SILENT
        else:
            self.state = State.UNANSWERED if not self._stream_fault() else State.WRONG_MODE

    def _stream_fault(self) -> str:
        """Wrong length, missing contents or wrong rate of the received measurements, as text; "" if usable samples come as wanted."""
        newest = self._measurements[-1]
        if newest.mid == MTDATA and len(newest.payload) != PROJECT.length:
            return f"MTData of {len(newest.payload)} bytes instead of {PROJECT.length}"
        if not self._reader.counts.good:
            missing = _missing_contents(newest.payload) if newest.mid == MTDATA2 else []
            what = " and ".join([", ".join(missing[:-1]), missing[-1]] if len(missing) > 1 else missing)
            kind = "MTData2" if newest.mid == MTDATA2 else "MTData"
            return f"{kind} without {what}" if what else f"{kind} whose values are not possible"
        begin_s = self._measurements[0].arrived_s + BACKLOG_S
        times = [measurement.arrived_s for measurement in self._measurements if measurement.arrived_s > begin_s]
        span_s = times[-1] - times[0] if times else 0.0
        rate_hz = (len(times) - 1) / span_s if span_s > RATE_SPAN_S else self._rate_hz
        if abs(rate_hz / self._rate_hz - 1.0) > RATE_ERROR:
            return f"about {rate_hz:.0f} Hz instead of {self._rate_hz:g}"
        return ""

    @property
    def _within(self) -> str:
        """Time that an answer was waited for, if the device has answered before: it is slow, not deaf."""
        return f" within {TRIES * TIMEOUT_S:g} s" if self._acknowledged else ""

    @property
    def product(self) -> str:
        """Product code of the device; "" until it is received."""
        return product_text(self._answers.get(REQUEST_PRODUCT.name, b""))

    @property
    def _device_text(self) -> str:
        """Product and firmware, after a colon."""
        # Major, minor and revision [LLCP, FirmwareRevision]
        firmware = self._answers.get(REQUEST_FIRMWARE.name, b"")[:3]
        known = [self.product, f"firmware {'.'.join(map(str, firmware))}" if len(firmware) == 3 else ""]
        return ": " + ", ".join(filter(None, known)) if any(known) else ""

    @property
    def verdict(self) -> str:
        """Result of the setup and, after a failure, the remedy, in one line."""
        by_hand = BY_HAND.format(rate=self._rate_hz)
        if self.state is State.CONFIGURED:
            return f"MTx: configured{self._device_text}" + "".join(f"; {remark}" for remark in self.remarks)
        if self.state is State.UNANSWERED:
            return "MTx: does not answer, but sends what is needed: it is used as it is, and asked again"
        if self.state is State.WRONG_MODE:
            fault = f", and sends {self._stream_fault()}" if self._measurements and self._stream_fault() else ""
            check = "Take its supply away, give it again and start once more" if self._acknowledged else CHECK_LINE
            return f"MTx: {self._failure}{fault}. {check}, or {by_hand}"
        if self.state is State.SILENT and self._received:
            return f"MTx: {self._received} bytes were received, but no frame: check that this is the MTx's port and that its rate is 115200 Bd"
        if self.state is State.SILENT:
            return "MTx: silent: check its supply, its cable and the port; waiting for it"
        return "MTx: configuration in progress"


def _missing_contents(payload: bytes) -> list[str]:
    """Fields of a sample that are missing in a payload, in words."""
    packets = find_packets(np.frombuffer(payload, np.uint8), np.array([0]), np.array([len(payload)]))
    _, counter, sent = decode_mtdata2(np.frombuffer(payload, np.uint8), packets)
    present = {"sample counter": counter[0] >= 0, "acceleration": sent[0, 0], "rate of turn": sent[0, 1]}
    return [name for name, is_there in present.items() if not is_there]
