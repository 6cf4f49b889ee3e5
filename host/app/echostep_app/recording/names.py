# SPDX-License-Identifier: MIT
"""Names of recordings: each run gets a new one, and no file is ever replaced.

In: the name asked for, as `out/live/walk.mcap`. Out: a new file, as `out/live/walk-0007-20261122T091500Z.mcap`: number of the run, time of day (UTC).
`walk.mcap` becomes a second name (hard link) of the newest, unless a file without another name has it. Owns nothing.
"""

from __future__ import annotations

import glob
import os
import re
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

from echostep.errors import EchostepError
from echostep.file_mode import file_mode
from echostep.recording import SUFFIX, is_being_written
from echostep_app.printing.lines import as_error

try:
    import fcntl
except ImportError:  # Windows: there an open file cannot be removed
    fcntl = None  # type: ignore[assignment]

PART_SIGN = "-part"  # between the name of a run's first file and the number of a later one
LEAST_KEPT = 2  # of `remove_older`: the run's own recording and the one before


class RecordingExistsError(EchostepError):
    """The file exists; it is not overwritten."""


def create(path: Path) -> int:
    """A new file, open for writing and locked for this process; raises EchostepError when it cannot be made, or exists."""
    if os.path.lexists(path):
        raise RecordingExistsError(f"{path}: exists, and is not overwritten: give another name")
    with as_error(f"{path}: cannot write"):
        path.parent.mkdir(parents=True, exist_ok=True)
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), file_mode())
    with suppress(OSError):  # a file system without locks
        if fcntl is not None:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    _sync_folder(path.parent)
    return file


def _sync_folder(folder: Path) -> None:
    """Bring the names in a folder to the disk, where the operating system has such a call."""
    with suppress(OSError):
        opened = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(opened)
        finally:
            os.close(opened)


def new_name(wanted: Path) -> Path:
    """The name of this run's recording; raises EchostepError when `wanted` is not the name of a recording."""
    if wanted.suffix != SUFFIX:
        raise EchostepError(f"{wanted}: the name of a recording ends in {SUFFIX}: give another one with --out")
    number = 1 + max((number for number, _ in _numbered(wanted)), default=0)
    return wanted.with_stem(f"{wanted.stem}-{number:04}-{datetime.now(UTC):%Y%m%dT%H%M%SZ}")


def part_name(first: Path, number: int) -> Path:
    """The name of a later part of the run whose first file this is."""
    return first.with_stem(f"{first.stem}{PART_SIGN}{number:04}")


def files_of(recording: Path) -> list[Path]:
    """The files of a run in their order, given any of them."""
    first = recording.with_stem(re.sub(rf"{PART_SIGN}\d{{4}}$", "", recording.stem))
    return [first, *sorted(first.parent.glob(f"{glob.escape(first.stem)}{PART_SIGN}[0-9][0-9][0-9][0-9]{SUFFIX}"))]


def link_newest(newest: Path, wanted: Path) -> bool:
    """Make `wanted` a second name of the newest recording; False: a file without another name has it, or links are not possible there."""
    try:
        if os.path.lexists(wanted) and wanted.lstat().st_nlink == 1:
            return False
        link = newest.with_suffix(".link")
        os.link(newest, link)
        try:
            link.replace(wanted)
        finally:
            link.unlink(missing_ok=True)
    except OSError:
        return False
    return True


def remove_older(wanted: Path, keep: int) -> list[Path]:
    """Remove the oldest recordings of this name until `keep` are left, at least `LEAST_KEPT`; not one that is being written. Returns them."""
    removed = []
    for _, path in sorted(_numbered(wanted))[: -max(keep, LEAST_KEPT)]:
        with suppress(OSError):
            if not is_being_written(path):
                for file in files_of(path):
                    file.unlink()
                    removed.append(file)
    return removed


def _numbered(wanted: Path) -> list[tuple[int, Path]]:
    """Recordings of earlier runs under this name, with their numbers."""
    pattern = re.compile(re.escape(wanted.stem) + r"-(\d{4,9})-\d{8}T\d{6}Z" + re.escape(SUFFIX))
    try:
        paths = list(wanted.parent.iterdir())
    except OSError:
        return []
    return [(int(match[1]), path) for path in paths if (match := pattern.fullmatch(path.name))]
