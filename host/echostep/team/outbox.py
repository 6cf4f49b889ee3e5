"""The outbox: reports leave the tracker's thread at once, and the machine when the network allows.

In: reports, from the tracker's thread. Out: the same, stamped, through a `Line`, from a thread of its own. Owns that thread, a bounded queue and the
counts. When the line is slow or broken the newest report goes first and overtaken ones are counted; the tracker never waits.
"""

from __future__ import annotations

import random
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Protocol

from echostep.localization.estimate import WALKER_M_S, ellipse95, trust
from echostep.team.report import Position, Report, moment

HEARTBEAT_S = 2.0  # without a new estimate the last one is told again, older and wider
STALE_S = 10.0
WAITING = 1024  # reports
FRESH_S = 1.0  # what has waited longer than this is overtaken by the newest
SETTLED_S = 2.0  # the tracker speaks twice a second, or at each stride; beyond this it is silent
FARTHEST_S = 1e5  # after a day's walk nothing is left to say
BACKOFF_S = (0.5, 1.0, 2.0, 4.0, 8.0)
CLOSING_S = 3.0


class Line(Protocol):
    """A way out; everything raises OSError when it is broken and waits a few seconds at most."""

    def open(self) -> None:
        """Connect."""

    def send(self, report: Report) -> None:
        """Return when the other side has it, or as near to that as the protocol tells."""

    def close(self, *, ended: bool) -> None:
        """Say good-bye when the run has `ended`; raises nothing."""


@dataclass(slots=True)
class OutboxCounts:
    """What became of the reports; `offered` = `estimates sent` + `overtaken` + those that still wait."""

    offered: int = 0
    sent: int = 0  # estimates, each once
    heartbeats: int = 0
    overtaken: int = 0
    breaks: int = 0


class Outbox:
    """`offer` never blocks; `close` ends with the newest report sent, if the line holds."""

    def __init__(self, line: Line, name: str, say: Callable[[str], None]) -> None:
        self.counts = OutboxCounts()
        self._line, self._name, self._say = line, name, say
        self._queue: deque[tuple[float, Report]] = deque()
        self._last: tuple[float, Report] | None = None
        self._sequence = 0
        self._changed = threading.Condition()
        self._closing_s: float | None = None
        self._open = False
        self._failures = 0
        self._thread = threading.Thread(target=self._work, name=f"outbox {name}", daemon=True)
        self._thread.start()

    def offer(self, report: Report) -> None:
        """Put a report in the queue; the oldest gives way when it is full."""
        with self._changed:
            self.counts.offered += 1
            self._queue.append((time.monotonic(), report))
            if len(self._queue) > WAITING:
                self._queue.popleft()
                self.counts.overtaken += 1
            self._changed.notify()

    def end(self) -> None:
        """Begin to close: send what is fresh, then end the thread."""
        with self._changed:
            self._closing_s = self._closing_s or time.monotonic() + CLOSING_S
            self._changed.notify()

    def close(self) -> str:
        """Wait for the end, some seconds at most, and tell how it went."""
        self.end()
        self._thread.join(CLOSING_S + 6.0)
        c = self.counts
        unsent = c.offered - c.sent - c.overtaken
        return (
            f"{self._name}: {c.sent} of {c.offered} reports sent, {c.overtaken} overtaken by newer ones, {unsent} unsent, "
            f"{c.heartbeats} heartbeats, connection broken {c.breaks} times"
        )

    def _work(self) -> None:
        while not self._over():
            try:
                if not self._open:
                    self._line.open()
                    self._open = True
                    if self._failures:
                        self._tell("connected again")
                    self._failures = 0
                self._step()
            except Exception as error:  # whatever it is, it is said, and tracking goes on
                self._broken(error)
        self._line.close(ended=True)

    def _step(self) -> None:
        """Send the next report; on failure it waits again, unless a newer one has come."""
        entry, heartbeat = self._next()
        if entry is None:
            return
        self._last = entry
        try:
            self._line.send(self._stamped(entry))
        except OSError:
            if not heartbeat:
                with self._changed:
                    self._queue.appendleft(entry)
            raise
        if heartbeat:
            self.counts.heartbeats += 1
        else:
            self.counts.sent += 1

    def _next(self) -> tuple[tuple[float, Report] | None, bool]:
        """The next report and whether it is a heartbeat; None when it is time to end."""
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
        return stamped(report, self._sequence, time.time(), time.monotonic() - offered_s, self.counts.overtaken)

    def _over(self) -> bool:
        with self._changed:
            if self._closing_s is None:
                return False
            given_up = self._failures > 0 or time.monotonic() > self._closing_s
            return given_up or not self._queue

    def _tell(self, words: str) -> None:
        with suppress(OSError, ValueError):  # a terminal that is gone
            self._say(f"{self._name}: {words}")

    def _broken(self, error: Exception) -> None:
        """Say it once, then wait longer and longer."""
        self._line.close(ended=False)
        if self._open:
            self.counts.breaks += 1
        self._open = False
        if self._failures == 0:
            self._tell(f"{_reason(error)}; tracking goes on, trying again")
        pause_s = BACKOFF_S[min(self._failures, len(BACKOFF_S) - 1)] * random.uniform(0.8, 1.2)
        self._failures += 1
        with self._changed:
            self._changed.wait_for(lambda: self._closing_s is not None, pause_s)


def _reason(error: Exception) -> str:
    return (isinstance(error, OSError) and error.strerror) or str(error) or type(error).__name__


def stamped(report: Report, sequence: int, unix_s: float, age_s: float, overtaken: int) -> Report:
    """The report as it is sent: with its number, its time, and its position as wide as its age makes it."""
    position = report.position and aged(report.position, max(age_s, 0.0))
    return replace(
        report,
        sequence=sequence,
        time=moment(unix_s),
        stale=moment(unix_s + STALE_S),
        superseded=overtaken,
        position=position,
        status=report.status if position is None or position.age_s <= SETTLED_S else trust(position.radius95_m).value,
        place=report.place if position is None or report.place is None else replace(
            report.place, sd_m=(report.place.sd_m**2 + _walked2(position.age_s)) ** 0.5
        ),
    )  # fmt: skip


def aged(position: Position, age_s: float) -> Position:
    """A position so many seconds later, when nothing more was heard: he may have walked any way at a walker's speed."""
    more = _walked2(age_s)
    xx, yy = position.xx_m2 + more, position.yy_m2 + more
    radius = ellipse95(xx, position.xy_m2, yy).major_m if more else position.radius95_m
    return replace(position, age_s=age_s, xx_m2=xx, yy_m2=yy, radius95_m=radius)


def _walked2(age_s: float) -> float:
    """Variance of a walk that nobody watched, m2."""
    return (WALKER_M_S * min(age_s, FARTHEST_S)) ** 2 if age_s > SETTLED_S else 0.0
