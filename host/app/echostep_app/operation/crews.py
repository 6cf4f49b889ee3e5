# SPDX-License-Identifier: MIT
"""The protocol of the crews: who went in when, each check, when out; and the commanders' notes; as a table for the report after the operation.

In: crews before and after a message, notes. Out: a CSV file. Owns the lines; their number is bounded.
"""

from __future__ import annotations

import csv
from datetime import UTC, datetime
from pathlib import Path

from echostep_app.printing.lines import as_error
from echostep_app.team.messages.crews import Crew
from echostep_app.team.messages.orders import Order

MOST_LINES = 10_000  # further ones are left out
HEAD = ("time_utc", "crew", "members", "event", "planned_air_min", "inside_min", "since_check_min", "by")
FORMULAS = ("=", "+", "-", "@")  # a table program runs what begins so


class CrewLog:
    """`note` takes each accepted change, `add_note` each new note; `write` makes the table."""

    def __init__(self) -> None:
        self.events: list[tuple[str, ...]] = []  # in the order of `HEAD`

    def note(self, before: Crew | None, after: Crew | None) -> None:
        """Note how a crew has changed; the same crew again is no event. The times are those since entry and since the check before."""
        if after is None or after == before:
            return
        began_s, minutes = before.entered_s if before and before.is_inside else None, ["", ""]
        if before and began_s is not None:
            minutes = [f"{(after.unix_s - since_s) / 60.0:.1f}" for since_s in (began_s, before.checked_s or began_s)]
        what = after.name, ", ".join(after.members), _event(before, after)
        self._add(after.unix_s, *what, f"{after.air_min:g}", *minutes, after.by)

    def add_note(self, note: Order) -> None:
        """Add a commander's note."""
        self._add(note.unix_s, "", "", f"note: {note.text}", "", "", "", note.by)

    def _add(self, unix_s: float, *cells: str) -> None:
        if len(self.events) < MOST_LINES:
            time = datetime.fromtimestamp(unix_s, UTC).isoformat(timespec="seconds")
            plain = (f"'{cell}" if cell.startswith(FORMULAS) else cell for cell in cells)  # for table programs
            self.events.append((time, *plain))

    def write(self, path: Path) -> None:
        """Write the table, in order of time; raises EchostepError when the file cannot be written."""
        rows = sorted(self.events, key=lambda event: event[0])
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
