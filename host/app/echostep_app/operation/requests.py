# SPDX-License-Identifier: MIT
"""Requests of a commander's page.

In: texts, which may be damaged or hostile. Out: requests; None for a text that is none. Owns the limits.
"""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from echostep.fields import Metres
from echostep.ports.people.payloads import Level, decoded
from echostep_app.page.requests import MOST_REQUEST, FrameDrawn, PlayerRequest
from echostep_app.team.messages.crews import AirMinutes, Does, Members
from echostep_app.team.messages.marks import MarkKind
from echostep_app.team.messages.orders import OUT, NoteText
from echostep_app.team.messages.report import is_printable
from echostep_app.team.messages.shared import Identity, Person

Number = Annotated[int, Meta(ge=0, lt=1 << 53)]


class Choose(msgspec.Struct, frozen=True, tag_field="kind", tag="choose"):
    """Send the details of a wearer; None: of none."""

    id: Number | None


class SetMark(msgspec.Struct, frozen=True, tag_field="kind", tag="mark"):
    """Set a mark."""

    mark: MarkKind
    x_m: Metres
    y_m: Metres
    level: Level
    by: Person


class Unmark(msgspec.Struct, frozen=True, tag_field="kind", tag="unmark"):
    """Remove a mark."""

    id: Identity


class Acknowledge(msgspec.Struct, frozen=True, tag_field="kind", tag="acknowledge"):
    """Acknowledge the alarm of a wearer."""

    id: Number
    by: Person


class Send(msgspec.Struct, frozen=True, tag_field="kind", tag="send"):
    """Send a wearer to another one in distress."""

    id: Number
    to: Number
    by: Person


class SetCrew(msgspec.Struct, frozen=True, tag_field="kind", tag="crew"):
    """Make a crew."""

    name: Person
    members: Members
    air_min: AirMinutes
    by: Person


class CrewDoes(msgspec.Struct, frozen=True, tag_field="kind", tag="crew_does"):
    """A crew has entered, answered a check or left."""

    id: Identity
    does: Does
    by: Person


class SetOrder(msgspec.Struct, frozen=True, tag_field="kind", tag="order"):
    """Everybody out, or a note in words to wearer `to`; `ended`: that order holds no longer."""

    by: Person
    to: Number | None = None
    text: NoteText = OUT
    ended: bool = False


class WriteNote(msgspec.Struct, frozen=True, tag_field="kind", tag="log"):
    """Write a note into the log."""

    text: NoteText
    by: Person


Action = SetMark | Unmark | Acknowledge | Send | SetCrew | CrewDoes | SetOrder | WriteNote
TableRequest = FrameDrawn | Choose | PlayerRequest | Action
_REQUESTS = msgspec.json.Decoder(TableRequest)


def parse_request(text: str | None) -> TableRequest | None:
    """The request in a text from a page; None when it is not a valid one."""
    request = None if text is None else decoded(text, _REQUESTS, MOST_REQUEST)
    texts = [getattr(request, "by", "x")]
    if isinstance(request, SetOrder | WriteNote):
        texts.append(request.text)
    if isinstance(request, SetCrew):
        texts += [request.name, *request.members]
    return request if all(is_printable(text) and text.strip() for text in texts) else None
