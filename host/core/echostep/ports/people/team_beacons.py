# SPDX-License-Identifier: MIT
"""Beacons that a teammate has placed: retained messages on `echostep/<team>/<wearer>/beacons`, and chunks of the port `TEAM_BEACONS`.

In: places of beacons from a tracker. Out: topic and bytes, and `TeamBeacons` from such bytes, which may be damaged or hostile. Owns the limits.
The bytes are recorded like those of any port, so a replay has the same beacons in the same order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from echostep.fields import Metres
from echostep.ports.people.payloads import Level, Variance, decoded, is_covariance

TEAM_BEACONS = "team_beacons"  # name of the port
BEACONS = "beacons"  # last part of the topic
SHARE_S = 5.0  # between two messages of a wearer, at least; assumed
MOST_BYTES = 8192  # of one encoded message; 64 beacons have 6,500
MOST_SHARED = 64  # beacons of one teammate: the most that a gateway tells apart
MOST_NUMBER = 0xFFFF  # of a beacon [protocol/messages.toml, beacon]


@dataclass(frozen=True, slots=True)
class SharedBeacon:
    """Beacon `number` at (x_m, y_m) on `level` of the plan, with the covariance (m2) of its place, the placing wearer's own error included."""

    number: Annotated[int, Meta(ge=0, le=MOST_NUMBER)]
    x_m: Metres
    y_m: Metres
    level: Level
    xx_m2: Variance
    xy_m2: Annotated[float, Meta(ge=-1e12, le=1e12)]
    yy_m2: Variance


class TeamBeacons(msgspec.Struct, frozen=True):
    """All beacons that the wearer `name` has placed in one run; they replace the beacons of its earlier message. Numbers are unique."""

    echostep_beacons: Literal[1]
    name: Annotated[str, Meta(min_length=1, max_length=32)]
    run: Annotated[str, Meta(pattern="^[0-9a-f]{8}$")]
    plan_sha256: Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]
    beacons: Annotated[tuple[SharedBeacon, ...], Meta(max_length=MOST_SHARED)]

    def topic(self, team: str) -> str:
        """Where the broker keeps the message."""
        return f"echostep/{team}/{self.name}/{BEACONS}"

    def encode(self) -> bytes:
        """The message as JSON: the bytes of a chunk."""
        return msgspec.json.encode(self)


_DECODER = msgspec.json.Decoder(TeamBeacons)


def parse_team_beacons(payload: bytes) -> TeamBeacons | None:
    """The message in a chunk; None if the bytes are no such message, name a beacon twice, or hold no covariance."""
    message = decoded(payload, _DECODER, MOST_BYTES)
    if message is None:
        return None
    is_unique = len({b.number for b in message.beacons}) == len(message.beacons)
    return message if is_unique and all(is_covariance(b.xx_m2, b.xy_m2, b.yy_m2) for b in message.beacons) else None
