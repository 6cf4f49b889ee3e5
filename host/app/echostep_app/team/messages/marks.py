# SPDX-License-Identifier: MIT
"""Shared state of the commanders: marks on the plan, acknowledgements of alarms, errands, orders, crews, notes. The broker retains it for all.

In: retained messages from untrusted senders, on `echostep-table/mark/<id>`, `echostep-table/<ack, seen>/<team>/<wearer>/<run>-<number>` and
`echostep-table/errand/<team>/<wearer>/<run>`; an empty one removes. Out: `Mark`s, `Ack`s and `Errand`s, and the messages for new ones. Owns those
that are known; their number is bounded.

The removal of a mark stays as a retained message: the state of a mark only goes from set to removed; of several acknowledgements the earliest counts,
of the errands of one run the latest. So what each commander knows can be sent again in any order, also to a broker that has lost its messages
(`Restorer`), and all come to one state: an outdated message is answered with the newer state, for the broker keeps the last one.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from echostep.ports.people.payloads import Level
from echostep_app.team.messages.crews import MOST_CREWS, Crew
from echostep_app.team.messages.orders import (
    EVERYBODY,
    MOST_NOTES,
    MOST_ORDERS,
    MOST_RECEIPTS,
    Order,
    Receipt,
    ReceiptKey,
    note_message,
    order_message,
    receipt_message,
)
from echostep_app.team.messages.report import BadReportError, Metres, check_name
from echostep_app.team.messages.shared import (
    Identity,
    Kept,
    Person,
    UnixTime,
    check_printable,
    check_room,
    decoded,
)

ROOT = "echostep-table"
MARKS, ALL = f"{ROOT}/mark/#", f"{ROOT}/#"
MOST_MARKS, MOST_ACKS, MOST_ERRANDS = 256, 1024, 256  # further ones are refused
MOST_ANSWERS = 64  # that wait; further ones replace the oldest
MOST_REMOVED = 1024  # removed marks that are remembered, the newest ones
MarkKind = Literal["cleared", "hazard", "blocked", "meeting"]


class Mark(msgspec.Struct, frozen=True, omit_defaults=True):
    """A place on the plan: a room that is cleared, a hazard, no way, a meeting point. `by`: who set it; `unix_s`: when, by that clock.

    `removed`: it is not there any more.
    """

    echostep_mark: Literal[1]
    id: Identity
    mark: MarkKind
    x_m: Metres
    y_m: Metres
    level: Level
    by: Person
    unix_s: UnixTime
    plan_sha256: Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]
    removed: bool = False

    @property
    def message(self) -> tuple[str, bytes]:
        """Topic and payload."""
        return f"{ROOT}/mark/{self.id}", msgspec.json.encode(self)


class Ack(msgspec.Struct, frozen=True):
    """An alarm that a commander has acknowledged; on `seen`, that a commander's computer shows."""

    echostep_ack: Literal[1]
    by: Person
    unix_s: UnixTime


class Errand(msgspec.Struct, frozen=True):
    """A wearer is sent to another one in distress. `to`: that wearer's name; `where`: the place in words; `by`: the sender, at `unix_s`."""

    echostep_errand: Literal[1]
    to: Person
    where: Annotated[str, Meta(max_length=200)]
    x_m: Metres
    y_m: Metres
    level: Level
    by: Person
    unix_s: UnixTime
    plan_sha256: Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]

    @property
    def words(self) -> str:
        """The errand for its wearer."""
        return f"{self.by} sends you to {self.to}, in distress{f': {self.where}' if self.where else ''}"


AlarmKey = tuple[str, str, str]  # team, wearer, "<run>-<number>"
RunKey = tuple[str, str, str]  # team, wearer, run
_MARK = msgspec.json.Decoder(Mark)


def ack_message(key: AlarmKey, by: str, unix_s: float, kind: str = "ack") -> tuple[str, bytes]:
    """Topic and payload of an acknowledgement, or of kind `seen`."""
    return f"{ROOT}/{kind}/{'/'.join(key)}", msgspec.json.encode(Ack(1, by, unix_s))


def acks_of(team: str, name: str) -> list[str]:
    """Topic filters of the acknowledgements of one wearer's alarms, of either kind."""
    return [f"{ROOT}/{kind}/{team}/{name}/+" for kind in ("ack", "seen")]


def errand_message(key: RunKey, errand: Errand) -> tuple[str, bytes]:
    """Topic and payload of an errand of the wearer of this run."""
    return errand_of(key), msgspec.json.encode(errand)


def errand_of(key: RunKey) -> str:
    """Topic of the errand of one run."""
    return f"{ROOT}/errand/{'/'.join(key)}"


def is_shared(topic: str | None) -> bool:
    """Whether a topic is one of this module's."""
    return topic is not None and topic.startswith(f"{ROOT}/")


