"""Reference pages out of the code: commands from typer, settings from the dataclasses, derived messages from their schemas.

In: the installed package. Out: host/docs/commands.md, settings.md, a table in recordings.md. `--check` writes nothing and exits 1 when one is stale.
"""

from __future__ import annotations

import argparse
import dataclasses
import inspect
import json
import math
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, get_args, get_type_hints

import typer
import typer.models

from echostep.cli import app
from echostep.output.derived import TOPICS
from echostep.output.foxglove import FRAME, LOCATION, POSE, SCENE
from echostep.recording.recorder import Topic
from echostep.settings import Settings

DOCS = Path(__file__).resolve().parent.parent / "host" / "docs"
BEGIN, END = "<!-- made by make docs -->", "<!-- end -->"
SETTINGS = """\
`--settings FILE` of `live` and `replay`: TOML, one section a stage, every field has a default. A wrong section, field or value is
named. A recording keeps the settings that it was tracked with, and `replay` uses them. Lengths in metres, times in seconds, unless
a name ends otherwise.
"""
MADE = "Made by `make docs` from the code: do not edit.\n"
SHOWN_BY = {
    POSE.name: "where the trunk is; 3D panel",
    FRAME.name: "the same as a frame that the 3D panel can follow",
    SCENE.name: "plan (once), track, 95 % ellipse, both echoes as beams; 3D panel",
    LOCATION.name: "the place on Earth with its covariance, when the plan is georeferenced; map panel",
}


def pages() -> dict[str, str]:
    """The text of each page by its name."""
    return {"commands.md": commands_page(), "settings.md": settings_page(), "recordings.md": recordings_page()}


def commands_page() -> str:
    """Every command with its arguments and options."""
    parts = [
        "# Commands\n",
        MADE,
        "`echostep COMMAND --help` says the same. A mistake ends with one line and exit status 2.\n",
    ]
    for name, call in sorted(commands("echostep", app)):
        parts.append(f"## {name}\n\n{_paragraph(call.__doc__)}\n")
        hints = get_type_hints(call, include_extras=True)
        rows = [
            _row(name, hints[name], parameter.default) for name, parameter in inspect.signature(call).parameters.items()
        ]
        if rows:
            parts.append("| | default | |\n|---|---|---|\n" + "".join(rows))
    return "\n".join(parts)


def commands(name: str, group: typer.Typer) -> Iterator[tuple[str, Callable[..., Any]]]:
    """The function behind each command, by its full name."""
    for command in group.registered_commands:
        if command.callback is not None and not command.hidden:
            yield f"{name} {command.name or command.callback.__name__.replace('_', '-')}", command.callback
    for sub in group.registered_groups:
        if sub.typer_instance is not None:
            yield from commands(f"{name} {sub.name}" if isinstance(sub.name, str) else name, sub.typer_instance)


def _row(name: str, hint: Any, default: Any) -> str:
    """A parameter in the table: how it is written, its default, what it means."""
    plain, info = (hint.__origin__, hint.__metadata__[0]) if hasattr(hint, "__metadata__") else (hint, None)
    if isinstance(info, typer.models.ArgumentInfo):
        written = f"`{info.metavar or name.upper()}`"
    else:
        given = (
            (info.default, *(info.param_decls or ())) if info else ()
        )  # in Annotated[], the first name stands where a default would
        declared = [name for d in given if isinstance(d, str) and d.startswith("-") for name in d.split("/")]
        flag = plain is bool or bool in get_args(plain)
        value = "" if flag else f" `{(info.metavar if info else None) or 'VALUE'}`"
        written = ", ".join(f"`{d}`" for d in declared or [f"--{name.replace('_', '-')}"]) + value
    text = " ".join(((info.help if info else None) or "").split()).replace("|", "\\|")
    return f"| {written} | {_default(default)} | {text} |\n"


def _default(value: Any) -> str:
    if value is inspect.Parameter.empty:
        return "required"
    if value is None or value is False or value == "" or (isinstance(value, float) and math.isinf(value)):
        return ""
    return f"`{value}`"


def _paragraph(text: str | None) -> str:
    return inspect.cleandoc(text or "").strip()


def settings_page() -> str:
    """Every section and field of the settings."""
    parts = ["# Settings\n", MADE, SETTINGS]
    for stage in dataclasses.fields(Settings):
        default = getattr(Settings(), stage.name)
        rows = [f"{f.name} = {_toml(getattr(default, f.name))}" for f in dataclasses.fields(default)]
        parts.append(f"## [{stage.name}]\n\n{_paragraph(type(default).__doc__)}\n")
        parts.append("```toml\n" + "\n".join([f"[{stage.name}]", *rows]) + "\n```\n")
    return "\n".join(parts)


def _toml(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else repr(value)


def recordings_page() -> str:
    """The page as it is, with its table of derived messages made anew."""
    rows = [
        f"| `{t.name}` | `{t.schema_name}` | {SHOWN_BY.get(t.name) or _fields(t)} |"
        for t in (*TOPICS, POSE, FRAME, SCENE, LOCATION)
    ]
    table = "\n".join([BEGIN, "| topic | schema | |", "|---|---|---|", *rows, END])
    before, _, rest = (DOCS / "recordings.md").read_text().partition(BEGIN)
    return before + table + rest.partition(END)[2]


def _fields(topic: Topic) -> str:
    return ", ".join(f"`{name}`" for name in json.loads(topic.schema)["properties"])


def main() -> int:
    """Write the pages, or say which are stale."""
    parser = argparse.ArgumentParser(description="make the reference pages")
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 when a page is stale")
    check, stale = parser.parse_args().check, False
    for name, text in pages().items():
        path = DOCS / name
        if path.exists() and path.read_text() == text:
            continue
        stale = True
        if not check:
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)
        print(f"{path}: {'stale, run make docs' if check else 'written'}")
    return int(check and stale)


if __name__ == "__main__":
    sys.exit(main())
