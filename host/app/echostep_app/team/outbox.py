# SPDX-License-Identifier: MIT
"""The outbox: a bounded queue of reports between the tracker's thread and a network connection.

In: reports, from the tracker's thread. Out: the same reports, numbered and dated, through a `Transport`, from a thread of its own. Owns
that thread, the queue and the counts. When the connection is slow or broken, the newest report is sent first and older ones are counted as
overtaken. The tracker never waits.
"""

from __future__ import annotations

import math
import random
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Protocol

from echostep.localization import TrackStatus
from echostep.particles.ellipse import ellipse95
from echostep.particles.limits import RISK, WALKER_M_S
from echostep_app.printing.lines import moment
from echostep_app.team.faults import in_words
from echostep_app.team.messages.report import Position, Report, ReportedAlarm
from echostep_app.wearer.steady_status import SteadyStatus

# After so long without a new estimate the last one is sent again, with its age and a larger covariance
HEARTBEAT_S = 2.0
VALID_S = 10.0  # a report is valid for so long
MAX_QUEUED = 1024  # reports
FRESH_S = 1.0  # a report that has waited longer is dropped when a newer one waits too
SETTLED_S = 2.0  # largest normal age of an estimate: the tracker gives two a second, or one per stride
PROTECTED = math.sqrt(
    -2.0 * math.log(RISK)
)  # radius with this risk beyond it, in standard deviations per axis [Rayleigh]
MAX_WALK_S = 1e5  # the covariance stops to grow after so long, about a day
RETRY_PAUSES_S = (0.5, 1.0, 2.0, 4.0, 8.0)  # after the first, second, ... failure in a row
CLOSING_S = 3.0  # for sending the last reports at the end


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
        self.fault = ""
        self.delivered: tuple[ReportedAlarm, Delivery] | None = None
        self._transport, self.name, self._print_line = transport, name, print_line
        self._queue: deque[tuple[float, Report]] = deque()
        self._last: tuple[float, Report] | None = None
        self._sequence, self._steady = 0, SteadyStatus()
        self._changed = threading.Condition()
        self._closing_s: float | None = None
        self._open = False
        self._failures = 0
        self._thread = threading.Thread(target=self._work, name=f"outbox {name}", daemon=True)
        self._thread.start()

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
            delivery = self._transport.send(self._stamped(entry))
        except OSError:
            if not heartbeat:
                with self._changed:
                    self._queue.appendleft(entry)
            raise
        if self._failures:
            self._print_state("connected again")
        self.fault, self._failures = "", 0
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

    def _stamped(self, entry: tuple[float, Report]) -> Report:
        offered_s, report = entry
        self._sequence += 1
        age_s = time.monotonic() - offered_s
        made = stamped(report, self._sequence, time.time(), age_s, self.counts.overtaken)
        return steadied(made, age_s, self._steady)

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
        self.fault = in_words(error)
        if self._failures == 0:
            self._print_state(f"{self.fault}; tracking goes on, trying again")
        pause_s = RETRY_PAUSES_S[min(self._failures, len(RETRY_PAUSES_S) - 1)] * random.uniform(0.8, 1.2)
        self._failures += 1
        with self._changed:
            self._changed.wait_for(lambda: self._closing_s is not None, pause_s)


def stamped(report: Report, sequence: int, unix_s: float, age_s: float, overtaken: int) -> Report:
    """The report with its number, the time of sending, and a covariance that grows with the age of its position, until that is lost."""
    age_s, last, place = max(age_s, 0.0), report.last_place, report.place
    position = report.position and aged(report.position, age_s)
    status = report.status if position is None or age_s <= SETTLED_S else TrackStatus.of(position.radius95_m).value
    last = position if position and status == "lost" else last and aged(last, last.age_s + age_s)
    if position and place:
        place = replace(place, sd_m=(place.sd_m**2 + _walk_variance_m2(age_s)) ** 0.5)
    report = replace(
        report,
        sequence=sequence,
        time=moment(unix_s),
        stale=moment(unix_s + VALID_S),
        superseded=overtaken,
        status=status,
    )
    return without_place(report, last) if last else replace(report, position=position, place=place)


def steadied(report: Report, age_s: float, steady: SteadyStatus) -> Report:
    """The report as lost for HOLD_S, in its position's time, after one that was lost by its age; its position is the last one then."""
    known = report.position or report.last_place
    if known is None:
        return report
    by_age = TrackStatus.LOST if age_s > SETTLED_S else TrackStatus.TRACKING
    is_lost = steady.worst(known.t_s + known.age_s, by_age) is TrackStatus.LOST
    return without_place(replace(report, status="lost"), known) if is_lost else report


def without_place(report: Report, last: Position | None) -> Report:
    """The report of a lost wearer: without position and place on Earth, with the last known position."""
    return replace(report, position=None, place=None, last_place=last)


def aged(position: Position, age_s: float) -> Position:
    """A position `age_s` after its estimate: the covariance grows as if the wearer had walked in any direction at WALKER_M_S."""
    more = _walk_variance_m2(age_s)
    xx, yy = position.xx_m2 + more, position.yy_m2 + more
    radius = ellipse95(xx, position.xy_m2, yy).major_m if more else position.radius95_m
    protection = position.protection_m
    if more and protection is not None:
        protection = min(protection + PROTECTED * math.sqrt(more), 1e7)
    return replace(position, age_s=age_s, xx_m2=xx, yy_m2=yy, radius95_m=radius, protection_m=protection)


def _walk_variance_m2(age_s: float) -> float:
    """Variance per axis of an unobserved walk of so many seconds, m2; 0 up to SETTLED_S."""
    return (WALKER_M_S * min(age_s, MAX_WALK_S)) ** 2 if age_s > SETTLED_S else 0.0
