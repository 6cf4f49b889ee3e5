# SPDX-License-Identifier: MIT
"""`echostep evaluate ...`: the studies, which are a distribution of their own.

In: entry points of the group `echostep.commands`. Out: the commands that another distribution brings, or one that says how to get them.
Owns nothing.
"""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import Any, NoReturn

import typer
import typer.core

from echostep.errors import EchostepError

GROUP = "echostep.commands"
MISSING = "The studies are a package of their own: pip install echostep-studies."


class _MissingStudies(typer.core.TyperGroup):
    """A group of commands that are not there: any name of one raises EchostepError."""

    def get_command(self, *_: Any) -> NoReturn:
        raise EchostepError(f"evaluate: {MISSING}")


def studies() -> typer.Typer:
    """The commands of `echostep-studies`; without it, one that raises EchostepError."""
    for entry in entry_points(group=GROUP, name="evaluate"):
        app: typer.Typer = entry.load()
        return app
    missing = typer.Typer(cls=_MissingStudies, no_args_is_help=True, help=MISSING)

    @missing.callback(help=MISSING)
    def evaluate() -> None:
        """Nothing to do."""

    return missing
