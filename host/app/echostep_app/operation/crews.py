# SPDX-License-Identifier: MIT
"""The protocol of the crews: who went in when, each check, when out; as a table for the report after the operation.

In: crews before and after a message. Out: a CSV file. Owns the lines; their number is bounded.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from echostep_app.printing.lines import as_error
from echostep_app.team.messages.crews import Crew

MOST_LINES = 10_000  # further ones are left out
HEAD = ("time_utc", "crew", "members", "event", "planned_air_min", "inside_min", "since_check_min", "by")
FORMULAS = ("=", "+", "-", "@")  # a table program runs what begins so


@dataclass(frozen=True, slots=True)
class CrewEvent:
    """A line. `inside_min`, `since_check_min`: times since entry and since the check before; None outside."""

    crew: Crew
    event: str
    inside_min: float | None
    since_check_min: float | None

    @property
    def cells(self) -> tuple[str, ...]:
        """In the order of `HEAD`."""
        c = self.crew
        time = datetime.fromtimestamp(c.unix_s, UTC).isoformat(timespec="seconds")
        minutes = ["" if value is None else f"{value:.1f}" for value in (self.inside_min, self.since_check_min)]
        return time, _plain(c.name), _plain(", ".join(c.members)), self.event, f"{c.air_min:g}", *minutes, _plain(c.by)


class CrewLog:
    """`note` takes each accepted message; `write` makes the table."""

    def __init__(self) -> None:
        self.events: list[CrewEvent] = []

    def note(self, before: Crew | None, after: Crew | None) -> None:
        """Note how a crew has changed; the same crew again is no event."""
        if after is None or after == before or len(self.events) >= MOST_LINES:
            return
        began_s = before.entered_s if before and before.is_inside else None
        inside, since = (None, None)
        if before and began_s is not None:
            inside = (after.unix_s - began_s) / 60.0
            since = (after.unix_s - (before.checked_s or began_s)) / 60.0
        self.events.append(CrewEvent(after, _event(before, after), inside, since))

    def write(self, path: Path) -> None:
        """Write the table, in order of time; raises EchostepError when the file cannot be written."""
        rows = [event.cells for event in sorted(self.events, key=lambda event: event.crew.unix_s)]
        with as_error(f"{path}: cannot write the crews"), path.open("w", encoding="utf-8", newline="") as file:
            csv.writer(file).writerows([HEAD, *rows])


def _event(before: Crew | None, after: Crew) -> str:
    if before is None and after.entered_s is None:
        return "made"
    if after.left_s is not None and (before is None or before.left_s is None):
        return "left"
    if after.is_inside and (before is None or not before.is_inside):
        return "entered"
    if before is not None and after.checked_s != before.checked_s:
        return "checked"
    return "changed"


def _plain(text: str) -> str:
    """A cell that no table program takes for a formula."""
    return f"'{text}" if text.startswith(FORMULAS) else text
