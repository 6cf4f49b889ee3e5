# SPDX-License-Identifier: MIT
"""Check-in: the wearer's position, entered by hand, and its undoing; a call for help, and its end.

In: a position from the page, or a call. Out: the bytes of a chunk of the port `PERSON`; `CheckIn`s, `Undo`s or `Call`s from them. Owns nothing.
The bytes are recorded like those of any port, so a replay has the same check-ins in the same order. They may be damaged or hostile.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from typing import Annotated

import msgspec
from msgspec import Meta, structs

from echostep.fields import Metres
from echostep.ports.people.payloads import Level, decoded

PERSON = "person"  # name of the port
# Assumed, all of them.
MOST_BYTES = 512  # of one encoded check-in
LEAST_SD_M, MOST_SD_M = 0.05, 100.0  # m, per axis; an entered value is limited to this range
HEADING_SD_RAD = math.radians(15.0)  # of an entered heading


@dataclass(frozen=True, slots=True)
class CheckIn:
    """A position (x_m, y_m) on a level, with standard deviation `sd_m` per axis. `heading_rad` is None when only a position was entered."""

    x_m: float
    y_m: float
    heading_rad: float | None
    sd_m: float
    level: int = 0

    def encode(self) -> bytes:
        """The check-in as JSON: the bytes of a chunk."""
        return json.dumps(asdict(self)).encode()


class EnteredPlace(msgspec.Struct, frozen=True):
    """A check-in as it is sent: any heading, any deviation."""

    x_m: Metres
    y_m: Metres
    sd_m: Metres
    heading_rad: Metres | None = None
    level: Level = 0

    @property
    def check_in(self) -> CheckIn:
        """The check-in: its heading within half a turn, its deviation within the limits."""
        wrapped = None if self.heading_rad is None else math.remainder(self.heading_rad, 2.0 * math.pi)
        return CheckIn(self.x_m, self.y_m, wrapped, min(max(self.sd_m, LEAST_SD_M), MOST_SD_M), self.level)


class Undo(msgspec.Struct, frozen=True, tag_field="kind", tag="undo"):
    """Takes back check-in number `undo`, counted from 1, if it is still the newest."""

    undo: Annotated[int, Meta(gt=0, lt=1 << 31)]

    def encode(self) -> bytes:
        """The undoing as JSON: the bytes of a chunk."""
        return json.dumps(structs.asdict(self)).encode()


class Call(msgspec.Struct, frozen=True, tag_field="kind", tag="call"):
    """The wearer asks for help (`help` True), or withdraws the call."""

    help: bool

    def encode(self) -> bytes:
        """The call as JSON: the bytes of a chunk."""
        return json.dumps(structs.asdict(self)).encode()


_CALLS, _UNDOINGS = msgspec.json.Decoder(Call), msgspec.json.Decoder(Undo)
_PLACES = msgspec.json.Decoder(EnteredPlace)


def parse_person(payload: bytes) -> CheckIn | Undo | Call | None:
    """The check-in, the undoing or the call of a chunk; None when the bytes are none of them. Other fields are ignored."""
    if message := decoded(payload, _CALLS, MOST_BYTES) or decoded(payload, _UNDOINGS, MOST_BYTES):
        return message
    place = decoded(payload, _PLACES, MOST_BYTES)
    return None if place is None else place.check_in
