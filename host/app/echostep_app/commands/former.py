# SPDX-License-Identifier: MIT
"""Command lines with removed commands or options: answered by the table `echostep.errors.INSTEAD`.

In: the words of a command line. Out: a sentence; empty for a command line of today. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

from echostep.errors import INSTEAD, has_left


def former_use(words: Sequence[str]) -> str:
    """The sentence about the first former use in the words of a command line, without the program's name; empty where there is none."""
    given = (word.replace("=", " ", 1) if word.startswith("--") else word for word in words if word != "--share")
    line = f" {' '.join(given)} "
    return next((has_left(use) for use in INSTEAD if _is_used(use, line)), "")


def _is_used(use: str, line: str) -> bool:
    if use.endswith((":", "/")):
        return f" {use}" in line
    command, _, option = use.partition(" --")
    return line.startswith(f" {command} ") and (not option or f" --{option} " in line)
