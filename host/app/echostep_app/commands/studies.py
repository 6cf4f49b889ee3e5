# SPDX-License-Identifier: MIT
"""`echostep evaluate ...` and `echostep floors`: commands of the studies, which are a distribution of their own.

In: entry points of the group `echostep_app.commands`. Out: the commands that another distribution brings, or ones that say how to get them.
Owns nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import entry_points
from typing import Any, NoReturn

import typer
import typer.core

from echostep.errors import EchostepError

GROUP = "echostep_app.commands"
NAMES = ("evaluate", "floors")
MISSING = "The studies are a package of their own: pip install echostep-studies."


class _Missing(typer.core.TyperGroup):
    """A group of commands that are not there: any name of one raises EchostepError."""

    def get_command(self, *_: Any) -> NoReturn:
        raise EchostepError(f"{self.name}: {MISSING}")


def add_studies(app: typer.Typer) -> None:
    """Add the commands of `echostep-studies`; without it, ones that raise EchostepError."""
    entries = {entry.name: entry for entry in entry_points(group=GROUP)}
    for name in NAMES:
        loaded = entries[name].load() if name in entries else _missing()
        if not isinstance(loaded, typer.Typer):
            app.add_typer(_alone(name, loaded))  # a command of its own would be listed before those of the core
        else:
            app.add_typer(loaded, name=name)


def _alone(name: str, function: Callable[..., Any]) -> typer.Typer:
    """A nameless group of one command."""
    alone = typer.Typer()
    alone.command(name)(function)
    return alone


def _missing() -> typer.Typer:
    missing = typer.Typer(cls=_Missing, no_args_is_help=True, help=MISSING)

    @missing.callback(help=MISSING)
    def nothing() -> None:
        """Nothing to do."""

    return missing
