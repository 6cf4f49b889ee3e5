"""Recordings: every chunk in an MCAP file, written before anything else sees it.

In: chunks in order of arrival. Out: a file, and the same chunks again. Owns the open file.
Unchunked MCAP, flushed to the disk once a second of arrival time: what a crash leaves behind is readable up to its last second.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import IO, Self

from mcap.exceptions import EndOfFile, McapError
from mcap.records import Channel, Message, Metadata
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, IndexType, Writer

from echostep.errors import EchostepError
from echostep.sources import Chunk

METADATA_NAME = "echostep"
FLUSH_NS = 1_000_000_000
RECORD_LIMIT = 1 << 24


class Recorder:
    """Writes chunks to a new file; raises EchostepError when the file cannot be made."""

    def __init__(self, path: Path | str, about: Mapping[str, str]) -> None:
        """`about`: what a replay needs and a reader may want to know (start, seed, plan, note), as text."""
        try:
            Path(path).parent.mkdir(parents=True, exist_ok=True)
            self._file = Path(path).open("wb")  # noqa: SIM115 (open as long as the recorder)
        except OSError as error:
            raise EchostepError(f"{path}: cannot write the recording: {error.strerror}") from error
        self._writer = Writer(
            self._file, compression=CompressionType.NONE, index_types=IndexType.NONE, use_chunking=False
        )
        self._writer.start(profile="", library="echostep")
        self._writer.add_metadata(METADATA_NAME, dict(about))
        self._channels: dict[str, int] = {}
        self._sequence = 0
        self._flushed_ns: int | None = None

    def write(self, chunk: Chunk) -> None:
        """Keep one chunk."""
        channel = self._channels.get(chunk.port) or self._register(chunk.port)
        self._writer.add_message(channel, chunk.t_arrival_ns, chunk.data, chunk.t_arrival_ns, self._sequence)
        self._sequence += 1
        if self._flushed_ns is None or chunk.t_arrival_ns - self._flushed_ns >= FLUSH_NS:
            self._flushed_ns = chunk.t_arrival_ns
            self._file.flush()
            os.fsync(self._file.fileno())

    def _register(self, port: str) -> int:
        self._channels[port] = self._writer.register_channel(f"/{port}/bytes", "application/octet-stream", schema_id=0)
        return self._channels[port]

    def close(self) -> None:
        """Finish the file."""
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()


@dataclass
class _WholeReads:
    """A file that ends with an error, not with a short read: a cut record must not pass for a whole one."""

    file: IO[bytes]

    def read(self, length: int) -> bytes:
        if not 0 <= length <= RECORD_LIMIT:
            raise EndOfFile
        found = self.file.read(length)
        if len(found) < length:
            raise EndOfFile
        return found


@dataclass
class Recording:
    """A recording on disk: `about` as it was given, and the chunks; `truncated` is set when the file ends too early."""

    path: Path
    about: dict[str, str] = field(default_factory=dict)
    truncated: bool = False
    fraction: float = 0.0  # of the file read so far

    def chunks(self) -> Iterator[Chunk]:
        """Chunks in the order in which they were recorded."""
        ports: dict[int, str] = {}
        for record in self._records():
            if isinstance(record, Channel):
                ports[record.id] = record.topic.removeprefix("/").removesuffix("/bytes")
            elif isinstance(record, Message) and record.channel_id in ports:
                yield Chunk(ports[record.channel_id], record.log_time, record.data)
        self.fraction = 1.0

    def _records(self) -> Iterator[object]:
        with self.path.open("rb") as file:
            size = max(1, os.fstat(file.fileno()).st_size)
            reader = StreamReader(_WholeReads(file), record_size_limit=RECORD_LIMIT)  # type: ignore[arg-type]
            try:
                for record in reader.records:
                    self.fraction = file.tell() / size
                    yield record
            except (McapError, struct.error, UnicodeDecodeError, MemoryError):
                self.truncated = True


def open_recording(path: Path | str) -> Recording:
    """A recording and its metadata; raises EchostepError when the file is missing or is none of ours."""
    recording = Recording(Path(path))
    try:
        for record in recording._records():
            if isinstance(record, Metadata) and record.name == METADATA_NAME:
                recording.about = dict(record.metadata)
            if isinstance(record, Message):
                return recording
    except OSError as error:
        raise EchostepError(f"{path}: cannot read the recording: {error.strerror}") from error
    raise EchostepError(f"{path}: no recorded bytes in it: is this an echostep recording (.mcap)?")
