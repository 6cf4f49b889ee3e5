# SPDX-License-Identifier: MIT
"""The player: the moment of a recorded walk or operation that one page shows.

In: requests to play, pause, seek and step; a tape. Out: the time of that moment, the state of the time bar. Owns the position and the speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from echostep_app.page.requests import PlayerRequest, Seek, SetPlaying, SetSpeed, Step

MOST_S = 1.0  # by which the position moves at once, at normal speed: a page that was in the background goes on from where it was


class Tape(Protocol):
    """A recording in order of time."""

    @property
    def span_s(self) -> tuple[float, float] | None:
        """The first and the last time by now; None while there is nothing."""

    def stepped(self, t_s: float, steps: int) -> float:
        """The time `steps` steps after the moment that is shown at `t_s`; it may be outside the span."""


@dataclass(frozen=True, slots=True)
class PlayState:
    """Position and speed for the page's time bar. The field names are keys of the frame's JSON."""

    t_s: float
    begin_s: float
    end_s: float
    playing: bool
    times: float


class Player:
    """A position on a tape that moves with the clock while it plays. `position_s` is in recorded time; None before it was moved."""

    def __init__(self, tape: Tape, *, at_end: bool = False) -> None:
        """`at_end`: begin with the last moment, paused."""
        self.playing, self.times = not at_end, 1.0
        self.position_s: float | None = math.inf if at_end else None
        self._tape = tape
        self._now_s: float | None = None  # when the position was moved; None: it was set since

    def handle(self, request: PlayerRequest) -> None:
        """Change position or speed; `play` at the end starts from the beginning, a step pauses."""
        match request:
            case SetPlaying(playing):
                if playing and not self.playing:
                    self._now_s = None  # the pause is not played
                self.playing = playing
                if playing and self.at_end:
                    self._seek(-math.inf)
            case SetSpeed(times):
                self.times = times
            case Seek(t_s):
                self._seek(t_s)
            case Step(steps) if (span_s := self._tape.span_s) is not None:
                self.playing = False
                self._seek(self._tape.stepped(span_s[0] if self.position_s is None else self.position_s, steps))

    @property
    def at_end(self) -> bool:
        """Whether the last moment is shown."""
        span_s = self._tape.span_s
        return span_s is not None and self.position_s is not None and self.position_s >= span_s[1]

    def move(self, now_s: float) -> float | None:
        """The time to show at `now_s` of the monotonic clock; None while nothing is recorded."""
        passed_s = min(now_s - self._now_s, MOST_S) if self._now_s is not None else 0.0
        self._now_s = now_s
        if (span_s := self._tape.span_s) is None:
            return None
        position_s = span_s[0] if self.position_s is None else self.position_s
        if self.playing:
            position_s += passed_s * self.times
        self.position_s = min(max(position_s, span_s[0]), span_s[1])
        return self.position_s

    def state(self) -> PlayState | None:
        """Position and speed for the page's time bar; None before the first moment."""
        if (span_s := self._tape.span_s) is None or self.position_s is None:
            return None
        return PlayState(self.position_s, *span_s, self.playing, self.times)

    def _seek(self, t_s: float) -> None:
        """Go to a time, which may be before the beginning or after the end."""
        self.position_s, self._now_s = t_s, None
