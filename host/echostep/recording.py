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

from mcap.exceptions import McapError
from mcap.records import Channel, Message, Metadata
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, IndexType, Writer

from echostep.errors import EchostepError
from echostep.sources import Chunk

METADATA_NAME = "echostep"
FLUSH_NS = 1_000_000_000
RECORD_LIMIT = 1 << 24
MAGIC_SIZE = 8


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
            self._file, compression=CompressionType.NONE, index_types=IndexType.ALL, use_chunking=False
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
            size = os.fstat(file.fileno()).st_size
            reader = StreamReader(file, record_size_limit=RECORD_LIMIT)
            start = 0
            try:
                for record in reader.records:
                    end = file.tell()
                    if end >= size and not _whole(file, start, size):
                        break
                    self.fraction = end / size
                    yield record
                    start = end
                else:
                    return
            except (McapError, struct.error, UnicodeDecodeError, MemoryError, OverflowError):
                pass
            self.truncated = True


def _whole(file: IO[bytes], start: int, size: int) -> bool:
    """Whether the record at `start` ends within the file: the library takes what is left for a whole record."""
    file.seek(max(start, MAGIC_SIZE) + 1)
    length = int.from_bytes(file.read(8), "little")
    file.seek(size)
    return max(start, MAGIC_SIZE) + 9 + length <= size


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
