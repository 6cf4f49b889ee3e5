# SPDX-License-Identifier: MIT
"""The runner of the campaigns: options, runs that go on where they stopped, progress, figures with their limits.

In: defaults, runs by name, figures. Out: the options; a JSON line a run; a table on stdout and the exit status. Owns the form of a journal.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console
from rich.progress import track
from rich.table import Table

from echostep_app.printing.lines import put_aside

Row = dict[str, Any]


class Figure(NamedTuple):
    """What a campaign has measured; `passed` is None where there is no limit."""

    what: str
    measured: str
    limit: str = "-"
    passed: bool | None = None


class CampaignJournal:
    """Rows of a file, a JSON line each: the next run goes on behind them."""

    def __init__(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._path, whole = path, True
        self.rows: list[Row] = []
        for line in path.read_text(errors="replace").splitlines() if path.is_file() else ():
            try:
                self.rows.append(dict(json.loads(line)))
            except (ValueError, TypeError):
                whole = False
        if os.path.lexists(path) and not (path.is_file() and whole):
            put_aside(path, f"{len(self.rows)} of its runs are used, the others made anew")
            path.write_text("".join(json.dumps(row) + "\n" for row in self.rows))

    def add(self, row: Row) -> None:
        """Keep one more row at once, for a campaign may be stopped at any time."""
        self.rows.append(row)
        with self._path.open("a") as file:
            file.write(json.dumps(row) + "\n")

    def play(
        self, title: str, runs: Mapping[str, Callable[[], Any]], say: Callable[[Row], str] = lambda _: ""
    ) -> list[Row]:
        """The row of each run: its name, and the fields of the dataclass that it returns. Those that the file has are not run again."""
        rows = {row.get("name"): row for row in self.rows}
        for name in track([name for name in runs if name not in rows], title):
            rows[name] = {"name": name} | asdict(runs[name]())
            self.add(rows[name])
            if text := say(rows[name]):
                print(text, flush=True)
        return [rows[name] for name in runs]


def options(doc: str | None, **known: tuple[Any, str]) -> argparse.Namespace:
    """Values of the options; `known`: default, which gives the type, and help of each. The first line of `doc` is the program's description."""
    parser = argparse.ArgumentParser(description=(doc or "").partition("\n")[0])
    for name, (default, text) in known.items():
        if isinstance(default, bool):
            parser.add_argument(f"--{name}", action="store_true", help=text)
        elif isinstance(default, list):
            parser.add_argument(f"--{name}", nargs="+", choices=default, default=default, help=text)
        else:
            parser.add_argument(f"--{name}", type=type(default), default=default, help=f"{text} (default {default})")
    return parser.parse_args()


def none(what: str, count: int) -> Figure:
    """The figure of something that may never happen."""
    return Figure(what, f"{count:,}", "0", count == 0)


def report(title: str, figures: Iterable[tuple[str, str, str, bool | None]]) -> int:
    """Print the figures; 1 when one has missed its limit."""
    table, status = Table("figure", "measured", "limit", "", title=title), 0
    for what, measured, limit, passed in figures:
        table.add_row(what, measured, limit, {True: "PASS", False: "FAIL", None: ""}[passed])
        status |= passed is False
    Console().print(table)
    return status
