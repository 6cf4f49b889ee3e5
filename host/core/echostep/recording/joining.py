# SPDX-License-Identifier: MIT
"""The parts of a run as one recording.

In: files, folders and patterns. Out: a `Recording` of all parts in order; parts missing between them are reported as damage. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

from echostep.errors import EchostepError
from echostep.file_mode import SUFFIX
from echostep.ports.chunks import Portion
from echostep.recording.mcap_records import PART, RUN
from echostep.recording.reading import Recording, open_recording

START = ("start_x_y_rad", "start")  # metadata keys of the place where the run began


@dataclass
class JoinedRecording(Recording):
    """The parts of one run, in order; `path` is the first."""

    parts: list[Recording] = field(default_factory=list)

    def portions(self) -> Iterator[Portion]:
        """The portions of all parts."""
        for k, part in enumerate(self.parts):
            for portion in part.portions():
                self.fraction = (k + part.fraction) / len(self.parts)
                yield portion
        self.fraction = 1.0

    def to_repair(self) -> list[Path]:
        """The damaged parts."""
        return [path for part in self.parts for path in part.to_repair()]

    def damage(self) -> list[str]:
        """Damage of each part, and missing parts."""
        return [*(f"{part.path.name}: {line}" for part in self.parts for line in part.damage()), *self._missing()]

    def damage_notes(self) -> list[str]:
        """The same, to be noted in a recording made from this one."""
        return [*(line for part in self.parts for line in part.damage_notes()), *self._missing()]

    def _missing(self) -> list[str]:
        """A sentence for each gap in the numbers of the parts, and for a last part that another one follows."""
        numbers = [0, *map(number_of, self.parts)]
        lines = [
            (f"parts {a + 1} to {b - 1} of the run are" if b - a > 2 else f"part {a + 1} of the run is")
            + " missing: nothing of that time was used"
            for a, b in pairwise(numbers)
            if b - a > 1
        ]
        last = self.parts[-1]
        return [*lines, *([f"the run goes on in {last.goes_on_in}, which was not given"] if last.goes_on_in else [])]


def number_of(part: Recording) -> int:
    """The number of a part, 1 if its metadata have no possible one."""
    text = part.metadata.get(PART, "1")
    return int(text) if text.isascii() and text.isdigit() and 1 <= len(text) <= 4 and int(text) else 1


def open_parts(paths: Sequence[Path]) -> Recording:
    """The recording in these files, or in the files of these folders and patterns; raises EchostepError for parts of several runs."""
    recordings = [open_recording(path) for path in _files(paths)]
    first = recordings[0]
    if len(recordings) == 1 and RUN not in first.metadata:
        return first
    for other in recordings:
        if RUN not in other.metadata or other.metadata[RUN] != first.metadata.get(RUN):
            raise EchostepError(
                f"{other.path}: not a part of the run of {first.path.name}: give the parts of one run, which live --split has written"
            )
    recordings.sort(key=number_of)
    for before, after in pairwise(recordings):
        if number_of(before) == number_of(after):
            raise EchostepError(
                f"{before.path} and {after.path}: both are part {number_of(after)} of the run: give one"
            )
    first = recordings[0]
    metadata = dict(first.metadata)
    if number_of(first) > 1:  # where it begins was not recorded
        metadata = {key: value for key, value in metadata.items() if key not in START} | {START[0]: "unknown"}
    return JoinedRecording(first.path, metadata, parts=recordings)


def _files(paths: Sequence[Path]) -> list[Path]:
    """The files; of two names of one file the first by name."""
    found: dict[tuple[int, int], Path] = {}
    for path in paths:
        inside = sorted(path.glob(f"*{SUFFIX}"), key=lambda p: (-len(p.name), p.name)) if path.is_dir() else [path]
        if not path.exists() and any(letter in str(path) for letter in "*?["):
            inside = sorted(Path(path.anchor or ".").glob(str(path.relative_to(path.anchor))))
        if not inside:
            raise EchostepError(f"{path}: no recording ({SUFFIX}) there")
        for file in inside:
            try:
                status = file.stat()
            except OSError as error:
                raise EchostepError(f"{file}: cannot read the recording: {error.strerror}") from error
            found.setdefault((status.st_dev, status.st_ino), file)
    return list(found.values())
