"""The replay cursor: which moment of a replay one page shows.

In: requests to play, pause, seek and step; the history as far as it has been computed. Out: the scene to show. Owns the position and the speed.
"""

from __future__ import annotations

from typing import Any

from echostep.page.elements.scene import PageScene
from echostep.page.mailbox import SceneHistory
from echostep.page.protocol import Request, Seek, SetPlaying, SetSpeed, StepBy


class ReplayCursor:
    """A position in a history that moves with the clock while it plays. `position_s` is in data time; None before the first scene."""

    def __init__(self, history: SceneHistory) -> None:
        self.playing = True
        self.times = 1.0
        self._history = history
        self._position_s: float | None = None
        self._now_s = 0.0

    def handle(self, request: Request) -> None:
        """Change position or speed as a page asks; stepping pauses the replay, playing at the end starts again from the beginning."""
        match request:
            case SetPlaying(playing):
                self.playing = playing
                ended = (
                    len(self._history) and self._position_s is not None and self._position_s >= self._history.t_s(-1)
                )
                if playing and ended:
                    self._position_s = self._history.t_s(0)
            case SetSpeed(times):
                self.times = times
            case Seek(t_s):
                self._position_s = t_s
            case StepBy(by) if len(self._history):
                self.playing = False
                start_s = self._position_s if self._position_s is not None else self._history.t_s(0)
                index = self._history.index_at(start_s) + by
                self._position_s = self._history.t_s(min(max(index, 0), len(self._history) - 1))

    def scene(self, now_s: float) -> PageScene | None:
        """The scene to show at `now_s` of the monotonic clock; None while the history is empty."""
        passed_s, self._now_s = now_s - self._now_s, now_s
        if not len(self._history):
            return None
        begin_s, end_s = self._history.t_s(0), self._history.t_s(-1)
        if self._position_s is None:
            self._position_s = begin_s
        elif self.playing:
            self._position_s += passed_s * self.times
        self._position_s = min(max(self._position_s, begin_s), end_s)
        return self._history[self._history.index_at(self._position_s)]

    def state(self) -> dict[str, Any] | None:
        """Position and speed for the page's time bar, as sent in frames; None before the first scene."""
        if not len(self._history) or self._position_s is None:
            return None
        return {
            "t_s": self._position_s,
            "begin_s": self._history.t_s(0),
            "end_s": self._history.t_s(-1),
            "playing": self.playing,
            "times": self.times,
        }
