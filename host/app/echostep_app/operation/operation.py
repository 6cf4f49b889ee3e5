# SPDX-License-Identifier: MIT
"""The operation: everything that a commander's page shows, from the messages of the team.

In: messages as an inbox received them. Out: `TableScene`s, details of one wearer, trails. Owns the roster, the trails and each wearer's history.
Any thread may ask; one lock guards all of it.
"""

from __future__ import annotations

import math
import secrets
import threading
from array import array
from collections import Counter, deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from msgspec import structs

from echostep.plan import Plan
from echostep_app.operation import requests
from echostep_app.operation.crews import CrewLog
from echostep_app.operation.distress import ShownDistress, errand_to, shown_distress
from echostep_app.operation.orders import NEWER_S, ShownOrder, order_by, order_news, order_over, shown_order
from echostep_app.operation.trails import Trails
from echostep_app.operation.words import (
    Shared,
    ShownDetails,
    ShownEvent,
    ShownWearer,
    alarm_key,
    level_on,
    shown_details,
    shown_shared,
    shown_wearer,
    summary_words,
)
from echostep_app.page.elements.marks import ShownMark, closed_places
from echostep_app.plan.closures import OpenWays
from echostep_app.plan.routing import RoutePlace
from echostep_app.team.commander import rejected
from echostep_app.team.inbox import ReceivedMessage
from echostep_app.team.messages.crews import Crew
from echostep_app.team.messages.marks import Mark, MarkBoard, ack_message, errand_message, is_shared
from echostep_app.team.messages.orders import LOG, MOST_NOTES, Order, note_message
from echostep_app.team.messages.report import BadReportError
from echostep_app.team.roster import Member, MemberState, Roster

LIST_S = 0.5  # between two versions of the list: words are read, not watched
GONE = "There is no such alarm, mark, wearer or floor any more."
MOST_EVENTS = 64  # of a wearer's history
Key = tuple[str, str, str]  # team, name, run


@dataclass(frozen=True, slots=True)
class TableScene:
    """One moment. `places`: rows of float32, one for each wearer on this plan (`Operation.scene`). `rows`: the list, the most urgent first.

    `summary`: number of members in each state; `refused`: rejected messages, in words; `fault`: of connection and output, in words; `waiting`:
    requests that wait for the broker; `order`: to everybody; `log`: notes, the newest first.
    """

    t_s: float
    unix_s: float
    places: bytes
    rows: tuple[ShownWearer, ...]
    summary: str
    refused: str
    connected: bool
    fault: str
    waiting: int
    order: ShownOrder | None = None
    marks: tuple[ShownMark, ...] = ()
    crews: tuple[Crew, ...] = ()
    log: tuple[ShownEvent, ...] = ()


@dataclass(slots=True)
class _Followed:
    """What is remembered of a member beside its last report."""

    number: int
    state: MemberState | None = None
    exit: tuple[object, float | None] = (None, None)  # where, and past what, and the length of the way out
    history: deque[ShownEvent] = field(default_factory=lambda: deque(maxlen=MOST_EVENTS))


