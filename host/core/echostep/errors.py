# SPDX-License-Identifier: MIT
"""The errors that end a command with one line for the user.

In: nothing. Out: `EchostepError`, `IncompleteError`; any error in words; a sentence about a use of what has left. Owns what serves instead.
"""

from __future__ import annotations

PACKED = {  # by the first bytes [file(1)]
    b"\x1f\x8b": "gzip", b"BZh": "bzip2", b"\xfd7zXZ": "xz", b"PK\x03\x04": "zip", b"(\xb5/\xfd": "zstd", b"7z\xbc\xaf": "7z",
}  # fmt: skip


class EchostepError(Exception):
    """A wrong file, port, option, setting or firmware; its text is one line that says what is wrong and what to do (exit status 2)."""


class IncompleteError(EchostepError):
    """A run is complete, but its recording lacks something (exit status 1)."""


def words_of(error: BaseException) -> str:
    """The error as a command that it ends prints it, and as the page of a run shows it."""
    if isinstance(error, OSError):
        return f"{error.filename or 'a file'}: {error.strerror or error}"
    return str(error) if isinstance(error, EchostepError) else f"{type(error).__name__}: {error}"


def replaced(begin: bytes) -> str:
    """Kind of a file that is neither table nor recording, by its first bytes, and the next step; empty for an unknown kind."""
    if begin.startswith(b"version https://git-lfs"):
        return "a pointer of Git LFS in place of the file: git lfs pull brings it"
    packed = next((name for magic, name in PACKED.items() if begin.startswith(magic)), "")
    return f"packed by {packed}: unpack it first" if packed else ""


INSTEAD: dict[str, str] = {  # of settings
    "[cloud] start_veer_sd_deg": "feet do not veer, and a robot's wheels are calibrated before its path is tracked",
    "[ranger] learn": "the range bias that both rangers have in common is learnt while tracking",
}


def has_left(use: str) -> str:
    """The sentence about a use of the table."""
    return f"{use} has left: {INSTEAD[use]}" if use in INSTEAD else ""
