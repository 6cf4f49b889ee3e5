# SPDX-License-Identifier: MIT
"""Shared state of the commanders: marks on the plan, acknowledgements of alarms, errands, crews. The broker retains it, so it is the same for all.

In: retained messages from untrusted senders, on `echostep-table/mark/<id>`, `echostep-table/ack/<team>/<wearer>/<run>-<number>` and
`echostep-table/errand/<team>/<wearer>/<run>`; an empty one removes. Out: `Mark`s, `Ack`s and `Errand`s, and the messages for new ones. Owns those
that are known; their number is bounded.

The removal of a mark stays as a retained message: the state of a mark only goes from set to removed; of several acknowledgements the earliest counts,
of the errands of one run the latest. So what each commander knows can be sent again in any order, also to a broker that has lost its messages
(`Restorer`), and all come to one state: an outdated message is answered with the newer state, for the broker keeps the last one.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from echostep.ports.people.payloads import Level
from echostep_app.team.messages.crews import Crews
from echostep_app.team.messages.report import BadReportError, Metres, check_name
from echostep_app.team.messages.shared import (
    Identity,
    Person,
    UnixTime,
    check_printable,
    check_room,
    decoded,
    is_older,
    keep_latest,
)

ROOT = "echostep-table"
MARKS, ALL = f"{ROOT}/mark/#", f"{ROOT}/#"
MOST_MARKS, MOST_ACKS, MOST_ERRANDS = 256, 1024, 256  # further ones are refused
MOST_ANSWERS = 64  # that wait; further ones replace the oldest
MOST_REMOVED = 1024  # removed marks that are remembered, the newest ones
MarkKind = Literal["cleared", "hazard", "meeting"]


class Mark(msgspec.Struct, frozen=True, omit_defaults=True):
    """A place on the plan: a room that is cleared, a hazard, a meeting point. `by`: who set it; `unix_s`: when, by that clock.

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
    """An alarm that a commander has acknowledged."""

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
        """For the wearer who is sent."""
        return f"{self.by} sends you to {self.to}, in distress{f': {self.where}' if self.where else ''}"


AlarmKey = tuple[str, str, str]  # team, wearer, "<run>-<number>"
RunKey = tuple[str, str, str]  # team, wearer, run
_MARK, _ACK, _ERRAND = msgspec.json.Decoder(Mark), msgspec.json.Decoder(Ack), msgspec.json.Decoder(Errand)


def ack_message(key: AlarmKey, by: str, unix_s: float) -> tuple[str, bytes]:
    """Topic and payload of an acknowledgement."""
    return f"{ROOT}/ack/{'/'.join(key)}", msgspec.json.encode(Ack(1, by, unix_s))


def acks_of(team: str, name: str) -> str:
    """Topic filter of the acknowledgements of one wearer's alarms."""
    return f"{ROOT}/ack/{team}/{name}/+"


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
    """`receive` takes messages; `marks`, `acks`, `errands` and `crews` are what they amount to; `removed`: marks that were there.

    `answers`: messages for the broker, which keeps older ones.
    """

    def __init__(self) -> None:
        self.marks: dict[str, Mark] = {}
        self.removed: dict[str, Mark] = {}
        self.acks: dict[AlarmKey, Ack] = {}
        self.errands: dict[RunKey, Errand] = {}
        self.crews = Crews()
        self.answers: deque[tuple[str, bytes]] = deque(maxlen=MOST_ANSWERS)

    def copy(self) -> MarkBoard:
        """A board of the same state that changes by itself."""
        made = MarkBoard()
        made.marks, made.removed, made.acks = dict(self.marks), dict(self.removed), dict(self.acks)
        made.errands, made.crews = dict(self.errands), self.crews.copy()
        return made

    @property
    def messages(self) -> Iterator[tuple[str, bytes]]:
        """Topic and payload of all that is known."""
        for mark in (*self.marks.values(), *self.removed.values()):
            yield mark.message
        for key, ack in self.acks.items():
            yield ack_message(key, ack.by, ack.unix_s)
        for key, errand in self.errands.items():
            yield errand_message(key, errand)
        for crew in self.crews.known.values():
            yield crew.message

    def receive(self, topic: str, payload: bytes) -> None:
        """Take one message; raises BadReportError with the reason of its rejection."""
        parts = topic.split("/")
        match parts[1:]:
            case ["mark", identity]:
                self._receive_mark(identity, payload)
            case ["ack", team, name, alarm]:
                self._receive_ack((team, name, alarm), payload)
            case ["errand", team, name, run]:
                self._receive_errand((team, name, run), payload)
            case ["crew", identity]:
                self.crews.receive(identity, payload, self.answers)
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

    def _receive_ack(self, key: AlarmKey, payload: bytes) -> None:
        _check_key(key)
        if not payload:
            self.acks.pop(key, None)
            return
        ack = decoded(payload, _ACK, "acknowledgement")
        check_printable(ack.by)
        check_room(self.acks, key, MOST_ACKS, "acknowledgements")
        known = self.acks.get(key)
        if known is not None and is_older(known, ack):
            self.answers.append(ack_message(key, known.by, known.unix_s))
        else:
            self.acks[key] = ack

    def _receive_errand(self, key: RunKey, payload: bytes) -> None:
        _check_key(key)
        if not payload:
            self.errands.pop(key, None)
            return
        errand = decoded(payload, _ERRAND, "errand")
        check_printable(errand.by, errand.to, errand.where)
        check_room(self.errands, key, MOST_ERRANDS, "errands")
        if newer := keep_latest(self.errands, key, errand):
            self.answers.append(errand_message(key, newer))


def _check_key(key: tuple[str, str, str]) -> None:
    """Raises BadReportError for a topic that names no wearer."""
    for name in key[:2]:
        check_name(name)
    if len(key[2]) > 32:
        raise BadReportError("unknown topic")
