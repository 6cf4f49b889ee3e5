# SPDX-License-Identifier: MIT
"""Meeting: another wearer is next to this one, as a chunk of the port `MEETING`, with the report of that wearer's tracker.

In: a tap or a radio range, and the position of a report. Out: the bytes of a chunk; a `MeetingMessage` from such bytes, which may be damaged or
hostile. Owns the limits. The bytes are recorded like those of any port, so a replay has the same meetings in the same order.
"""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from echostep.fields import Metres
from echostep.ports.people.payloads import Level, Variance, decoded, is_covariance

Status = Literal["tracking", "uncertain", "lost"]
MEETING = "meeting"  # name of the port
MOST_BYTES = 512  # of one encoded meeting; assumed
MOST_RANGE_M = 1000.0  # beyond the reach of any radio for short ranges


class MeetingMessage(msgspec.Struct, frozen=True):
    """A wearer is near: the newest position (x_m, y_m) on `level` that the wearer's tracker reported, with its covariance (m2), `age_s` ago.

    `level_probability`: of that level. `range_m`: the distance by radio, with standard deviation `range_sd_m`; None if a tap says "side by side".
    `beacon`: number of the beacon that the teammate has placed there, if the range is to this beacon, not to the teammate.
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


def parse_meeting(payload: bytes) -> MeetingMessage | None:
    """The meeting in a chunk; None if the bytes are no meeting, or hold no covariance."""
    meeting = decoded(payload, _DECODER, MOST_BYTES)
    return meeting if meeting and is_covariance(meeting.xx_m2, meeting.xy_m2, meeting.yy_m2) else None
