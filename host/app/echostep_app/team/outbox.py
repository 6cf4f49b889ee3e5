# SPDX-License-Identifier: MIT
"""The outbox: a bounded queue of reports between the tracker's thread and a network connection.

In: reports, from the tracker's thread. Out: the same reports, numbered and dated, through a `Transport`, from a thread of its own. Owns
that thread, the queue and the counts. When the connection is slow or broken, the newest report is sent first and older ones are counted as
overtaken. The tracker never waits.
"""

from __future__ import annotations

import random
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Protocol

from echostep_app.printing.lines import moment
from echostep_app.team.age import later
from echostep_app.team.faults import in_words
from echostep_app.team.messages.report import Report, ReportedAlarm

# After so long without a new estimate the last one is sent again, with its age and a larger covariance
HEARTBEAT_S = 2.0
VALID_S = 10.0  # a report is valid for so long
MAX_QUEUED = 1024  # reports
FRESH_S = 1.0  # a report that has waited longer is dropped when a newer one waits too
RETRY_PAUSES_S = (0.5, 1.0, 2.0, 4.0, 8.0)  # after the first, second, ... failure in a row
CLOSING_S = 3.0  # for sending the last reports at the end
LATE_S = 2.0  # an answer that is awaited for longer is told: with the time between two questions this is less than 3 s


class Answer:
    """A context in which the other side's answer is awaited; `words`: that it is late, empty if not, for any thread."""

    def __init__(self) -> None:
        self._asked_s: float | None = None

    def __enter__(self) -> None:
        self._asked_s = time.monotonic()

    def __exit__(self, *_: object) -> None:
        self._asked_s = None

    @property
    def words(self) -> str:
        """That the answer is late."""
        asked_s = self._asked_s
        waits_s = 0.0 if asked_s is None else time.monotonic() - asked_s
        return f"no answer for {waits_s:.0f} s" if waits_s > LATE_S else ""


class Delivery(StrEnum):
    """The fate of a report: acknowledged by the receiver; sent; not sent, and a newer one may be."""

    ACKNOWLEDGED = "acknowledged"
    SENT = "sent"
    LEFT_OUT = "left out"


class Transport(Protocol):
    """A connection that sends reports; `open` and `send` raise OSError when it is broken, and block for a few seconds at most."""

    def open(self) -> None:
        """Connect."""

    def send(self, report: Report) -> Delivery:
        """Send a report, and wait for its acknowledgement if the protocol has one."""

    def close(self, *, ended: bool) -> None:
        """Close the connection, in order if the run has `ended`; raises nothing."""


@dataclass(slots=True)
class OutboxCounts:
    """Counts of reports; `offered` = `sent` + `left_out` + `overtaken` + those still in the queue."""

    offered: int = 0
    sent: int = 0  # without heartbeats
    left_out: int = 0  # by the transport: no point for a map, nobody listens
    heartbeats: int = 0
    overtaken: int = 0
    breaks: int = 0