class Operation:
    """`receive` takes an inbox's messages; `scene` gives the present moment."""

    def __init__(self, plan: Plan, *, all_teams: bool = True) -> None:
        """`all_teams`: it hears of everybody, so it can say when all are out."""
        self.plan, self._all_teams = plan, all_teams
        self.roster = Roster()
        self.crew_log = CrewLog()
        self._board = MarkBoard()
        self._shared: Shared = ((), (), ())
        self._trails = Trails()
        self._ways = OpenWays(plan)
        self._followed: dict[Key, _Followed] = {}
        self._next_number = 1
        self._lock = threading.Lock()
        self._rows: tuple[ShownWearer, ...] = ()
        self._summary = ""
        self._listed_s = -math.inf
        self._changed = False

    def copy(self) -> Operation:
        """An independent operation with the same state; no mutable state is shared."""
        made = Operation(self.plan)
        with self._lock:
            made.roster, made._board, made._trails = self.roster.copy(), self._board.copy(), self._trails.copy()
            made._followed = {key: replace(f, history=f.history.copy()) for key, f in self._followed.items()}
            made._next_number, made._ways = self._next_number, self._ways
        return made

    def receive(
        self, messages: Sequence[ReceivedMessage], dropped: Mapping[str, int], now_s: float, unix_s: float
    ) -> list[ReceivedMessage]:
        """Take messages, and counts of dropped ones by reason; returns the accepted messages."""
        with self._lock:
            believed = self.roster.take([m for m in messages if not is_shared(m.topic)], dropped)
            believed += [
                m
                for m in messages
                if is_shared(m.topic) and self._receive_shared(m.topic or "", m.payload, now_s, unix_s)
            ]
            self._follow(now_s, unix_s)
            if self._all_teams and (over := order_over(self._board, self.roster.members(now_s), now_s, unix_s)):
                self._board.answers.append(over)
        return believed

    def set_counts(self, received: int, rejected: Mapping[str, int]) -> None:
        """Set the counts of received and rejected messages of a recorded operation, which does not hold the rejected ones."""
        with self._lock:
            self.roster.received, self.roster.rejected = received, Counter(rejected)

    def _receive_shared(self, topic: str, payload: bytes, now_s: float, unix_s: float) -> bool:
        self.roster.received += 1
        crews, identity = self._board.crews, topic.rpartition("/")[2]
        is_note = topic.startswith(LOG) and identity not in self._board.log
        before, orders = crews.get(identity), self._board.copy() if "/order/" in topic or "/receipt/" in topic else None
        try:
            self._board.receive(topic, payload)
        except BadReportError as error:
            self.roster.count_rejected(str(error))
            return False
        self.crew_log.note(before, crews.get(identity))
        if is_note:
            self.crew_log.add_note(self._board.log[identity])
        if orders:
            for _, m in self._numbered(now_s):
                events = [ShownEvent(unix_s, text) for text in order_news(orders, self._board, m)]
                self._followed[m.key].history.extend(events)
        self._changed = True
        return True

    def act(self, request: requests.Action, unix_s: float, now_s: float) -> tuple[str, bytes] | str:
        """The message that carries out a page's request, or the reason why there is none."""
        with self._lock:
            match request:
                case requests.SetMark() | requests.Unmark():
                    return self._mark(request, unix_s)
                case requests.Acknowledge(number, by):
                    m = self._member(number, now_s)
                    if m is not None and (key := alarm_key(m)) is not None:
                        return ack_message(key, by, unix_s)
                case requests.Send():
                    return self._send(request, unix_s, now_s)
                case requests.SetOrder(to=to) if (m := self._member(to, now_s)) is not None or to is None:
                    return order_by(request, m, self._board, unix_s)
                case requests.SetCrew() | requests.CrewDoes() | requests.WriteNote():
                    return self._write(request, unix_s)
        return GONE

    def _mark(self, request: requests.SetMark | requests.Unmark, unix_s: float) -> tuple[str, bytes] | str:
        if isinstance(request, requests.Unmark):
            known = self._board.marks.get(request.id)
            return structs.replace(known, removed=True).message if known else GONE
        if request.level >= len(self.plan.levels):
            return GONE
        identity, at = secrets.token_hex(4), (request.x_m, request.y_m, request.level)
        return Mark(1, identity, request.mark, *at, request.by, unix_s, self.plan.digest).message

    def _send(self, request: requests.Send, unix_s: float, now_s: float) -> tuple[str, bytes] | str:
        rescuer, m = self._member(request.id, now_s), self._member(request.to, now_s)
        known = self._board.errands.get(rescuer.key) if rescuer else None
        newer_s = known.unix_s + NEWER_S if known else 0.0  # however this clock was set back
        errand = errand_to(m, self.plan, now_s, request.by, max(unix_s, newer_s)) if m else None
        if rescuer is not None and errand is not None:
            return errand_message(rescuer.key, errand)
        return "Not sent: the place of the one in distress is not known on this plan."

    def _write(
        self, request: requests.SetCrew | requests.CrewDoes | requests.WriteNote, unix_s: float
    ) -> tuple[str, bytes] | str:
        if isinstance(request, requests.WriteNote):
            if len(self._board.log) >= MOST_NOTES:
                return "Not written: the log is full."
            return note_message(secrets.token_hex(4), Order(1, request.text, request.by, unix_s))
        if isinstance(request, requests.SetCrew):
            name, members, air_min, by = request.name, request.members, request.air_min, request.by
            return Crew(1, secrets.token_hex(4), name, members, air_min, by, unix_s).message
        if (crew := self._board.crews.get(request.id)) is None:
            return "There is no such crew any more."
        after = crew.after(request.does, request.by, unix_s)
        return after.message if after else "The crew has done that already."

    @property
    def shared(self) -> tuple[tuple[str, bytes], ...]:
        """Messages with the whole shared state of the commanders: marks and acknowledgements."""
        with self._lock:
            return tuple(self._board.messages)

    def take_answers(self) -> list[tuple[str, bytes]]:
        """Messages for the broker: what it has in an older state, which maydays are shown, that an order is over; each is given once."""
        with self._lock:
            answers = list(self._board.answers)
            self._board.answers.clear()
        return answers

    def _member(self, number: int | None, now_s: float) -> Member | None:
        """The member with this number."""
        return next((m for n, m in self._numbered(now_s) if n == number), None)

    def _numbered(self, now_s: float) -> list[tuple[int, Member]]:
        """All members with their numbers, the most urgent first."""
        members = self.roster.members(now_s)
        return [(followed.number, m) for m in members if (followed := self._followed.get(m.key)) is not None]

    def scene(
        self, now_s: float, unix_s: float, *, connected: bool = True, fault: str = "", waiting: int = 0
    ) -> TableScene:
        """The scene at a time of the commander's clock.

        Rows of its `places`: wearer, x, y, level, heading, 95 % radius, protection radius (NaN: not known, none).
        """
        with self._lock:
            members = self.roster.members(now_s)
            places, refused = self._places(members, now_s), rejected(self.roster)
            words = summary_words(members, now_s)
            if self._changed or words != self._summary or now_s - self._listed_s >= LIST_S:
                self._list(members, now_s, unix_s)
            self._summary = words
            link, order = (connected, fault, waiting), shown_order(self._board, members, now_s)
            return TableScene(now_s, unix_s, places, self._rows, words, refused, *link, order, *self._shared)

    def trail(self, begin: int, now_s: float) -> tuple[bytes, int]:
        """Rows of the trails from point number `begin` on, and the number of the next point."""
        with self._lock:
            return self._trails.rows(begin, now_s), self._trails.end

    def details(self, number: int, now_s: float) -> ShownDetails | None:
        """Everything about one wearer; None when there is none with this number."""
        with self._lock:
            m = self._member(number, now_s)
            if m is None:
                return None
            history = tuple(reversed(self._followed[m.key].history))
            return shown_details(number, m, self.plan, now_s, history, self.roster.duplicates(now_s))

    def distress(self, number: int, now_s: float) -> ShownDistress | None:
        """The commander's data of one in distress; None of others."""
        with self._lock:
            m = self._member(number, now_s)
            return shown_distress(m, self._numbered(now_s), self.plan, now_s, self._board) if m else None

    def _follow(self, now_s: float, unix_s: float) -> None:
        """Extend trails and histories; drop those of members that the roster has removed."""
        members = {m.key: m for m in self.roster.members(now_s)}
        gone = [key for key in self._followed if key not in members]
        self._trails.forget({self._followed.pop(key).number for key in gone})
        self._changed = self._changed or bool(gone)
        for key in self.roster.keys:
            m, followed = members[key], self._followed.get(key)
            if followed is None:
                followed = self._followed[key] = _Followed(self._next_number)
                self._next_number += 1
            self._note(followed, m, now_s, unix_s)
            self._board.show(alarm_key(m), unix_s)
            if (p := m.at(now_s).position) and level_on(self.plan, m) is not None:
                self._trails.add(followed.number, p, now_s)

    def _note(self, followed: _Followed, m: Member, now_s: float, unix_s: float) -> None:
        """Add a change of state to the history."""
        state = m.state(now_s)
        if state is followed.state:
            return
        p = m.report.last_known
        where = ", ".join(filter(None, (p.floor_name, p.where))) if p else ""
        followed.history.append(ShownEvent(unix_s, f"{state.value}{': ' if where else ''}{where}"))
        followed.state, self._changed = state, True

    def _list(self, members: list[Member], now_s: float, unix_s: float) -> None:
        """Make the list anew; marks on this plan, crews and notes stay the same objects while they are the same."""
        duplicates = self.roster.duplicates(now_s)
        shared = shown_shared(self._board, self.plan, unix_s)
        self._shared = self._shared if shared == self._shared else shared
        self._rows = tuple(
            shown_wearer(
                followed.number, m, self.plan, now_s, duplicates, self._board, self._exit_m(followed, m, now_s)
            )
            for m in members
            if (followed := self._followed.get(m.key))
        )
        self._listed_s, self._changed = now_s, False

    def _exit_m(self, followed: _Followed, m: Member, now_s: float) -> float | None:
        """How far the exit is; looked for again when the wearer has moved."""
        p, level = m.at(now_s).last_known, level_on(self.plan, m)
        if p is None or level is None:
            return None
        routes = self._ways.past(closed_places(self._shared[0]))
        asked = routes, round(p.x_m), round(p.y_m), level
        if followed.exit[0] != asked or followed.exit[1] is None:
            followed.exit = asked, routes.exit_m(RoutePlace(p.x_m, p.y_m, level))
        return followed.exit[1]

    def _places(self, members: list[Member], now_s: float) -> bytes:
        rows = array("f")
        for m in members:
            r, level, followed = m.at(now_s), level_on(self.plan, m), self._followed.get(m.key)
            if (p := r.last_known) is None or level is None or followed is None:
                continue
            claimed = r.position is not None  # of a place that was last known nothing is claimed but the place
            heading = p.heading_rad if claimed and p.heading_rad is not None else math.nan
            protection = p.protection_m if claimed and p.protection_m is not None else math.nan
            radius = p.radius95_m if claimed else math.nan
            rows.extend((followed.number, p.x_m, p.y_m, level, heading, radius, protection))
        return rows.tobytes()
