# SPDX-License-Identifier: MIT
"""Command lines that no command takes: with removed commands or options, answered by the table `echostep.errors.INSTEAD`; with a pipe as a file.

In: the words of a command line. Out: a sentence; empty for a command line of today. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from echostep.errors import INSTEAD, has_left


def former_use(words: Sequence[str]) -> str:
    """The sentence about the first former use in the words of a command line, without the program's name; empty where there is none."""
    given = (word.replace("=", " ", 1) if word.startswith("--") else word for word in words if word != "--share")
    line = f" {' '.join(given)} "
    return next((has_left(use) for use in INSTEAD if _is_used(use, line)), "")


def piped(words: Sequence[str]) -> str:
    """The sentence about the first pipe in place of a file, which commands read several times; empty where there is none."""
    with suppress(OSError):  # a word that can be no name of a file
        if pipe := next((word for word in words if word == "-" or Path(word).is_fifo()), ""):
            return f"{pipe}: a pipe cannot be read twice: write it to a file, and give that"
    return ""


def _is_used(use: str, line: str) -> bool:
    if use.endswith((":", "/")):
        return f" {use}" in line
    command, _, option = use.partition(" --")
    return line.startswith(f" {command} ") and (not option or f" --{option} " in line)
