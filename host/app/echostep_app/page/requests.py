# SPDX-License-Identifier: MIT
"""Requests of a page: texts from its WebSocket -> checked objects.

In: texts, which may be damaged or hostile. Out: requests; None for an invalid text. Owns the limits.
"""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from echostep.fields import Metres
from echostep.ports.people.check_in import Call, CheckIn, EnteredPlace, Undo
from echostep.ports.people.payloads import Level, decoded
from echostep_app.plan.routing import RoutePlace

MOST_REQUEST = 2048  # characters
MOST_NAME = 32  # characters of a wearer's name, as in reports
FASTEST = 32.0  # times as fast as it was recorded
Identity = Annotated[str, Meta(min_length=8, max_length=64)]
Integer = Annotated[int, Meta(gt=-(1 << 53), lt=1 << 53)]  # that JavaScript represents exactly


class Kept(msgspec.Struct, frozen=True):
    """A request that the page keeps until it is answered has an identity; it holds until `until_s` of the server's clock."""

    request: Identity
    until_s: float | None = None


class Entered(EnteredPlace, frozen=True, tag_field="kind", tag="check_in"):
    """The wearer is at this place: `parse_request` returns its `CheckIn`."""


class Consider(EnteredPlace, frozen=True, tag_field="kind", tag="consider"):
    """Preview a check-in, without making it."""


class Met(msgspec.Struct, frozen=True, tag_field="kind", tag="met"):
    """The wearer has met a teammate of this name."""

    name: Annotated[str, Meta(min_length=1, max_length=MOST_NAME)]


class Understood(msgspec.Struct, frozen=True, tag_field="kind", tag="understood"):
    """The wearer has understood a commander's order."""

    id: Annotated[str, Meta(min_length=1, max_length=64)]


class GoTo(msgspec.Struct, frozen=True, tag_field="kind", tag="go_to"):
    """Guide the wearer to a place."""

    x_m: Metres
    y_m: Metres
    level: Level = 0

    @property
    def goal(self) -> RoutePlace:
        """The place."""
        return RoutePlace(self.x_m, self.y_m, self.level)


class Strike(GoTo, frozen=True, tag_field="kind", tag="strike"):
    """There is no way at a place; where that was said before: there is one."""


class GoOut(msgspec.Struct, frozen=True, tag_field="kind", tag="go_out"):
    """Guide the wearer to the nearest exit."""


class EndGuidance(msgspec.Struct, frozen=True, tag_field="kind", tag="go_nowhere"):
    """End the guidance to the destination that was chosen on a page."""


class FrameDrawn(msgspec.Struct, frozen=True, tag_field="kind", tag="drawn"):
    """The page has drawn frame number `seq`."""

    seq: Integer


class SetPlaying(msgspec.Struct, frozen=True, tag_field="kind", tag="play"):
    """Run or pause the replay."""

    playing: bool


class SetSpeed(msgspec.Struct, frozen=True, tag_field="kind", tag="speed"):
    """Replay `times` as fast as it was recorded."""

    times: Annotated[float, Meta(gt=0.0, le=FASTEST)]


class Seek(msgspec.Struct, frozen=True, tag_field="kind", tag="seek"):
    """Show the moment `t_s` of the replay."""

    t_s: Annotated[float, Meta(ge=-1e9, le=1e9)]


class Step(msgspec.Struct, frozen=True, tag_field="kind", tag="step"):
    """Move the replay by a number of estimates, of an operation by tens of seconds; negative: back."""

    steps: Integer


PlayerRequest = SetPlaying | SetSpeed | Seek | Step
_OwnRequest = (
    Undo | Call | Consider | Met | Understood | GoTo | Strike | GoOut | EndGuidance | FrameDrawn | PlayerRequest
)
Request = CheckIn | _OwnRequest
_KEPT = msgspec.json.Decoder(Kept)
_REQUESTS = msgspec.json.Decoder(Entered | _OwnRequest)


def parse_request(text: str) -> Request | None:
    """The request in a text from a page; None when the text is not a valid request."""
    request = decoded(text, _REQUESTS, MOST_REQUEST)
    return request.check_in if isinstance(request, Entered) else request


def kept_request(text: str | None) -> Kept | None:
    """The identity of a request in a text from a page; None when it has none."""
    return None if text is None else decoded(text, _KEPT, MOST_REQUEST)
