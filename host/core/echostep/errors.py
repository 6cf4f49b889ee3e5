# SPDX-License-Identifier: MIT
"""The errors that end a command with one line for the user.

In: nothing. Out: `EchostepError`, `IncompleteError`; any error in words; a sentence about a use of what has left. Owns what serves instead.
"""

from __future__ import annotations

from errno import EMFILE, ENFILE

PACKED = {  # by the first bytes [file(1)]
    b"\x1f\x8b": "gzip", b"BZh": "bzip2", b"\xfd7zXZ": "xz", b"PK\x03\x04": "zip", b"(\xb5/\xfd": "zstd", b"7z\xbc\xaf": "7z",
}  # fmt: skip


class EchostepError(Exception):
    """A wrong file, port, option, setting or firmware; its text is one line that says what is wrong and what to do (exit status 2)."""


class IncompleteError(EchostepError):
    """A run is complete, but its recording lacks something (exit status 1)."""


def words_of(error: BaseException) -> str:
    """The error as a command that it ends prints it, and as the page of a run shows it."""
    if isinstance(error, OSError) and error.errno in (EMFILE, ENFILE):
        return f"{error.strerror}: end what has them open, or allow more (ulimit -n 1024)"
    if isinstance(error, OSError):
        return f"{error.filename or 'a file'}: {error.strerror or error}"
    return str(error) if isinstance(error, EchostepError) else f"{type(error).__name__}: {error}"


def replaced(begin: bytes) -> str:
    """Kind of a file that is neither table nor recording, by its first bytes, and the next step; empty for an unknown kind."""
    if begin.startswith(b"version https://git-lfs"):
        return "a pointer of Git LFS in place of the file: git lfs pull brings it"
    packed = next((name for magic, name in PACKED.items() if begin.startswith(magic)), "")
    return f"packed by {packed}: unpack it first" if packed else ""


LEARNT_BIAS = "the range bias that both rangers have in common is learnt while tracking"
# A command (`acceptance`), its option (`map --plan`), a setting (`[ranger] learn`), the begin of an address in any command (`mesh://`),
# an option with such a value (`--plan wearer:`)
INSTEAD: dict[str, str] = {
    "acceptance": "live records a walk with the places that are tapped on its page, and score WALK.mcap --taps compares it with them",
    "calibrate --mtx": LEARNT_BIAS,
    "calibrate --plan": LEARNT_BIAS,
    "calibrate rangers": LEARNT_BIAS,
    "[cloud] start_veer_sd_deg": "feet do not veer, and a robot's wheels are calibrated before its path is tracked",
    "--guide wearer:": "Send NAME on the commander's page leads a rescuer there, and X,Y[,LEVEL] to a place",
    "evaluate gaits": "evaluate legs has its rows: --rows 'foot/*' and 'legs/*'",
    "evaluate lee2010": "evaluate legs has its rows: --rows 'lap/*', 'storeys*' and floors",
    "evaluate trails": "evaluate noplan has its rows: --rows 'trail/*'",
    "[ranger] learn": LEARNT_BIAS,
    "map --plan": "a walk is drawn by itself; echostep plan edit mends a plan",
    "--plan wearer:": "echostep map WALK.mcap -o plan.json draws that wearer's recording, and --plan plan.json takes it",
    "mesh://": "reports go by IP to the team's broker (mqtt://HOST); what a Meshtastic radio's own uplink brings there: docs/teams.md, Off grid",
    "score --setup": "a time that is given is not measured: note it beside the scores",
    "score --html": "score prints the numbers, and evo draws the track that export writes as .tum",
}


def has_left(use: str) -> str:
    """The sentence about a use of the table."""
    return f"{use} has left: {INSTEAD[use]}" if use in INSTEAD else ""
