# SPDX-License-Identifier: MIT
"""Teammate: where another wearer is, as a chunk of the port `TEAM`, so that a rescuer's recording holds the places that its guidance used.

In: a position from a team report. Out: the bytes of a chunk, and a `Teammate` from such bytes, which may be damaged or hostile. Owns the limits.
"""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from echostep.fields import Metres
from echostep.ports.people.payloads import Level, decoded

MOST_BYTES = 512  # of one encoded position; assumed


class Teammate(msgspec.Struct, frozen=True):
    """A wearer's place (x_m, y_m) on a level, within `radius_m` (95 %), and that place in words."""

    name: Annotated[str, Meta(max_length=32)]
    x_m: Metres
    y_m: Metres
    level: Level
    radius_m: Annotated[float, Meta(ge=0.0, le=1e7)]
    words: Annotated[str, Meta(max_length=200)] = ""

    def encode(self) -> bytes:
        """The place as JSON: the bytes of a chunk."""
        return msgspec.json.encode(self)


_DECODER = msgspec.json.Decoder(Teammate)


def parse_teammate(payload: bytes) -> Teammate | None:
    """The place in a chunk; None when the bytes are not a place."""
    return decoded(payload, _DECODER, MOST_BYTES)
