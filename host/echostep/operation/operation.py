# SPDX-License-Identifier: MIT
"""The operation: everything that a commander's page shows, from the messages of the team.

In: messages as an inbox received them. Out: `TableScene`s, details of one wearer, trails. Owns the roster, the trails and each wearer's history.
Any thread may ask; one lock guards all of it.
"""

from __future__ import annotations

import math
import threading
from array import array
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import count

from echostep.operation.trails import Trails
from echostep.operation.words import (
    ShownDetails,
    ShownEvent,
    ShownWearer,
    level_on,
    shown_details,
    shown_wearer,
    summary_words,
)
from echostep.plan.model import Plan
from echostep.team.commander import rejected, take_messages
from echostep.team.inbox import Inbox, ReceivedMessage
from echostep.team.roster import Member, MemberState, Roster

LIST_S = 0.5  # between two versions of the list, by reason: words are read, not watched
MOST_EVENTS = 64  # of a wearer's history
SHOWN_STATUS = {"tracking", "uncertain"}  # of which a trail is drawn
Key = tuple[str, str, str]  # team, name, run


@dataclass(frozen=True, slots=True)
class TableScene:
    """One moment. `places`: rows of float32, one for each wearer on this plan (`Operation.scene`). `rows`: the list, the most urgent first.

    `summary`: numbers of each state; `refused`: what was not believed, in words.
    """

    t_s: float
    unix_s: float
    places: bytes
    rows: tuple[ShownWearer, ...]
    summary: str
    refused: str
    connected: bool


@dataclass(slots=True)
class _Followed:
    """What is remembered of a member beside its last report."""

    number: int
    state: MemberState | None = None
    history: deque[ShownEvent] | None = None


class Operation:
    """`update` takes what an inbox holds; `scene` gives the present moment."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.roster = Roster()
        self._trails = Trails()
        self._followed: dict[Key, _Followed] = {}
        self._numbers = count(1)
        self._lock = threading.Lock()
        self._rows: tuple[ShownWearer, ...] = ()
        self._listed_s = -math.inf
        self._changed = False

    def update(self, inbox: Inbox, now_s: float, unix_s: float) -> None:
        """Take all messages of an inbox, and note what has changed since the last call."""
        messages, dropped = inbox.take_all()
        self.receive(messages, dropped, now_s, unix_s)

    def receive(
        self, messages: Sequence[ReceivedMessage], dropped: Mapping[str, int], now_s: float, unix_s: float
    ) -> None:
        """Take messages, and counts of dropped ones by reason."""
        with self._lock:
            take_messages(messages, dropped, self.roster)
            self._follow(now_s, unix_s)

    def scene(self, now_s: float, unix_s: float, *, connected: bool = True) -> TableScene:
        """The scene at a time of the commander's clock.

        Rows of its `places`: wearer, x, y, level, heading (NaN: not known), 95 % radius, protection radius (NaN: none).
        """
        with self._lock:
            members = self.roster.members(now_s)
            if self._changed or now_s - self._listed_s >= LIST_S:
                self._list(members, now_s)
            places, refused = self._places(members, now_s), rejected(self.roster)
            return TableScene(now_s, unix_s, places, self._rows, summary_words(members, now_s), refused, connected)

    def trail(self, begin: int, now_s: float) -> tuple[bytes, int]:
        """Rows of the trails from point number `begin` on, and the number of the next point."""
        with self._lock:
            return self._trails.rows(begin, now_s), self._trails.end

    def details(self, number: int, now_s: float) -> ShownDetails | None:
        """Everything about one wearer; None when there is none with this number."""
        with self._lock:
            for m in self.roster.members(now_s):
                followed = self._followed.get(m.key)
                if followed is not None and followed.number == number:
                    history = tuple(reversed(followed.history or ()))
                    return shown_details(number, m, self.plan, now_s, history, self.roster.duplicates(now_s))
        return None

    def _follow(self, now_s: float, unix_s: float) -> None:
        """Extend trails and histories; forget members that the roster has removed."""
        members = {m.key: m for m in self.roster.members(now_s)}
        gone = [key for key in self._followed if key not in members]
        self._trails.forget({self._followed.pop(key).number for key in gone})
        self._changed = self._changed or bool(gone)
        for key, m in members.items():
            followed = self._followed.get(key)
            if followed is None:
                followed = self._followed[key] = _Followed(next(self._numbers), history=deque(maxlen=MOST_EVENTS))
            self._note(followed, m, now_s, unix_s)
            if m.report.status in SHOWN_STATUS and m.report.position and level_on(self.plan, m) is not None:
                self._trails.add(followed.number, m.report.position, now_s)

    def _note(self, followed: _Followed, m: Member, now_s: float, unix_s: float) -> None:
        """Add a change of state to the history."""
        state = m.state(now_s)
        if state is followed.state or followed.history is None:
            return
        p = m.report.position
        where = ", ".join(filter(None, (p.floor_name, p.where))) if p else ""
        followed.history.append(ShownEvent(unix_s, f"{state.value}{': ' if where else ''}{where}"))
        followed.state, self._changed = state, True

    def _list(self, members: list[Member], now_s: float) -> None:
        """Make the list anew."""
        duplicates = self.roster.duplicates(now_s)
        self._rows = tuple(
            shown_wearer(self._followed[m.key].number, m, self.plan, now_s, duplicates)
            for m in members
            if m.key in self._followed
        )
        self._listed_s, self._changed = now_s, False

    def _places(self, members: list[Member], now_s: float) -> bytes:
        rows = array("f")
        for m in members:
            p, level, followed = m.position(now_s), level_on(self.plan, m), self._followed.get(m.key)
            if p is None or level is None or followed is None:
                continue
            heading = math.nan if p.heading_rad is None else p.heading_rad
            protection = math.nan if p.protection_m is None else p.protection_m
            rows.extend((followed.number, p.x_m, p.y_m, level, heading, p.radius95_m, protection))
        return rows.tobytes()
