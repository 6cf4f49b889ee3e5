# SPDX-License-Identifier: MIT
"""The pages of host/docs that are made from the code: one module a page.

In: the installed package. Out: the text of each page. Owns nothing: `docs.generate` writes and compares.
"""

from typing import Any

from places import ROOT

HOST = ROOT / "host"
DOCS = HOST / "docs"
MADE = "Made by `make docs` from the code: do not edit.\n"
BEGIN, END = "<!-- made by make docs -->\n", "<!-- end -->\n"  # around the part of a page that is made


def between_marks(text: str, made: str) -> str:
    """A page with the part between its marks replaced."""
    before, _, rest = text.partition(BEGIN)
    return before + BEGIN + made + END + rest.partition(END)[2]


def kind(node: dict[str, Any]) -> str:
    """The type that a JSON Schema gives a field, in words."""
    if "$ref" in node:
        return str(node["$ref"].rpartition("/")[2])
    if "enum" in node or "const" in node:
        return ", ".join(f"`{value}`" for value in node.get("enum", [node.get("const")]))
    if several := node.get("oneOf", node.get("anyOf")):
        return " or ".join(map(kind, several))
    if isinstance(node["type"], list):
        return " or ".join(node["type"])
    if isinstance(node.get("items"), dict):
        return f"list of {kind(node['items'])}"
    return str({"array": "list"}.get(node["type"], node["type"]))
