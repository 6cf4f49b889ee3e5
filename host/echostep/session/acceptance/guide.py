# SPDX-License-Identifier: MIT
"""Guides the wearer from point to point, and takes the taps.

In: lines that are typed: Enter is the next point, a name that point, `u` takes the newest tap back. Out: the bytes of taps; what to do next, in
words. Owns the thread that reads the lines, and how far the walk has come.
"""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TextIO

from echostep.ports.arrival_clock import now_ns
from echostep.ports.people.tap import Tap
from echostep.session.acceptance.protocol import Protocol, Visit

UNDO = "u"
HELP = "Enter: at the point that is asked for; its name and Enter: at another one; u and Enter: that was no tap; Ctrl-C ends."
REST_S = 5.0  # for which the wearer stands after the last tap: estimates come twice a second
MOST_LETTERS, MOST_LINES = 64, 16  # of a line that is looked at, a name has at most 32; of lines that wait


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
        # Lines with their times; None: no more come
        self._typed: queue.Queue[tuple[int, str | None]] = queue.Queue(MOST_LINES)
        self._tapped: list[int] = []  # numbers of the visits
        self._ended_s: float | None = None
        self._begun = False
        threading.Thread(target=self._read, args=(lines,), daemon=True).start()

    def _read(self, lines: TextIO) -> None:
        """Queue the lines up to the end of the input, which is also that of a terminal that was closed."""
        with suppress(OSError, ValueError):
            while line := lines.readline(MOST_LETTERS):
                self._typed.put((now_ns(), line.strip()))
        self._typed.put((now_ns(), None))

    @property
    def _next(self) -> int:
        """Number of the next visit."""
        return self._tapped[-1] + 1 if self._tapped else 0

    def pop(self) -> list[bytes]:
        """Taps since the last call; says what to do next."""
        if not self._begun:
            self._begun = True
            self._say(HELP)
            self._say(self._request())
        payloads = []
        for _ in range(self._typed.qsize()):
            t_ns, typed = self._typed.get()
            if typed is None:
                self._say("No more lines can be typed: what was tapped counts; Ctrl-C ends.")
                break
            if (tap := self._tap(t_ns, typed)) is not None:
                payloads.append(tap.encode())
                self._ended_s = time.monotonic() if self._next == len(self._visits) else None
            self._say(self._request())
        return payloads

    def is_over(self) -> bool:
        """Whether the last point was tapped, and the wearer has stood since."""
        return self._ended_s is not None and time.monotonic() - self._ended_s >= REST_S

    def _tap(self, t_ns: int, typed: str) -> Tap | None:
        """The tap of a line; None for one that is none, which is said."""
        if typed == UNDO:
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

    def _request(self) -> str:
        """What the wearer does next."""
        number = self._next
        if number == len(self._visits):
            return f"The last point. Stand still for {REST_S:.0f} s: the page follows."
        visit, name = self._visits[number], self._points[self._visits[number].point].name
        if not number:
            return f"Stand on point {name}, look to point {self._points[1].name}, and stay. Enter while you stand."
        round_number = (number - 1) // (2 * (len(self._points) - 1)) + 1
        return f"{number} of {len(self._visits) - 1}, round {round_number} of {self._rounds}: {_manner(visit, len(self._points))} {name}"


def _manner(visit: Visit, points: int) -> str:
    """How a point is visited."""
    turns = visit.point in (0, points - 1)
    if visit.standing:
        return "stop with both feet beside it, Enter" + (", then turn slowly on the spot:" if turns else ", walk on:")
    return "Enter as you arrive, then turn slowly on the spot:" if turns else "Enter as you pass:"
