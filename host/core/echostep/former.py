# SPDX-License-Identifier: MIT
"""What has left, and what serves instead: one table for commands, options, settings and addresses.

In: the words of a command line, or a setting's name. Out: one sentence that names the substitute; empty for what never left. Owns the table.
"""

from __future__ import annotations

from collections.abc import Sequence

# A command (`acceptance`), its option (`map --plan`), a setting (`[ranger] learn`), the begin of an address in any command (`mesh://`)
INSTEAD: dict[str, str] = {}


def has_left(use: str) -> str:
    """The sentence about a use of the table."""
    return f"{use} has left: {INSTEAD[use]}" if use in INSTEAD else ""


def former_use(words: Sequence[str]) -> str:
    """The sentence about the first former use in the words of a command line, without the program's name."""
    given = [word for word in words if word != "--share"]
    return next((has_left(use) for use in INSTEAD if _is_used(use, given)), "")


def _is_used(use: str, words: list[str]) -> bool:
    *command, last = use.split()
    if words[: len(command)] != command:
        return False
    rest = words[len(command) :]
    if last.startswith("-"):
        return any(word.partition("=")[0] == last for word in rest)
    if last.endswith((":", "/")):
        return any(word.startswith(last) or f"={last}" in word for word in rest)
    return rest[:1] == [last]
