# SPDX-License-Identifier: MIT
"""A recorder on a new file of this run, and one that begins a new file at a size or after a time.

In: chunks, as a `Recorder`. Out: `walk-0007-20261122T091500Z.mcap`, then `...Z-part0002.mcap` and so on: each a whole recording, with the metadata of
the run. Owns the files that are being closed.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from threading import Thread

from echostep.errors import EchostepError
from echostep.ports.chunks import Chunk
from echostep.recording.mcap_records import NEXT, PART, PART_NAME, RUN
from echostep_app.recording.background_writer import BackgroundWriter
from echostep_app.recording.names import RecordingExistsError, new_name, part_name
from echostep_app.recording.recorder import Recorder

UNITS = {"MB": 1e6, "GB": 1e9, "min": 60e9, "h": 3600e9}  # bytes, or nanoseconds
LEAST = {"MB": 1e6, "GB": 1e6, "min": 60e9, "h": 60e9}  # smaller parts are thousands of files a day; assumed
MOST_PARTS = 9999
RETRY_NS = 60_000_000_000  # between two attempts to begin a part that cannot be written; assumed


@dataclass(frozen=True, slots=True)
class SplitLimit:
    """A part ends at `size` bytes, or `span_ns` after its first chunk; 0: no such limit."""

    size: int = 0
    span_ns: int = 0


def parse_split(text: str) -> SplitLimit:
    """The limit of `--split`, as 500MB, 2GB, 30min or 1h; raises EchostepError."""
    match = re.fullmatch(r"(\d{1,6}(?:\.\d{1,6})?) ?(MB|GB|min|h)", text.strip())
    value = float(match[1]) * UNITS[match[2]] if match else 0.0
    if match is None or value < LEAST[match[2]]:
        raise EchostepError(
            f"--split {text[:40]}: expected a size or a time, from 1MB or 1min on: 500MB, 2GB, 30min, 1h"
        )
    return SplitLimit(size=round(value)) if match[2] in ("MB", "GB") else SplitLimit(span_ns=round(value))


class SplitRecorder(Recorder):
    """A recorder in parts. A part that cannot be begun is reported, and the one before goes on."""

    def __init__(self, path: Path, metadata: Mapping[str, str], limit: SplitLimit) -> None:
        self._first, self._limit, self._part = path, limit, 1
        self._run_metadata = {**metadata, RUN: path.stem}
        self._begin_ns: int | None = None  # arrival of the part's first chunk
        self._retry_ns = 0
        self._closing: list[tuple[BackgroundWriter, Thread]] = []
        super().__init__(path, {**self._run_metadata, PART: "1"})

    @property
    def is_whole(self) -> bool:
        """The same for all parts."""
        return super().is_whole and all(file.is_whole for file, _ in self._closing)

    @property
    def notices(self) -> deque[str]:
        """Messages about the disk, of all parts; the caller prints and clears them."""
        for file, _ in self._closing:
            while file.notices:
                self._file.notices.append(file.notices.popleft())
        return self._file.notices

    def write(self, chunk: Chunk) -> None:
        """Record one chunk, in a new part where this one is full; never waits for the disk."""
        if self._begin_ns is None:
            self._begin_ns = chunk.t_arrival_ns
        size, span_ns = self._limit.size, self._limit.span_ns
        full = (size and self.offset >= size) or (span_ns and chunk.t_arrival_ns - self._begin_ns >= span_ns)
        if full and chunk.t_arrival_ns >= self._retry_ns and self._part < MOST_PARTS:
            self._begin_part(chunk.t_arrival_ns)
        super().write(chunk)

    def _begin_part(self, t_ns: int) -> None:
        path = part_name(self._first, self._part + 1)
        try:
            file = BackgroundWriter(path)
        except EchostepError as error:
            self._retry_ns = t_ns + RETRY_NS
            self.notices.append(f"{error}; the recording goes on in {self.path.name}")
            return
        self._add_metadata(PART_NAME, {NEXT: path.name})
        self._writer.finish()  # type: ignore[no-untyped-call]
        thread = Thread(target=self._file.close, name="recording part", daemon=True)
        thread.start()
        self._closing.append((self._file, thread))
        self._part += 1
        self._begin_ns = t_ns
        self._begin(file, {**self._run_metadata, PART: str(self._part)})

    def close(self) -> None:
        """Close all parts."""
        super().close()
        for _, thread in self._closing:
            thread.join()


TRIES = 10  # of a new name, while other processes take the same one; assumed


def numbered_recorder(wanted: Path, metadata: Mapping[str, str], split: SplitLimit | None = None) -> Recorder:
    """A recorder on a new file named after `wanted`, in parts by `split`; raises EchostepError."""
    for _ in range(TRIES - 1):
        try:
            return _recorder(new_name(wanted), metadata, split)
        except RecordingExistsError:
            continue
    return _recorder(new_name(wanted), metadata, split)


def _recorder(path: Path, metadata: Mapping[str, str], split: SplitLimit | None) -> Recorder:
    return SplitRecorder(path, metadata, split) if split else Recorder(path, metadata)
