# SPDX-License-Identifier: MIT
"""Tap: the wearer is at a surveyed point now, as a chunk of the port `POINT`.

In: the number of a point. Out: the bytes of a chunk; a `Tap` from such bytes, which may be damaged or hostile. Owns nothing.
The bytes are recorded as for any port. They never reach the tracker: a track is judged by them.
"""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from echostep.ports.chunks import LATEST_NS
from echostep.ports.people.payloads import decoded

MOST_BYTES = 128  # of one encoded tap; assumed
MOST_POINTS = 100  # of a protocol; assumed


class Tap(msgspec.Struct, frozen=True):
    """At `t_ns` of the host's clock the wearer was at this point (its index), `standing` or passing by; None takes back the newest tap.

    The chunk may be later: it waits while the run is behind its ports.
    """

    point: Annotated[int, Meta(ge=0, lt=MOST_POINTS)] | None
    standing: bool = False
    t_ns: Annotated[int, Meta(ge=0, lt=LATEST_NS)] = 0

    def encode(self) -> bytes:
        """The tap as JSON: the bytes of a chunk."""
        return msgspec.json.encode(self)


_DECODER = msgspec.json.Decoder(Tap)


def parse_tap(payload: bytes) -> Tap | None:
    """The tap in a chunk; None when the bytes are not a tap."""
    return decoded(payload, _DECODER, MOST_BYTES)
