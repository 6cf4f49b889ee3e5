# SPDX-License-Identifier: MIT
"""`echostep evaluate ...`: the commands of the studies, which are a distribution of their own.

In: the entry point of the group `echostep_app.commands`. Out: the commands that another distribution brings, or one that says how to get them.
Owns nothing.
"""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import Any, NoReturn

import typer
import typer.core

from echostep.errors import EchostepError

GROUP = "echostep_app.commands"
NAME = "evaluate"
MISSING = "The studies are a package of their own: pip install echostep-studies."


class _Missing(typer.core.TyperGroup):
    """A group of commands that are not there: any name of one raises EchostepError."""

    def get_command(self, *_: Any) -> NoReturn:
        raise EchostepError(f"{self.name}: {MISSING}")


def add_studies(app: typer.Typer) -> None:
    """Add the commands of `echostep-studies`; without it, a group of which each raises EchostepError."""
    entries = {entry.name: entry for entry in entry_points(group=GROUP)}
    app.add_typer(entries[NAME].load() if NAME in entries else _missing(), name=NAME)


def _missing() -> typer.Typer:
    missing = typer.Typer(cls=_Missing, no_args_is_help=True, help=MISSING)

    @missing.callback(help=MISSING)
    def nothing() -> None:
        """Nothing to do."""

    return missing
