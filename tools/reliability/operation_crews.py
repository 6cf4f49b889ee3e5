# SPDX-License-Identifier: MIT
"""Crews of the simulated operation: entry, accountability check (PAR), planned air, as a commander's page would send them.

In: what sends a message that the broker keeps; the table that the commander has written. Out: messages of crews; whether the table has them. Owns the
crews. Two of them begin as if they had entered minutes ago: the operation lasts two minutes, and the page shows what is due.
"""

from __future__ import annotations

import csv
import time
from collections.abc import Callable
from pathlib import Path

from echostep_app.team.messages.crews import Crew, Does

BY = "simulated"  # the commander who signs
MINUTE_S = 60.0
# Name, members, planned air in minutes, minutes since the entry; of the last one a check is due [crews.CHECK_SHARE]
INSIDE = (("Attack 1", ("fallen", "firmware 0"), 30.0, 3.0), ("Attack 2", ("wearer 01", "wearer 02"), 12.0, 5.0))
RESCUE, RESCUE_MEMBERS, RESCUE_AIR_MIN = "Rescue", ("rescuer",), 30.0


class SimulatedCrews:
    """`begin` sends those that are inside, `rescue` one that enters now."""

    def __init__(self, send: Callable[[str, bytes], object]) -> None:
        self._send = send

    def begin(self) -> None:
        """Attack 1 and 2 are inside; Attack 2 has not been asked yet, although a check is due."""
        for k, (name, members, air_min, since_min) in enumerate(INSIDE):
            self._does(self._crew(name, members, air_min, k, since_min), "enter", since_min)

    def rescue(self) -> None:
        """The rescuer enters, and answers a first check at the door."""
        made = self._crew(RESCUE, RESCUE_MEMBERS, RESCUE_AIR_MIN, len(INSIDE), 0.0)
        self._does(self._does(made, "enter"), "check")

    def _does(self, crew: Crew, does: Does, since_min: float = 0.0) -> Crew:
        after = crew.after(does, BY, time.time() - MINUTE_S * since_min)
        assert after
        self._send(*after.message)
        return after

    @staticmethod
    def _crew(name: str, members: tuple[str, ...], air_min: float, number: int, since_min: float) -> Crew:
        return Crew(1, f"{number:08x}", name, members, air_min, BY, time.time() - MINUTE_S * since_min)


def crews_written(table: Path) -> dict[str, list[str]]:
    """Events of each crew in the commander's table, in order; empty where there is no table."""
    events: dict[str, list[str]] = {}
    if table.exists():
        for row in csv.DictReader(table.read_text().splitlines()):
            events.setdefault(row["crew"], []).append(row["event"])
    return events
