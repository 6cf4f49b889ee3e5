# SPDX-License-Identifier: MIT
"""Meeting: another wearer is beside this one, as a chunk of the port `MEETING`, with what that wearer's tracker has reported.

In: a tap or a radio range, and the position of a report. Out: the bytes of a chunk; a `MeetingMessage` from such bytes, which may be damaged or
hostile. Owns the limits. The bytes are recorded like those of any port, so a replay has the same meetings in the same order.
"""

from __future__ import annotations

from typing import Annotated, Literal, Protocol

import msgspec
from msgspec import Meta

from echostep.plan.plan_file import Metres
from echostep.ports.people.payloads import MOST_LEVELS, Level, Spread, Variance, decoded, has_covariance

Status = Literal["tracking", "uncertain", "lost"]
KNOWN: dict[str, Status] = {"tracking": "tracking", "uncertain": "uncertain"}  # any other state carries no position
MEETING = "meeting"  # name of the port
MOST_BYTES = 512  # of one encoded meeting; assumed
MOST_RANGE_M = 1000.0  # beyond the reach of any radio for short ranges


class ReportedPosition(Spread, Protocol):
    """A position as teammates report it."""

    @property
    def x_m(self) -> float: ...
    @property
    def y_m(self) -> float: ...
    @property
    def floor(self) -> int: ...
    @property
    def floor_probability(self) -> float: ...
    @property
    def age_s(self) -> float: ...


class MeetingMessage(msgspec.Struct, frozen=True):
    """A wearer is near: the newest position (x_m, y_m) on `level` that the wearer's tracker reported, with its covariance (m2), `age_s` ago.

    `level_probability`: of that level. `range_m`: the distance by radio, with standard deviation `range_sd_m`; None: a tap says "side by side".
    `beacon`: number of the beacon that the teammate has placed there, where the range is that to a beacon, not to the teammate.
    """

    name: Annotated[str, Meta(min_length=1, max_length=32)]
    status: Status
    x_m: Metres
    y_m: Metres
    level: Level
    xx_m2: Variance
    xy_m2: Annotated[float, Meta(ge=-1e12, le=1e12)]
    yy_m2: Variance
    age_s: Annotated[float, Meta(ge=0.0, le=1e9)] = 0.0
    level_probability: Annotated[float, Meta(ge=0.0, le=1.0)] = 1.0
    range_m: Annotated[float, Meta(ge=0.0, le=MOST_RANGE_M)] | None = None
    range_sd_m: Annotated[float, Meta(ge=0.0, le=MOST_RANGE_M)] = 0.0
    beacon: Annotated[int, Meta(ge=0, le=0xFFFF)] | None = None

    def encode(self) -> bytes:
        """The meeting as JSON: the bytes of a chunk."""
        return msgspec.json.encode(self)


_DECODER = msgspec.json.Decoder(MeetingMessage)


def meeting_with(
    name: str, status: str, p: ReportedPosition, measured: tuple[float, float] | None = None
) -> MeetingMessage | None:
    """A meeting with a teammate, from its report; None on a floor that no plan has. `measured`: a radio range and its standard deviation (m)."""
    if not 0 <= p.floor < MOST_LEVELS:
        return None
    range_m, range_sd_m = (None, 0.0) if measured is None else measured
    return MeetingMessage(
        name, KNOWN.get(status, "lost"), p.x_m, p.y_m, p.floor, p.xx_m2, p.xy_m2, p.yy_m2, p.age_s, p.floor_probability, range_m, range_sd_m,
    )  # fmt: skip


def parse_meeting(payload: bytes) -> MeetingMessage | None:
    """The meeting in a chunk; None when the bytes are none, or hold no covariance."""
    meeting = decoded(payload, _DECODER, MOST_BYTES)
    return meeting if meeting is not None and has_covariance(meeting) else None
