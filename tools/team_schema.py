"""The published form of a report: JSON Schema and the tables of host/TEAMS.md, made from the dataclasses that the host checks with.

In: `echostep.team.report`. Out: host/echostep/team/report.schema.json, and the part of host/TEAMS.md between its marks; with --check nothing is
written and the status is 1 when they are stale.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from echostep.team.report import schema

ROOT = Path(__file__).resolve().parent.parent
SCHEMA, TEAMS = ROOT / "host/echostep/team/report.schema.json", ROOT / "host/TEAMS.md"
BEGIN, END = "<!-- made by tools/team_schema.py -->\n", "<!-- end -->\n"


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


def kind(row: dict[str, Any]) -> str:
    """The type of a field in words."""
    if "$ref" in row:
        return str(row["$ref"]).rpartition("/")[2]
    if "anyOf" in row:
        return " or ".join(kind(part) for part in row["anyOf"])
    if "enum" in row:
        return ", ".join(f"`{value}`" for value in row["enum"])
    if row.get("type") == "array":
        return f"list of {kind(row['items'])}"
    return str(row.get("type", ""))


def limits(row: dict[str, Any]) -> str:
    """The range of a number, the length of a text."""
    if "anyOf" in row:
        return next((found for part in row["anyOf"] if (found := limits(part))), "")
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
    """What a field's description says."""
    parts = [row, *row.get("anyOf", [])]
    return next((str(part["description"]) for part in parts if "description" in part), "")


def tree() -> dict[str, Any]:
    """The schema as objects."""
    found: dict[str, Any] = json.loads(schema())
    return found


def documented(text: str) -> str:
    """TEAMS.md with fresh tables."""
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    return before + BEGIN + tables(tree()) + END + after


def main() -> None:
    """Write, or check."""
    fresh = {SCHEMA: schema(), TEAMS: documented(TEAMS.read_text())}
    stale = [path for path, text in fresh.items() if not path.exists() or path.read_text() != text]
    if "--check" in sys.argv:
        sys.exit("\n".join(f"{path} is stale: run tools/team_schema.py" for path in stale) or 0)
    for path in stale:
        path.write_text(fresh[path])


if __name__ == "__main__":
    main()
