# SPDX-License-Identifier: MIT
"""The moment of an operation that one page shows: the present or a past one.

In: requests to seek, play and return; the tape. Out: the scene of that moment, and the state of the time bar. Owns the position and a player.
"""

from __future__ import annotations

from dataclasses import dataclass

from echostep_app.operation import requests
from echostep_app.operation.operation import Operation, TableScene
from echostep_app.operation.recorded.tape import Player, Tape
from echostep_app.page.requests import SetPlaying, SetSpeed

NEAR_END_S = 0.5  # closer to the end of a growing tape is now: what was heard just now is not on the disk yet


@dataclass(frozen=True, slots=True)
class ShownTime:
    """The time bar: `t_s` of `end_s` seconds since the beginning. `now`: the page shows the present. `live`: the operation goes on.

    `open_alarms`: maydays of the present that no commander has acknowledged. The field names are keys of the frame's JSON.
    """

    t_s: float
    end_s: float
    playing: bool
    times: float
    now: bool
    live: bool
    open_alarms: int


class PastView:
    """The position of one page. `is_past`: the page does not show the present."""

    def __init__(self, tape: Tape) -> None:
        """A growing tape is shown as it is now; another one from its beginning on."""
        self.is_past = not tape.grows
        self.playing, self.times = True, 1.0
        self._tape = tape
        self._position_s: float | None = None  # of the operation's clock; None: the beginning
        self._asked_s: float | None = None  # seconds since the beginning
        self._clock_s = 0.0
        self._player: Player | None = None
        self._scene: TableScene | None = None

    def handle(self, request: requests.TimeRequest) -> None:
        """Change position or speed as requested by a page; `play` at the end of a finished operation starts from the beginning."""
        match request:
            case requests.Seek(t_s):
                self.is_past, self._asked_s = True, t_s
                self.playing = self.playing and not self._tape.grows
            case SetPlaying(playing):
                if playing and not self._tape.grows and self._position_s == self._tape.end_s:
                    self._asked_s = 0.0
                if not playing and not self.is_past:
                    self.is_past, self._asked_s = True, self._tape.end_s - (self._tape.begin_s or 0.0)
                self.playing = playing
            case SetSpeed(times):
                self.times = times
            case requests.Now():
                self._return()

    def look(self, clock_s: float) -> tuple[Operation, TableScene] | None:
        """The operation and the scene to show at `clock_s` of the monotonic clock; None: those of now. It may take a second."""
        begin_s = self._tape.begin_s
        passed_s, self._clock_s = min(clock_s - self._clock_s, 1.0), clock_s
        if not self.is_past or begin_s is None:
            return None
        asked_s, self._asked_s = self._asked_s, None
        if asked_s is not None:
            self._position_s = begin_s + asked_s
        elif self._position_s is None:
            self._position_s = begin_s
        elif self.playing:
            self._position_s += passed_s * self.times
        end_s = self._tape.end_s
        if self._tape.grows and self.playing and asked_s is None and self._position_s > end_s - NEAR_END_S:
            self._return()
            return None
        self._position_s = min(max(self._position_s, begin_s), end_s)
        return self._at(self._position_s)

    def shown(self, t_s: float, open_alarms: int) -> ShownTime | None:
        """The time bar beside a scene of time `t_s`; None while nothing is recorded."""
        begin_s = self._tape.begin_s
        if begin_s is None:
            return None
        end_s, grows = max(self._tape.end_s, t_s), self._tape.grows
        playing = self.playing or not self.is_past
        return ShownTime(t_s - begin_s, end_s - begin_s, playing, self.times, not self.is_past, grows, open_alarms)

    def _return(self) -> None:
        """Show the present."""
        self.is_past, self.playing, self.times = not self._tape.grows, True, 1.0
        self._asked_s = None if self._tape.grows else self._tape.end_s - (self._tape.begin_s or 0.0)
        self._player = self._scene = None

    def _at(self, t_s: float) -> tuple[Operation, TableScene] | None:
        """The operation at a time: played on, or from the last keyframe before it; the same scene while the time is the same."""
        player, keyframe = self._player, self._tape.before(t_s)
        if keyframe is None:
            return None
        if player is None or t_s < player.t_s or keyframe.t_s > player.t_s:
            player = self._player = self._tape.player(keyframe)
            self._scene = None
        if self._scene is None or t_s > player.t_s:
            player.advance(t_s)
            self._scene = player.scene()
        return player.operation, self._scene
