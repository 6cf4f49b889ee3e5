# SPDX-License-Identifier: MIT
"""host/docs/commands.md: every command with its arguments and options, from typer.

In: `echostep_app.cli`. Out: the page. Owns nothing.
"""

from __future__ import annotations

import inspect
import math
import re
from collections import Counter
from collections.abc import Iterator
from itertools import chain
from typing import Any

import typer.main

from docs.pages import MADE
from echostep_app.cli import app

HEAD = f"""# Commands
{MADE}
`echostep COMMAND --help` prints the same. A mistake ends with one line and exit status 2. A run that was done to its end, but whose recording
lacks something (a full disk), ends with one line and exit status 1.
"""
COMMON = "## Common options\n\nNAME is the last word of the command.\n"
TABLE = "| | default | |\n|---|---|---|\n"


def page() -> str:
    """Every command with its arguments and options; a row that several commands have alike is written once, at the end."""
    tree = sorted(commands("echostep", typer.main.get_command(app)))
    rows = {name: [_row(each, f"out/{name.rpartition(' ')[2]}") for each in command.params] for name, command in tree}
    counts = Counter(chain(*rows.values()))
    common: dict[str, str] = {}  # by the option's longest name: the row that most commands have
    for row in sorted(counts, key=lambda row: (counts[row], len(row)), reverse=True):
        if counts[row] > 1 and (options := _options(row)):
            common.setdefault(max(options, key=len), row)
    parts = [HEAD]
    for name, command in tree:
        parts.append(f"## {name}\n\n{inspect.cleandoc(command.callback.__doc__ or '')}\n")
        if own := "".join(row for row in rows[name] if row not in common.values()):
            parts.append(TABLE + own.replace("out/NAME", f"out/{name.rpartition(' ')[2]}"))
        if shared := ", ".join(max(_options(row), key=len) for row in rows[name] if row in common.values()):
            parts.append(f"[Common](#common-options): {shared}.\n")
    return "\n".join([*parts, COMMON, TABLE + "".join(sorted(common.values()))])


def commands(name: str, command: Any) -> Iterator[tuple[str, Any]]:
    """Each command by its full name."""
    for word, below in getattr(command, "commands", {}).items():
        yield from commands(f"{name} {word}", below)
    if not hasattr(command, "commands") and not command.hidden:
        yield name, command


def _row(parameter: Any, folder: str) -> str:
    """A row of the table: a parameter's syntax, default and meaning."""
    written = f"`{parameter.metavar or parameter.name.upper()}`"
    if parameter.param_type_name == "option":
        value = "" if parameter.is_flag else f" `{parameter.metavar or 'VALUE'}`"
        written = ", ".join(f"`{name}`" for name in (*parameter.opts, *parameter.secondary_opts)) + value
    default = getattr(parameter.default, "value", parameter.default)
    absent = default is None or default is False or default in ("", math.inf)
    shown = "required" if parameter.required else "" if absent else f"`{default}`".replace(folder, "out/NAME")
    text = " ".join((parameter.help or "").split())
    return "| {} | {} | {} |\n".format(*(cell.replace("|", "\\|") for cell in (written, shown, text)))


def _options(row: str) -> list[str]:
    return re.findall(r"`-[^`]+`", row.partition(" | ")[0])
