# SPDX-License-Identifier: MIT
"""A meeting from what a teammate has reported.

In: the name, the state and the position of a report. Out: the `MeetingMessage` that a tracker takes. Owns nothing.
"""

from __future__ import annotations

from typing import Literal

from echostep.ports.people.meeting import MeetingMessage
from echostep.ports.people.payloads import MOST_LEVELS
from echostep.team.messages.report import Position

Status = Literal["tracking", "uncertain", "lost"]
KNOWN: dict[str, Status] = {
    "tracking": "tracking",
    "uncertain": "uncertain",
}  # any other state of a report carries no position


def meeting_with(
    name: str, status: str, position: Position,
    measured: tuple[float, float] | None = None,
) -> MeetingMessage | None:  # fmt: skip
    """A meeting with a teammate, from its report; None on a floor that no plan has. `measured`: a radio range and its standard deviation (m)."""
    p = position
    if not 0 <= p.floor < MOST_LEVELS:
        return None
    range_m, range_sd_m = (None, 0.0) if measured is None else measured
    return MeetingMessage(
        name, KNOWN.get(status, "lost"), p.x_m, p.y_m, p.floor, p.xx_m2, p.xy_m2, p.yy_m2, p.age_s, p.floor_probability, range_m, range_sd_m,
    )  # fmt: skip
