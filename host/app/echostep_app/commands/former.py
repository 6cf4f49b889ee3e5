# SPDX-License-Identifier: MIT
"""Command lines with removed commands or options: answered by the table `echostep.errors.INSTEAD`.

In: the words of a command line. Out: a sentence; empty for a command line of today. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from echostep.errors import INSTEAD, has_left


def former_use(words: Sequence[str]) -> str:
    """The sentence about the first former use in the words of a command line, without the program's name; empty where there is none."""
    given = [word for word in words if word != "--share"]
    return next((has_left(use) for use in INSTEAD if _is_used(use, given)), "")


def _is_used(use: str, words: list[str]) -> bool:
    *command, last = use.split()
    if command and command[0].startswith("-"):
        given = [*pairwise(words), *(word.partition("=")[::2] for word in words)]
        return any(option == command[0] and value.startswith(last) for option, value in given)
    if words[: len(command)] != command:
        return False
    rest = words[len(command) :]
    if last.startswith("-"):
        return any(word.partition("=")[0] == last for word in rest)
    if last.endswith((":", "/")):
        return any(word.startswith(last) or f"={last}" in word for word in rest)
    return rest[:1] == [last]
