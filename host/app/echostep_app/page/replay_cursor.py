# SPDX-License-Identifier: MIT
"""The replay cursor: which moment of a replay one page shows.

In: requests to play, pause, seek and step; the history as far as it has been computed. Out: the scene to show. Owns the position and the speed.
"""

from __future__ import annotations

from dataclasses import dataclass

from echostep_app.page.elements.scene import PageScene
from echostep_app.page.mailbox import SceneHistory
from echostep_app.page.requests import Request, Seek, SetPlaying, SetSpeed, StepBy


@dataclass(frozen=True, slots=True)
class PlayState:
    """Position and speed of a replay for the page's time bar. The field names are keys of the frame's JSON."""

    t_s: float
    begin_s: float
    end_s: float
    playing: bool
    times: float


class ReplayCursor:
    """A position in a history that moves with the clock while it plays. `position_s` is in data time; None before the first scene."""

    def __init__(self, history: SceneHistory, *, at_end: bool = False) -> None:
        """`at_end`: begin with the last scene, paused."""
        self.playing = not at_end
        self.times = 1.0
        self._history = history
        self._position_s: float | None = history.t_s(-1) if at_end else None
        self._now_s = 0.0

    def handle(self, request: Request) -> None:
        """Change position or speed as requested by a page; `step` pauses the replay, `play` at the end starts from the beginning."""
        match request:
            case SetPlaying(playing):
                self.playing = playing
                if playing and self.at_end:
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

    @property
    def at_end(self) -> bool:
        """Whether the last scene is shown."""
        return bool(len(self._history)) and self._position_s is not None and self._position_s >= self._history.t_s(-1)

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

    def state(self) -> PlayState | None:
        """Position and speed for the page's time bar; None before the first scene."""
        if not len(self._history) or self._position_s is None:
            return None
        return PlayState(self._position_s, self._history.t_s(0), self._history.t_s(-1), self.playing, self.times)
