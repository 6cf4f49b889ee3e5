# SPDX-License-Identifier: MIT
"""Guides the wearer from point to point, and takes the taps.

In: lines that are typed, or the same from a page's buttons: Enter is the next point, a name that point, `u` takes the newest tap back. Out: the
bytes of taps; what to do next, in words. Owns the thread that reads the lines, and how far the walk has come.

What is typed or pressed counts at once, in the thread that brings it, so the next point is asked for while the run is behind its ports.
"""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, TextIO

from echostep_app.page.elements.taps import NO_TAP, PointPress, ShownPoints
from echostep_app.ports.arrival_clock import now_ns
from echostep_app.ports.tap import Tap
from echostep_app.session.acceptance.protocol import Protocol, Visit

if TYPE_CHECKING:
    from echostep_app.page.mailbox import Mailbox

HELP = (
    "Enter: at the point that is asked for; its name and Enter: at another one; u and Enter: that was no tap; Ctrl-C ends. "
    "The page has buttons for the same."
)
KEY, BUTTON = "Enter", "press"  # what the wearer does at a point, in words
REST_S = 5.0  # for which the wearer stands after the last tap: estimates come twice a second
MOST_LETTERS = 64  # of a line that is looked at; a name has at most 32
MOST_TAPS = 1000  # that wait while the run is behind


class Guide:
    """Call `pop` after each chunk of the run. `metadata`: fields of the recording."""

    def __init__(
        self, protocol: Protocol, rounds: int, lines: TextIO, say: Callable[[str], None], fields: Mapping[str, str]
    ) -> None:
        """`fields`: of the metadata besides the protocol."""
        self.metadata = {**protocol.metadata, **fields}
        self._points, self._rounds = protocol.points, rounds
        self._visits = protocol.visits(rounds)
        self._say = say
        self._lines = lines
        self._lock = threading.RLock()
        self._waiting: queue.Queue[Tap] = queue.Queue(MOST_TAPS)
        self._tapped: list[int] = []  # numbers of the visits
        self._ended_s: float | None = None
        self._begun = False
        self._page: Mailbox | None = None

    def _read(self) -> None:
        """Take the lines up to the end of the input, which is also that of a terminal that was closed."""
        with suppress(OSError, ValueError):
            while line := self._lines.readline(MOST_LETTERS):
                self._take(now_ns(), line.strip())
        self._say("No more lines can be typed: what was tapped counts; Ctrl-C ends.")

    def attach(self, page: Mailbox) -> None:
        """Show the points on a page, whose buttons do as the keys."""
        self._page = page
        page.on_press = self.press

    @property
    def _next(self) -> int:
        """Number of the next visit."""
        return self._tapped[-1] + 1 if self._tapped else 0

    def pop(self) -> list[bytes]:
        """Taps since the last call; the first one says what to do."""
        if not self._begun:
            self._begun = True
            self._say(HELP)
            self._ask()
            threading.Thread(target=self._read, daemon=True).start()
        return [self._waiting.get().encode() for _ in range(self._waiting.qsize())]

    def press(self, press: PointPress) -> bool:
        """Take the press of a button; False where it showed an earlier visit: a second press of a slow button is none."""
        with self._lock:
            return press.number == self._next and self._take(press.t_ns, press.typed)

    def _take(self, t_ns: int, typed: str) -> bool:
        """Queue the tap of a line and say what to do next; False while too many taps wait."""
        with self._lock:
            if self._waiting.full():
                return False
            if (tap := self._tap(t_ns, typed)) is not None:
                self._waiting.put(tap)
                self._ended_s = time.monotonic() if self._next == len(self._visits) else None
            self._ask()
        return True

    def _ask(self) -> None:
        """Say what the wearer does next, on the terminal and on the page."""
        number, name = self._next, self._name(self._next)
        self._say(f"{self._request(KEY)}: {name}" if number and name else self._request(KEY))
        if self._page:
            later = dict.fromkeys(self._name(k) for k in range(number, len(self._visits)))
            self._page.set_points(
                ShownPoints(number, name, self._request(BUTTON), tuple(later), undo=bool(self._tapped))
            )

    def _name(self, number: int) -> str:
        """Name of the point of a visit; empty after the last one."""
        return self._points[self._visits[number].point].name if number < len(self._visits) else ""

    def is_over(self) -> bool:
        """Whether the last point was tapped, and the wearer has stood since."""
        return self._ended_s is not None and time.monotonic() - self._ended_s >= REST_S

    def _tap(self, t_ns: int, typed: str) -> Tap | None:
        """The tap of a line; None for one that is none, which is said."""
        if typed == NO_TAP:
            if self._tapped:
                self._tapped.pop()
                return Tap(None, t_ns=t_ns)
            self._say("There is no tap to take back.")
            return None
        rest = range(self._next, len(self._visits))
        number = next((k for k in rest if typed in ("", self._points[self._visits[k].point].name)), None)
        if number is None:
            self._say(f"{typed[:32]!r} is no point that is still to come." if rest else "All points were tapped.")
            return None
        if missed := number - self._next:
            self._say(f"{missed} point{'s' if missed > 1 else ''} left out.")
        self._tapped.append(number)
        return Tap(*self._visits[number], t_ns)

    def _request(self, press: str) -> str:
        """What the wearer does next, by a key or a button; the point's name follows."""
        number = self._next
        if number == len(self._visits):
            return f"The last point. Stand still for {REST_S:.0f} s: the page follows."
        if not number:
            at, ahead = self._points[:2]
            return (
                f"Stand on point {at.name}, look to point {ahead.name}, and stay. {press.capitalize()} while you stand."
            )
        round_number = (number - 1) // (2 * (len(self._points) - 1)) + 1
        manner = _manner(self._visits[number], len(self._points), press)
        return f"{number} of {len(self._visits) - 1}, round {round_number} of {self._rounds}: {manner}"


def _manner(visit: Visit, points: int, press: str) -> str:
    """How a point is visited."""
    turns = visit.point in (0, points - 1)
    if visit.standing:
        return f"stop with both feet beside it, {press}, {'then turn slowly on the spot' if turns else 'walk on'}"
    return f"{press} as you arrive, then turn slowly on the spot" if turns else f"{press} as you pass"
