# SPDX-License-Identifier: MIT
"""Public recordings, read from a folder laid out like ../shared/data.

In: a folder, and the sets that may lie in it: the name of each, the pattern of its files, their reader. Out: recordings, and a line about each set
or file that was skipped. Owns nothing. Every file of a kind is taken, known or not.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TypeVar

from echostep.errors import EchostepError
from echostep_app.output.table import console

# The public recordings, found from the root of a checkout
DATA = Path(os.environ.get("ECHOSTEP_DATA", "../shared/data")).resolve()
Recording = TypeVar("Recording")
Sets = Sequence[tuple[str, str, Callable[[Path], Iterable[Recording]]]]


def read_sets(folder: Path, sets: Sets[Recording]) -> tuple[list[Recording], list[str]]:
    """All recordings in the folder, and a line about each set or file that was skipped."""
    recordings: list[Recording] = []
    skipped: list[str] = []
    for group, pattern, read in sets:
        paths = sorted(folder.glob(pattern))
        if not paths:
            skipped.append(f"{group}: skipped, no {pattern} in {folder}")
        for path in paths:
            try:
                recordings += read(path)
            except Exception as error:  # foreign files: a reader may raise any exception
                skipped.append(f"{group}: {path} skipped, cannot read it: {error or type(error).__name__}")
    return recordings, skipped


def recordings_in(folder: Path, sets: Sets[Recording]) -> list[Recording]:
    """The recordings of the folder; prints what is skipped; raises EchostepError without any."""
    if not folder.is_dir():
        raise EchostepError(
            f"{folder}: no such folder: say with --data where the recordings are; host/studies/README.md says where they come from"
        )
    recordings, skipped = read_sets(folder, sets)
    for line in skipped:
        console.print(line)
    if not recordings:
        raise EchostepError(f"{folder}: no recording of any known set in it")
    return recordings
