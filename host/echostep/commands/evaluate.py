# SPDX-License-Identifier: MIT
"""`echostep evaluate ...`: the studies, which are a distribution of their own.

In: entry points of the group `echostep.commands`. Out: the commands that another distribution brings, or one that says how to get them.
Owns nothing.
"""

from __future__ import annotations

from importlib.metadata import entry_points

import typer

from echostep.errors import EchostepError

GROUP = "echostep.commands"
HELP = "The papers' experiments and ours, with figures and plots."


def studies() -> typer.Typer:
    """The commands of `echostep-studies`; without it, one that raises EchostepError."""
    for entry in entry_points(group=GROUP, name="evaluate"):
        app: typer.Typer = entry.load()
        return app
    missing = typer.Typer(help=HELP, invoke_without_command=True)

    @missing.callback(context_settings={"allow_extra_args": True, "ignore_unknown_options": True})
    def evaluate() -> None:
        """The papers' experiments and ours, with figures and plots (pip install echostep-studies)."""
        raise EchostepError("evaluate: the studies are a package of their own: pip install echostep-studies")

    return missing
