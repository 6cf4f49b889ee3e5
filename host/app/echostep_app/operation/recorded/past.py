# SPDX-License-Identifier: MIT
"""The moment of an operation that one page shows: the present or a past one.

In: requests to seek, play and return; the tape. Out: that moment, its scene, and the state of the time bar. Owns the position and a player.
"""

from __future__ import annotations

from dataclasses import dataclass

from echostep_app.operation import requests
from echostep_app.operation.operation import Operation, TableScene
from echostep_app.operation.recorded.player import Player
from echostep_app.operation.recorded.tape import Tape
from echostep_app.page.replay_cursor import Cursor
from echostep_app.page.requests import Seek, SetPlaying

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


class PastView(Cursor):
    """The position of one page, on the operation's clock. `is_past`: the page does not show the present."""

    most_s = 1.0  # a page that was in the background goes on from where it was

    def __init__(self, tape: Tape) -> None:
        """A growing tape is shown as it is now; another one from its beginning on."""
        super().__init__(lambda: tape.span_s)
        self.is_past = not tape.grows
        self._tape = tape
        self._player: Player | None = None
        self._scene: TableScene | None = None

    def handle(self, request: object) -> None:
        """As of any cursor, with times since the beginning; a page that shows a growing tape holds where it goes to, until it plays or returns."""
        match request:
            case Seek(t_s):
                self.is_past, self.playing = True, self.playing and not self._tape.grows
                span_s = self._tape.span_s
                super().handle(Seek(t_s + (span_s[0] if span_s else 0.0)))
            case SetPlaying(playing) if self._tape.grows:
                if not playing and not self.is_past:
                    self.is_past = True
                    self.seek(self._tape.end_s)
                self.playing = playing
            case requests.Now():
                self._return()
            case _:
                super().handle(request)

    def moment(self, clock_s: float) -> float | None:
        """The time to show at `clock_s` of the monotonic clock; None: now."""
        if not self.is_past or (t_s := self.move(clock_s)) is None:
            return None
        if self._tape.grows and self.playing and t_s > self._tape.end_s - NEAR_END_S:
            self._return()
            return None
        return t_s

    def at(self, t_s: float) -> tuple[Operation, TableScene]:
        """The operation and the scene of a time: played on, or from the last keyframe before it; it may take a second.

        The scene is the same while the time is the same.
        """
        player, keyframe = self._player, self._tape.before(t_s)
        if player is None or t_s < player.t_s or keyframe.t_s > player.t_s:
            player = self._player = Player(self._tape, keyframe, keyframe.operation.copy())
            self._scene = None
        if self._scene is None or t_s > player.t_s:
            player.advance(t_s)
            self._scene = player.scene()
        return player.operation, self._scene

    def shown(self, t_s: float, open_alarms: int) -> ShownTime | None:
        """The time bar beside a scene of time `t_s`; None while nothing is recorded."""
        if (span_s := self._tape.span_s) is None:
            return None
        end_s, now = max(span_s[1], t_s), not self.is_past
        times = t_s - span_s[0], end_s - span_s[0]
        return ShownTime(*times, self.playing or now, self.times, now, self._tape.grows, open_alarms)

    def _return(self) -> None:
        """Show the present, or the end."""
        self.is_past, self.playing, self.times = not self._tape.grows, True, 1.0
        self.seek(self._tape.end_s)
