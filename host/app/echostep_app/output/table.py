# SPDX-License-Identifier: MIT
"""A table on the terminal.

In: rows, which are dictionaries with the same keys. Out: a printed table. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rich.table import Table as TerminalTable

from echostep_app.printing.console import PeopleConsole, console_for_people

MIN_TABLE_WIDTH = 110  # characters of a table where the terminal is narrower or its width is unknown
console = console_for_people()


@dataclass(frozen=True, slots=True)
class Table:
    """A table on the terminal; `columns`: key of the rows -> heading; `notes`: lines below it. A missing value is an empty cell."""

    title: str
    rows: Sequence[Mapping[str, Any]]
    columns: Mapping[str, str]
    notes: Sequence[str] = ()

    def print(self) -> None:
        """Print the table, then its notes. Floats have two digits after the point."""
        table = TerminalTable(title=self.title)
        for k, heading in enumerate(self.columns.values()):
            table.add_column(heading, justify="right" if k else "left", overflow="fold")
        for row in self.rows:
            table.add_row(*(_cell(row.get(key)) for key in self.columns))
        PeopleConsole(width=max(console.width, MIN_TABLE_WIDTH)).print(table)
        for note in self.notes:
            console.print(note)


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.2f}" if isinstance(value, float) else str(value)
