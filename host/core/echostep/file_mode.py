# SPDX-License-Identifier: MIT
"""Files of a run: readable by its user alone, unless `--share` was given; whether one is being written.

In: a path; a table. Out: a file of mode 0600 there; whether a process has locked it, as the recorder does. Owns the answer to `--share`.

A recording shows where a person was, second by second. The process's umask stays as it is: compiled kernels, which other users of an installation
read, are written meanwhile.
"""

from __future__ import annotations

import csv
import os
from collections.abc import Iterable, Sequence
from itertools import chain, count
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows: there an open file cannot be removed
    fcntl = None  # type: ignore[assignment]

SUFFIX = ".mcap"  # of a recording
PRIVATE, SHARED = 0o600, 0o666  # of a new file; the umask may take away more
_share: list[bool] = []  # not empty: `--share`


def share_files(*, wanted: bool) -> None:
    """New files may be read by others, as the umask allows, or not."""
    _share[:] = [True] * wanted


def file_mode() -> int:
    """The mode of a new file."""
    return SHARED if _share else PRIVATE


def claim(path: Path) -> Path:
    """Make an empty file, so that its mode is right before it has content; one that had the name is kept (`keep_earlier`). Returns the path."""
    keep_earlier(path)
    os.close(os.open(path, os.O_WRONLY | os.O_CREAT, file_mode()))
    return path


def keep_earlier(path: Path) -> Path:
    """Rename the file with content that has this name, as `track-0001.csv`: no result is overwritten. Returns the path. Raises OSError."""
    if path.is_file() and path.stat().st_size:
        names = (path.with_stem(f"{path.stem}-{number:04}") for number in count(1))
        path.rename(next(name for name in names if not os.path.lexists(name)))
    return path


def write_csv(path: Path, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write the names of the columns, then the rows, into a file that is claimed. Raises OSError."""
    with claim(path).open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows(chain([columns], rows))


def is_being_written(path: Path) -> bool:
    """Whether a process has locked the file."""
    if fcntl is None:
        return False
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        except OSError:  # a file system without locks
            return False
    return False
