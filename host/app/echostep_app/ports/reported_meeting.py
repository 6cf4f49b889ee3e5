# SPDX-License-Identifier: MIT
"""A meeting with a teammate, from the position that the teammate's tracker has reported.

In: a report's position, perhaps a measured range. Out: a `MeetingMessage`. Owns nothing.
"""

from __future__ import annotations

from typing import Protocol

from echostep.ports.people.meeting import MeetingMessage, Status
from echostep.ports.people.payloads import MOST_LEVELS, Spread

KNOWN: dict[str, Status] = {"tracking": "tracking", "uncertain": "uncertain"}  # any other state carries no position


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
