# SPDX-License-Identifier: MIT
"""host/docs/plan.md: its table of every field of plan.json, from the schema.

In: host/core/echostep/plans/plan.schema.json. Out: the page with its tables regenerated. Owns nothing.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from docs.pages import DOCS, HOST, between_marks, kind

SCHEMA = HOST / "core/echostep/plans/plan.schema.json"
FIELDS = "| field | type | needed | meaning |\n|---|---|---|---|\n"
TYPES = "\n| type | meaning |\n|---|---|\n"


def page() -> str:
    """The page with its tables regenerated."""
    schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
    rows = [
        f"| `{name}` | {kind} | {'yes' if needed else ''} | {meaning} |\n"
        for name, kind, needed, meaning in fields(schema, schema, "")
    ]
    types = [f"| {name} | {node['description']} |\n" for name, node in schema["$defs"].items()]
    return between_marks((DOCS / "plan.md").read_text(), FIELDS + "".join(rows) + TYPES + "".join(types))


def fields(schema: dict[str, Any], node: dict[str, Any], path: str) -> Iterator[tuple[str, str, bool, str]]:
    """Name, type, need and meaning of each field below a node."""
    for name, field in node.get("properties", {}).items():
        full = f"{path}{name}"
        whole = resolved(schema, field)
        yield (
            full,
            kind(field),
            name in node.get("required", []),
            field.get("description") or whole.get("description", ""),
        )
        yield from fields(schema, whole, f"{full}.")
        if "items" in whole and isinstance(whole["items"], dict):
            yield from fields(schema, resolved(schema, whole["items"]), f"{full}[].")


def resolved(schema: dict[str, Any], node: dict[str, Any]) -> dict[str, Any]:
    """The definition that a reference means."""
    return schema["$defs"][node["$ref"].rsplit("/", 1)[1]] if "$ref" in node else node