class MarkBoard:
    """`receive` takes messages; `marks`, `acks`, `errands`, `orders`, `receipts`, `crews` and `log` are the result.

    `removed`: marks that were there; `answers`: messages for the broker, which keeps older ones.
    """

    def __init__(self) -> None:
        self.marks: dict[str, Mark] = {}
        self.removed: dict[str, Mark] = {}
        self.acks, self.seen = self._acks_of("ack"), self._acks_of("seen")
        self.errands: Kept[RunKey, Errand] = Kept(
            Errand, "errand", MOST_ERRANDS, errand_message, lambda e: [e.by, e.to, e.where]
        )
        self.crews: Kept[str, Crew] = Kept(
            Crew, "crew", MOST_CREWS, lambda _, crew: crew.message, lambda c: [c.name, c.by, *c.members]
        )
        self.orders: Kept[str, Order] = Kept(Order, "order", MOST_ORDERS, order_message, lambda o: [o.by, o.text])
        self.receipts: Kept[ReceiptKey, Receipt] = Kept(
            Receipt, "receipt", MOST_RECEIPTS, receipt_message, lambda r: [r.by]
        )
        self.log: Kept[str, Order] = Kept(
            Order, "note", MOST_NOTES, note_message, lambda o: [o.by, o.text], earliest=True
        )
        self.answers: deque[tuple[str, bytes]] = deque(maxlen=MOST_ANSWERS)

    @staticmethod
    def _acks_of(kind: str) -> Kept[AlarmKey, Ack]:
        return Kept(
            Ack, "acknowledgement", MOST_ACKS, lambda key, a: ack_message(key, a.by, a.unix_s, kind), lambda a: [a.by],
            earliest=True,
        )  # fmt: skip

    def copy(self) -> MarkBoard:
        """An independent copy of the board."""
        made = MarkBoard()
        made.marks, made.removed = dict(self.marks), dict(self.removed)
        for own, other in zip(made._kept, self._kept, strict=True):
            own.update(other)
        return made

    @property
    def _kept(self) -> tuple[Kept[Any, Any], ...]:
        return self.acks, self.seen, self.errands, self.orders, self.receipts, self.crews, self.log

    def show(self, key: AlarmKey | None, unix_s: float) -> None:
        """A commander's screen shows this mayday from now on: its wearer is told, once."""
        if key and key not in self.acks and key not in self.seen and len(self.seen) < MOST_ACKS:
            self.seen[key] = Ack(1, "commander", unix_s)
            self.answers.append(ack_message(key, "commander", unix_s, "seen"))

    def order_to(self, kind: str, team: str, name: str) -> tuple[Order, bool] | None:
        """The order to everybody, or the note to one wearer, while it holds; and whether this wearer has understood it."""
        order = self.orders.get(EVERYBODY if kind == EVERYBODY else f"{team}/{name}")
        receipt = self.receipts.get((kind, team, name))
        return (order, receipt is not None and receipt.order_s == order.unix_s) if order and not order.ended else None

    @property
    def messages(self) -> Iterator[tuple[str, bytes]]:
        """Topic and payload of the whole state."""
        for mark in (*self.marks.values(), *self.removed.values()):
            yield mark.message
        for kept in self._kept:
            yield from kept.messages

    def receive(self, topic: str, payload: bytes) -> None:
        """Take one message; raises BadReportError with the reason of its rejection."""
        parts = topic.split("/")
        match parts[1:]:
            case ["mark", identity]:
                self._receive_mark(identity, payload)
            case [("ack" | "seen") as kind, *key]:
                kept = self.acks if kind == "ack" else self.seen
                kept.receive(_checked_key(key), (topic, payload), self.answers)
            case ["errand", *key]:
                self.errands.receive(_checked_key(key), (topic, payload), self.answers)
            case ["order", "everybody"]:
                self.orders.receive(EVERYBODY, (topic, payload), self.answers)
            case ["order", team, name]:
                self.orders.receive("/".join(_names(team, name)), (topic, payload), self.answers)
            case ["receipt", ("everybody" | "note") as kind, team, name]:
                self.receipts.receive((kind, *_names(team, name)), (topic, payload), self.answers)
            case ["crew", identity]:
                self.crews.receive(identity, (topic, payload), self.answers)
            case ["log", identity] if payload and len(identity) == 8:  # what was written stays
                self.log.receive(identity, (topic, payload), self.answers)
            case _:
                raise BadReportError("unknown topic")

    def _receive_mark(self, identity: str, payload: bytes) -> None:
        if not payload:
            self.marks.pop(identity, None)
            self.removed.pop(identity, None)
            return
        mark = decoded(payload, _MARK, "mark")
        if mark.id != identity:
            raise BadReportError("mark and topic contradict each other")
        check_printable(mark.by)
        if identity in self.removed:
            if not mark.removed:  # sent by a commander who had not heard that it was removed
                self.answers.append(self.removed[identity].message)
            return
        if mark.removed:
            self.marks.pop(identity, None)
            if len(self.removed) >= MOST_REMOVED:
                self.removed.pop(next(iter(self.removed)))
            self.removed[identity] = mark
            return
        check_room(self.marks, identity, MOST_MARKS, "marks")
        self.marks[identity] = mark


def _checked_key(parts: Sequence[str]) -> tuple[str, str, str]:
    """Team, wearer and run of a topic; raises BadReportError for one that names no wearer."""
    if len(parts) != 3 or len(parts[2]) > 32:
        raise BadReportError("unknown topic")
    return *_names(*parts[:2]), parts[2]


def _names(team: str, name: str) -> tuple[str, str]:
    """Team and wearer; raises BadReportError for a text that is no name."""
    check_name(team)
    check_name(name)
    return team, name
