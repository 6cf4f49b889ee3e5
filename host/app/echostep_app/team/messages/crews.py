# SPDX-License-Identifier: MIT
"""Crews inside: members, time of entry, air in minutes, and last answer (accountability check, PAR).

In: retained messages from untrusted senders, on `echostep-table/crew/<id>`; an empty one removes. Out: `Crew`s, and the messages for new ones. Owns
nothing. Of several messages about one crew the latest counts, as of errands (`shared.Kept`).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from echostep_app.team.messages.shared import Identity, Person, UnixTime

TOPIC = "echostep-table/crew"
MOST_CREWS, MOST_MEMBERS = 64, 8  # further crews are refused
MOST_AIR_MIN = 600.0  # a rebreather lasts 4 h [EN 145]
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


def crew_of(name: str, crews: Iterable[Crew]) -> Crew | None:
    """The crew of a wearer that is inside, else the last one it was put into."""
    of_wearer = [crew for crew in crews if name in crew.members]
    return max(of_wearer, key=lambda crew: (crew.is_inside, crew.unix_s), default=None)
