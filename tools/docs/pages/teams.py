# SPDX-License-Identifier: MIT
"""host/docs/teams.md: its tables of every field of a report, and the report's JSON Schema, from the dataclasses that the host checks with.

In: `echostep_app.team.messages.report`. Out: the page with its tables regenerated, and the text of report.schema.json. Owns nothing.
"""

from __future__ import annotations

import json
from typing import Any

from docs.pages import DOCS, HOST, between_marks, kind
from echostep_app.team.messages.report import schema

SCHEMA = HOST / "app/echostep_app/team/report.schema.json"


def tables(tree: dict[str, Any]) -> str:
    """A table of fields for each object of the schema, the report first."""
    made = []
    for name, part in sorted(tree["$defs"].items(), key=lambda pair: pair[0] != "Report"):
        made.append(f"### {name}\n{part['description']}\n\n| field | type | limits | meaning |\n|---|---|---|---|\n")
        made += [
            f"| `{field}` | {kind(row)} | {limits(row)} | {meaning(row)} |\n"
            for field, row in part["properties"].items()
        ]
        made.append("\n")
    return "".join(made)


def limits(row: dict[str, Any]) -> str:
    """The range of a number, the length of a text."""
    if "anyOf" in row:
        return next((limit for part in row["anyOf"] if (limit := limits(part))), "")
    low, high = row.get("minimum"), row.get("maximum")
    if low is not None:
        return f"{low:g} to {'2^53' if high == 2**53 else f'{high:g}'}"
    if "maxItems" in row:
        return f"at most {row['maxItems']}, of {limits(row['items'])}"
    least, most = row.get("minLength", 0), row.get("maxLength")
    if most is not None:
        return f"{least} to {most} characters"
    return f"`{row['pattern']}`" if "pattern" in row else ""


def meaning(row: dict[str, Any]) -> str:
    """A field's description."""
    parts = [row, *row.get("anyOf", [])]
    return next((str(part["description"]) for part in parts if "description" in part), "")


def tree() -> dict[str, Any]:
    """The schema as objects."""
    parsed: dict[str, Any] = json.loads(schema())
    return parsed


def page() -> str:
    """The page with its tables regenerated."""
    return between_marks((DOCS / "teams.md").read_text(), tables(tree()))
