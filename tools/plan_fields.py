"""host/PLAN.md: every field of plan.json, out of the schema.

In: host/echostep/plans/plan.schema.json. Out: the page, printed or written. `--check` compares and says what to do.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

HOST = Path(__file__).parents[1] / "host"
SCHEMA = HOST / "echostep/plans/plan.schema.json"
PAGE = HOST / "PLAN.md"
HEAD = """# plan.json, field by field
Made from [plan.schema.json](echostep/plans/plan.schema.json) by `tools/plan_fields.py`; do not edit. {description}
Metres lie within 100 km of the origin. Fields that are not listed are ignored. `echostep plan check` tells what the schema cannot.

| field | type | needed | meaning |
|---|---|---|---|
"""
TYPES = """

| type | meaning |
|---|---|
"""


def page() -> str:
    """The whole page."""
    schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
    rows = [
        f"| `{name}` | {kind} | {'yes' if needed else ''} | {meaning} |"
        for name, kind, needed, meaning in fields(schema, schema, "")
    ]
    types = [f"| {name} | {node['description']} |" for name, node in schema["$defs"].items()]
    return HEAD.format(description=schema["description"]) + "\n".join(rows) + TYPES + "\n".join(types) + "\n"


def fields(schema: dict[str, Any], node: dict[str, Any], path: str) -> Iterator[tuple[str, str, bool, str]]:
    """Name, type, need and meaning of each field below a node."""
    for name, field in node.get("properties", {}).items():
        full = f"{path}{name}"
        whole = resolved(schema, field)
        yield (
            full,
            kind(schema, field),
            name in node.get("required", []),
            field.get("description") or whole.get("description", ""),
        )
        yield from fields(schema, whole, f"{full}.")
        if "items" in whole and isinstance(whole["items"], dict):
            yield from fields(schema, resolved(schema, whole["items"]), f"{full}[].")


def resolved(schema: dict[str, Any], node: dict[str, Any]) -> dict[str, Any]:
    """The definition that a reference means."""
    return schema["$defs"][node["$ref"].rsplit("/", 1)[1]] if "$ref" in node else node


def kind(schema: dict[str, Any], node: dict[str, Any]) -> str:
    """The type in words."""
    if "$ref" in node:
        return str(node["$ref"].rsplit("/", 1)[1])
    if "enum" in node:
        return ", ".join(node["enum"])
    if "const" in node:
        return str(node["const"])
    if "oneOf" in node:
        return " or ".join(kind(schema, one) for one in node["oneOf"] if one.get("type") != "null")
    found = node["type"] if isinstance(node["type"], str) else next(one for one in node["type"] if one != "null")
    if found == "array" and isinstance(node.get("items"), dict):
        return f"list of {kind(schema, node['items'])}"
    return {"object": "object", "array": "list"}.get(found, found)


def main() -> int:
    """Write the page, or check it."""
    if "--check" not in sys.argv:
        PAGE.write_text(page(), encoding="utf-8")
        return 0
    if PAGE.read_text(encoding="utf-8") == page():
        return 0
    print(f"{PAGE} is not what {SCHEMA} says: run tools/plan_fields.py", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
