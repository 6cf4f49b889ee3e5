# SPDX-License-Identifier: MIT
"""The replay cursor: the moment of a recorded walk or operation that one page shows.

In: requests to play, pause, seek and step; the recorded span of time. Out: the moment to show. Owns the position and the speed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from echostep_app.page.elements.scene import PageScene
from echostep_app.page.mailbox import SceneHistory
from echostep_app.page.requests import Seek, SetPlaying, SetSpeed, StepBy


@dataclass(frozen=True, slots=True)
class PlayState:
    """Position and speed of a replay for the page's time bar. The field names are keys of the frame's JSON."""

    t_s: float
    begin_s: float
    end_s: float
    playing: bool
    times: float


class Cursor:
    """A position that moves with the clock while it plays. `position_s` is in recorded time; None before it was moved."""

    most_s = math.inf  # by which the position moves at once, at normal speed

    def __init__(self, span_s: Callable[[], tuple[float, float] | None], *, playing: bool = True) -> None:
        """`span_s`: beginning and end of the record by now; None while there is nothing."""
        self.playing, self.times = playing, 1.0
        self.position_s: float | None = None
        self._span_s = span_s
        self._now_s: float | None = None  # when the position was moved; None: it was set since

    def handle(self, request: object) -> None:
        """Change position or speed as requested by a page; `play` at the end starts from the beginning."""
        match request:
            case SetPlaying(playing):
                if playing and not self.playing:
                    self._now_s = None  # the pause is not played
                self.playing = playing
                if playing and self.at_end:
                    self.seek(-math.inf)
            case SetSpeed(times):
                self.times = times
            case Seek(t_s):
                self.seek(t_s)

    def seek(self, t_s: float) -> None:
        """Go to a time, which may be before the beginning or after the end."""
        self.position_s, self._now_s = t_s, None

    @property
    def at_end(self) -> bool:
        """Whether the last moment is shown."""
        span_s = self._span_s()
        return span_s is not None and self.position_s is not None and self.position_s >= span_s[1]

    def move(self, now_s: float) -> float | None:
        """The position at `now_s` of the monotonic clock; None while nothing is recorded."""
        passed_s = min(now_s - self._now_s, self.most_s) if self._now_s is not None else 0.0
        self._now_s = now_s
        if (span_s := self._span_s()) is None:
            return None
        position_s = span_s[0] if self.position_s is None else self.position_s
        if self.playing:
            position_s += passed_s * self.times
        self.position_s = min(max(position_s, span_s[0]), span_s[1])
        return self.position_s


class ReplayCursor(Cursor):
    """A position in the history of a walk."""

    def __init__(self, history: SceneHistory, *, at_end: bool = False) -> None:
        """`at_end`: begin with the last scene, paused."""
        super().__init__(lambda: (history.t_s(0), history.t_s(-1)) if len(history) else None, playing=not at_end)
        self._history = history
        if at_end:
            self.seek(history.t_s(-1))

    def handle(self, request: object) -> None:
        """As for any cursor; `step` pauses the replay."""
        super().handle(request)
        if isinstance(request, StepBy) and len(self._history):
            self.playing = False
            begin_s = self._history.t_s(0) if self.position_s is None else self.position_s
            index = self._history.index_at(begin_s) + request.by
            self.seek(self._history.t_s(min(max(index, 0), len(self._history) - 1)))

    def scene(self, now_s: float) -> PageScene | None:
        """The scene to show at `now_s` of the monotonic clock; None while the history is empty."""
        t_s = self.move(now_s)
        return None if t_s is None else self._history[self._history.index_at(t_s)]

    def state(self) -> PlayState | None:
        """Position and speed for the page's time bar; None before the first scene."""
        if (span_s := self._span_s()) is None or self.position_s is None:
            return None
        return PlayState(self.position_s, *span_s, self.playing, self.times)