class Outbox:
    """`offer` never blocks; `close` sends the newest report before it ends, if the connection works.

    `fault`: why reports do not go out at present; empty while they do. `delivered`: the newest alarm that went out, and how.
    """

    def __init__(self, transport: Transport, name: str, print_line: Callable[[str], None]) -> None:
        self.counts = OutboxCounts()
        self._fault, self._answer = "", Answer()
        self.delivered: tuple[ReportedAlarm, Delivery] | None = None
        self._transport, self.name, self._print_line = transport, name, print_line
        self._queue: deque[tuple[float, Report]] = deque()
        self._last: tuple[float, Report] | None = None
        self._sequence = 0
        self._changed = threading.Condition()
        self._closing_s: float | None = None
        self._open = False
        self._failures = 0
        self._thread = threading.Thread(target=self._work, name=f"outbox {name}", daemon=True)
        self._thread.start()

    @property
    def fault(self) -> str:
        """Why reports do not go out at present."""
        return self._fault or self._answer.words

    def offer(self, report: Report) -> None:
        """Append a report to the queue; the oldest is dropped when it is full."""
        with self._changed:
            self.counts.offered += 1
            self._queue.append((time.monotonic(), report))
            if len(self._queue) > MAX_QUEUED:
                self._queue.popleft()
                self.counts.overtaken += 1
            self._changed.notify()

    def begin_close(self) -> None:
        """Let the thread send the newest reports, then end; returns at once."""
        with self._changed:
            self._closing_s = self._closing_s or time.monotonic() + CLOSING_S
            self._changed.notify()

    def close(self) -> str:
        """Wait for the thread to end, some seconds at most; returns a line with the counts."""
        self.begin_close()
        self._thread.join(CLOSING_S + 6.0)
        c = self.counts
        unsent = c.offered - c.sent - c.overtaken - c.left_out
        left_out = f", {c.left_out} left out" if c.left_out else ""
        last = f"; at the end: {self.fault}" if self.fault else ""
        return (
            f"{self.name}: {c.sent} of {c.offered} reports sent, {c.overtaken} overtaken by newer ones, {unsent} unsent{left_out}, "
            f"{c.heartbeats} heartbeats, connection broken {c.breaks} times{last}"
        )

    def _work(self) -> None:
        while not self._over():
            try:
                if not self._open:
                    with self._answer:
                        self._transport.open()
                    self._open = True
                self._send_next()
            except Exception as error:  # any fault is printed, and tracking goes on
                self._handle_break(error)
        self._transport.close(ended=True)

    def _send_next(self) -> None:
        """Send the next report; after a failure it returns to the queue."""
        entry, heartbeat = self._next()
        if entry is None:
            return
        self._last = entry
        try:
            self._sequence += 1
            age_s, overtaken = time.monotonic() - entry[0], self.counts.overtaken
            with self._answer:
                delivery = self._transport.send(stamped(entry[1], self._sequence, time.time(), age_s, overtaken))
        except OSError:
            if not heartbeat:
                with self._changed:
                    self._queue.appendleft(entry)
            raise
        if self._failures:
            self._print_state("connected again")
        self._fault, self._failures = "", 0
        alarm = entry[1].alarm
        if alarm and delivery is not Delivery.LEFT_OUT:
            self.delivered = alarm, delivery
        if heartbeat:
            self.counts.heartbeats += 1
        elif delivery is Delivery.LEFT_OUT:
            self.counts.left_out += 1
        else:
            self.counts.sent += 1

    def _next(self) -> tuple[tuple[float, Report] | None, bool]:
        """The next report, and whether it is a heartbeat; None when there is nothing to send."""
        with self._changed:
            self._changed.wait_for(lambda: bool(self._queue) or self._closing_s is not None, HEARTBEAT_S)
            if not self._queue:
                return (self._last, True) if self._closing_s is None else (None, False)
            oldest_s = time.monotonic() - FRESH_S
            while len(self._queue) > 1 and self._queue[0][0] < oldest_s:
                self._queue.popleft()
                self.counts.overtaken += 1
            return self._queue.popleft(), False

    def _over(self) -> bool:
        with self._changed:
            if self._closing_s is None:
                return False
            given_up = self._failures > 0 or time.monotonic() > self._closing_s
            return given_up or not self._queue

    def _print_state(self, text: str) -> None:
        with suppress(OSError, ValueError):  # the terminal may be closed
            self._print_line(f"{self.name}: {text}")

    def _handle_break(self, error: Exception) -> None:
        """Close the connection and wait before the next try; the first failure of a series is printed."""
        self._transport.close(ended=False)
        if self._open:
            self.counts.breaks += 1
        self._open = False
        self._fault = in_words(error)
        if self._failures == 0:
            self._print_state(f"{self._fault}; tracking goes on, trying again")
        pause_s = RETRY_PAUSES_S[min(self._failures, len(RETRY_PAUSES_S) - 1)] * random.uniform(0.8, 1.2)
        self._failures += 1
        with self._changed:
            self._changed.wait_for(lambda: self._closing_s is not None, pause_s)


def stamped(report: Report, sequence: int, unix_s: float, age_s: float, overtaken: int) -> Report:
    """The report with its number and the time of sending, as old as it is by then."""
    return replace(
        later(report, age_s),
        sequence=sequence,
        time=moment(unix_s),
        stale=moment(unix_s + VALID_S),
        superseded=overtaken,
    )
