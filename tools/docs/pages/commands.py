# SPDX-License-Identifier: MIT
"""host/docs/commands.md: every command with its arguments and options, from typer.

In: `echostep_app.cli`. Out: the page. Owns nothing.
"""

from __future__ import annotations

import inspect
import math
import re
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any, get_args, get_type_hints

import typer
import typer.models

from docs.pages import MADE
from echostep_app.cli import app

HEAD = f"""# Commands
{MADE}
`echostep COMMAND --help` prints the same. A mistake ends with one line and exit status 2. A run that was done to its end, but whose recording
lacks something (a full disk), ends with one line and exit status 1.
"""
TABLE = "| | default | |\n|---|---|---|\n"


def page() -> str:
    """Every command with its arguments and options; a row that three or more commands have alike is written once, at the end."""
    calls = sorted(commands("echostep", app))
    rows = {name: list(_rows(call)) for name, call in calls}
    counts = Counter(row for several in rows.values() for row in several)
    common = [row for row, count in counts.items() if count >= 3 and row.startswith("| `-")]
    parts = [HEAD]
    for name, call in calls:
        parts.append(f"## {name}\n\n{inspect.cleandoc(call.__doc__ or '')}\n")
        if own := [row for row in rows[name] if row not in common]:
            parts.append(TABLE + "".join(own))
        if shared := re.findall(r"`-[^`]+`", "".join(row.split(" | ")[0] for row in rows[name] if row in common)):
            parts.append(f"[Common](#common-options): {', '.join(shared)}.\n")
    return "\n".join([*parts, "## Common options\n", TABLE + "".join(common)])


def commands(name: str, group: typer.Typer) -> Iterator[tuple[str, Callable[..., Any]]]:
    """The function behind each command, by its full name."""
    for command in group.registered_commands:
        if command.callback is not None and not command.hidden:
            yield f"{name} {command.name or command.callback.__name__.replace('_', '-')}", command.callback
    for sub in group.registered_groups:
        if sub.typer_instance is not None:
            yield from commands(f"{name} {sub.name}" if isinstance(sub.name, str) else name, sub.typer_instance)


def _rows(call: Callable[..., Any]) -> Iterator[str]:
    hints = get_type_hints(call, include_extras=True)
    for name, parameter in inspect.signature(call).parameters.items():
        yield _row(name, hints[name], parameter.default)


def _row(name: str, hint: Any, default: Any) -> str:
    """A row of the table: a parameter's syntax, default and meaning."""
    plain, info = (hint.__origin__, hint.__metadata__[0]) if hasattr(hint, "__metadata__") else (hint, None)
    if isinstance(info, typer.models.ArgumentInfo):
        written = f"`{info.metavar or name.upper()}`"
    else:
        given = (
            (info.default, *(info.param_decls or ())) if info else ()
        )  # in Annotated[], the first name takes the place of a default
        declared = [option for d in given if isinstance(d, str) and d.startswith("-") for option in d.split("/")]
        flag = plain is bool or bool in get_args(plain)
        value = "" if flag else f" `{(info.metavar if info else None) or 'VALUE'}`"
        written = ", ".join(f"`{d}`" for d in declared or [f"--{name.replace('_', '-')}"]) + value
    text = " ".join(((info.help if info else None) or "").split())
    return "| {} | {} | {} |\n".format(*(cell.replace("|", "\\|") for cell in (written, _default(default), text)))


def _default(value: Any) -> str:
    if value is inspect.Parameter.empty:
        return "required"
    if value is None or value is False or value == "" or (isinstance(value, float) and math.isinf(value)):
        return ""
    return f"`{value}`"
