# SPDX-License-Identifier: MIT
"""What commanders share: marks on the plan, and who has acknowledged which alarm. The broker keeps it, so all commanders have one state.

In: retained messages from untrusted senders, on `echostep-table/mark/<id>` and `echostep-table/ack/<team>/<wearer>/<run>-<number>`; an empty one
removes. Out: `Mark`s and `Ack`s, and the messages for new ones. Owns those that are known; their number is bounded.
"""

from __future__ import annotations

from typing import Annotated, Literal, TypeVar

import msgspec
from msgspec import Meta

from echostep.team.report import BadReportError, Metres, check_name, is_printable

ROOT = "echostep-table"
MARKS, ALL = f"{ROOT}/mark/#", f"{ROOT}/#"
MOST_MARKS, MOST_ACKS = 256, 1024  # further ones are refused
MarkKind = Literal["cleared", "hazard", "meeting"]
Identity = Annotated[str, Meta(pattern="^[0-9a-f]{8}$")]
Person = Annotated[str, Meta(min_length=1, max_length=32)]


class Mark(msgspec.Struct, frozen=True):
    """A place on the plan: a room that is cleared, a hazard, a meeting point. `by`: who set it; `unix_s`: when, by that clock."""

    echostep_mark: Literal[1]
    id: Identity
    mark: MarkKind
    x_m: Metres
    y_m: Metres
    level: Annotated[int, Meta(ge=0, lt=1000)]
    by: Person
    unix_s: Annotated[float, Meta(ge=0.0, le=1e11)]
    plan_sha256: Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]

    @property
    def message(self) -> tuple[str, bytes]:
        """Topic and payload."""
        return f"{ROOT}/mark/{self.id}", msgspec.json.encode(self)


class Ack(msgspec.Struct, frozen=True):
    """An alarm that a commander has acknowledged."""

    echostep_ack: Literal[1]
    by: Person
    unix_s: Annotated[float, Meta(ge=0.0, le=1e11)]


AlarmKey = tuple[str, str, str]  # team, wearer, "<run>-<number>"
T = TypeVar("T")
_MARK, _ACK = msgspec.json.Decoder(Mark), msgspec.json.Decoder(Ack)


def ack_message(key: AlarmKey, by: str, unix_s: float) -> tuple[str, bytes]:
    """Topic and payload of an acknowledgement."""
    return f"{ROOT}/ack/{'/'.join(key)}", msgspec.json.encode(Ack(1, by, unix_s))


def is_shared(topic: str | None) -> bool:
    """Whether a topic is one of this module's."""
    return topic is not None and topic.startswith(f"{ROOT}/")


class MarkBoard:
    """`receive` takes messages; `marks` and `acks` are what they amount to."""

    def __init__(self) -> None:
        self.marks: dict[str, Mark] = {}
        self.acks: dict[AlarmKey, Ack] = {}

    def copy(self) -> MarkBoard:
        """A board of the same state that changes by itself."""
        made = MarkBoard()
        made.marks, made.acks = dict(self.marks), dict(self.acks)
        return made

    def receive(self, topic: str, payload: bytes) -> None:
        """Take one message; raises BadReportError with the reason why it is not believed."""
        parts = topic.split("/")
        match parts[1:]:
            case ["mark", identity]:
                self._receive_mark(identity, payload)
            case ["ack", team, name, alarm]:
                self._receive_ack((team, name, alarm), payload)
            case _:
                raise BadReportError("unknown topic")

    def _receive_mark(self, identity: str, payload: bytes) -> None:
        if not payload:
            self.marks.pop(identity, None)
            return
        mark = _decoded(payload, _MARK, "mark")
        if mark.id != identity:
            raise BadReportError("mark and topic contradict each other")
        if not is_printable(mark.by):
            raise BadReportError("unprintable text")
        if identity not in self.marks and len(self.marks) >= MOST_MARKS:
            raise BadReportError(f"more than {MOST_MARKS} marks")
        self.marks[identity] = mark

    def _receive_ack(self, key: AlarmKey, payload: bytes) -> None:
        for name in key[:2]:
            check_name(name)
        if len(key[2]) > 32:
            raise BadReportError("unknown topic")
        if not payload:
            self.acks.pop(key, None)
            return
        ack = _decoded(payload, _ACK, "acknowledgement")
        if not is_printable(ack.by):
            raise BadReportError("unprintable text")
        if key not in self.acks and len(self.acks) >= MOST_ACKS:
            raise BadReportError(f"more than {MOST_ACKS} acknowledgements")
        self.acks.setdefault(key, ack)  # the first one counts


def _decoded(payload: bytes, decoder: msgspec.json.Decoder[T], what: str) -> T:
    try:
        return decoder.decode(payload)
    except (msgspec.MsgspecError, UnicodeError, RecursionError) as error:
        raise BadReportError(f"not a valid {what}") from error
