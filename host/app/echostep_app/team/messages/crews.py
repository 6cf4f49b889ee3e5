# SPDX-License-Identifier: MIT
"""Crews inside: who is in a crew, since when, for how much air, and when it last answered (accountability check, PAR).

In: retained messages from untrusted senders, on `echostep-table/crew/<id>`; an empty one removes. Out: `Crew`s, and the messages for new ones. Owns
those that are known; their number is bounded. Of several messages about one crew the latest counts, as of errands (`shared.keep_latest`).
"""

from __future__ import annotations

from collections import deque
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from echostep_app.team.messages.report import BadReportError
from echostep_app.team.messages.shared import (
    Identity,
    Person,
    UnixTime,
    check_printable,
    check_room,
    decoded,
    keep_latest,
)

TOPIC = "echostep-table/crew"
MOST_CREWS, MOST_MEMBERS = 64, 8  # further crews are refused
MOST_AIR_MIN = 600.0  # a rebreather lasts 4 h [EN 145]
# Of the planned time until a check is due: the crew is reminded of its pressures after one and after two thirds [FwDV 7 (2002, changed 2005), 7.4]
CHECK_SHARE = 1.0 / 3.0
Members = Annotated[tuple[Person, ...], Meta(max_length=MOST_MEMBERS)]
AirMinutes = Annotated[float, Meta(ge=1.0, le=MOST_AIR_MIN)]
Does = Literal["enter", "check", "leave"]


class Crew(msgspec.Struct, frozen=True):
    """A crew with a name. `entered_s`, `checked_s`, `left_s`: Unix times of entry, last check and exit; None: not yet.

    `air_min`: planned time in minutes, from entry to exit; `by`: the commander of the newest change, at `unix_s`.
    """

    echostep_crew: Literal[1]
    id: Identity
    name: Person
    members: Members
    air_min: AirMinutes
    by: Person
    unix_s: UnixTime
    entered_s: UnixTime | None = None
    checked_s: UnixTime | None = None
    left_s: UnixTime | None = None

    @property
    def message(self) -> tuple[str, bytes]:
        """Topic and payload."""
        return f"{TOPIC}/{self.id}", msgspec.json.encode(self)

    @property
    def is_inside(self) -> bool:
        """Whether it has entered and not left."""
        return self.entered_s is not None and self.left_s is None

    def after(self, does: Does, by: str, unix_s: float) -> Crew | None:
        """The crew after it has entered, answered a check or left; None where it cannot."""
        change = msgspec.structs.replace(self, by=by, unix_s=unix_s)
        if does == "enter" and not self.is_inside:
            return msgspec.structs.replace(change, entered_s=unix_s, checked_s=unix_s, left_s=None)
        if does == "check" and self.is_inside:
            return msgspec.structs.replace(change, checked_s=unix_s)
        if does == "leave" and self.is_inside:
            return msgspec.structs.replace(change, left_s=unix_s)
        return None


_DECODER = msgspec.json.Decoder(Crew)


class Crews:
    """The crews by their ids, in order of their first message."""

    def __init__(self) -> None:
        self.known: dict[str, Crew] = {}

    def copy(self) -> Crews:
        """The same crews; the copy changes by itself."""
        made = Crews()
        made.known = dict(self.known)
        return made

    def of_member(self, name: str) -> Crew | None:
        """The crew of a wearer that is inside, else the last one it was put into."""
        crews = [crew for crew in self.known.values() if name in crew.members]
        return max(crews, key=lambda crew: (crew.is_inside, crew.unix_s), default=None)

    def receive(self, identity: str, payload: bytes, answers: deque[tuple[str, bytes]]) -> None:
        """Take one message; an older one is answered with what is known. Raises BadReportError with the reason of its rejection."""
        if not payload:
            self.known.pop(identity, None)
            return
        crew = decoded(payload, _DECODER, "crew")
        if crew.id != identity:
            raise BadReportError("crew and topic contradict each other")
        check_printable(crew.name, crew.by, *crew.members)
        check_room(self.known, identity, MOST_CREWS, "crews")
        if newer := keep_latest(self.known, identity, crew):
            answers.append(newer.message)
