# SPDX-License-Identifier: MIT
"""Lines for people: no letter of a name or a note does more than appear.

In: texts, among them names in plans, recordings and messages. Out: lines on standard output or standard error. Owns nothing.
"""

from __future__ import annotations

import os
import re
import secrets
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from itertools import count
from pathlib import Path

from echostep.errors import EchostepError

# Control characters [ECMA-48, C0 and C1] but the line feed and the tab; overrides of the direction [Unicode, UAX 9]; lone halves of letters
HIDDEN = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")


def shown(text: str) -> str:
    """The text with `?` for each letter that a terminal would obey instead of showing it."""
    return HIDDEN.sub("?", text)


def say(*lines: str) -> None:
    """Lines on standard output."""
    print(*map(shown, lines), sep="\n")


def complain(text: str) -> None:
    """A line on standard error."""
    print(shown(text), file=sys.stderr)


def moment(unix_s: float) -> str:
    """Unix time as RFC 3339 in UTC, to the millisecond."""
    return datetime.fromtimestamp(unix_s, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


@contextmanager
def as_error(words: str, remedy: str = "") -> Iterator[None]:
    """An OSError of the block becomes an EchostepError: these words, the system's, the remedy."""
    try:
        yield
    except OSError as error:
        raise EchostepError(f"{words}: {error.strerror or error}{remedy}") from error


@contextmanager
def faults_of(what: object, remedy: str = "") -> Iterator[None]:
    """A ValueError of the block becomes an EchostepError: what is wrong, the error's words, the remedy."""
    try:
        yield
    except ValueError as error:
        raise EchostepError(f"{what}: {error}{remedy}") from error


def put_aside(path: Path, remedy: str) -> None:
    """Rename a file of this program that an earlier run left damaged, and say so; raises EchostepError where that fails. Nothing is deleted."""
    names = (path.with_name(f"{path.name}.damaged{number or ''}") for number in count())
    aside = next(name for name in names if not os.path.lexists(name))
    with as_error(f"{path}: is damaged, and cannot be renamed"):
        path.rename(aside)
    complain(f"echostep: {path}: is damaged, as after a power failure: kept as {aside.name}; {remedy}")


def write_whole(path: Path, raw: bytes, like: Path | None = None) -> None:
    """Write a file in one step, with the rights of the old one or of `like`; whatever ends the program, one of both is there. Raises OSError."""
    path, rights = path.resolve(), like or path
    new = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    try:
        with new.open("xb") as file:
            file.write(raw)
            file.flush()
            os.fsync(file.fileno())
        if rights.exists():
            shutil.copymode(rights, new)
        new.replace(path)
    finally:
        new.unlink(missing_ok=True)
