"""The cursor: which moment of a replay one page looks at.

In: requests to play, stop, seek, step; the film as far as it is there. Out: the scene to show. Owns the place and the speed.
"""

from __future__ import annotations

from typing import Any

from echostep.page.elements.scene import PageScene
from echostep.page.mailbox import Film
from echostep.page.protocol import Playing, Request, Seek, Skip, Speed


class Cursor:
    """Runs along a film; times are the walk's own."""

    def __init__(self, film: Film) -> None:
        self.playing = True
        self.times = 1.0
        self._film = film
        self._at_s: float | None = None
        self._now_s = 0.0

    def take(self, request: Request) -> None:
        """Do what a page asks; a step stops the replay."""
        match request:
            case Playing(playing):
                self.playing = playing
                if playing and len(self._film) and self._at_s is not None and self._at_s >= self._film.t_s(-1):
                    self._at_s = self._film.t_s(0)
            case Speed(times):
                self.times = times
            case Seek(t_s):
                self._at_s = t_s
            case Skip(by) if len(self._film):
                self.playing = False
                k = self._film.at(self._at_s if self._at_s is not None else self._film.t_s(0)) + by
                self._at_s = self._film.t_s(min(max(k, 0), len(self._film) - 1))

    def scene(self, now_s: float) -> PageScene | None:
        """The scene to show at a moment of the monotonic clock; None before there is any."""
        passed_s, self._now_s = now_s - self._now_s, now_s
        if not len(self._film):
            return None
        begin_s, end_s = self._film.t_s(0), self._film.t_s(-1)
        if self._at_s is None:
            self._at_s = begin_s
        elif self.playing:
            self._at_s += passed_s * self.times
        self._at_s = min(max(self._at_s, begin_s), end_s)
        return self._film[self._film.at(self._at_s)]

    def state(self) -> dict[str, Any] | None:
        """Place and speed, for the time bar."""
        if not len(self._film) or self._at_s is None:
            return None
        return {
            "t_s": self._at_s,
            "begin_s": self._film.t_s(0),
            "end_s": self._film.t_s(-1),
            "playing": self.playing,
            "times": self.times,
        }
