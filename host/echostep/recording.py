"""Recordings: every chunk in an MCAP file, written before anything else sees it.

In: chunks in order of arrival. Out: a file, and the same chunks again. Owns the open file.
Unchunked MCAP, flushed to the disk once a second of arrival time: what a crash leaves behind is readable up to its last second.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from types import TracebackType
from typing import Self, TypeVar

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata
from mcap.writer import CompressionType, IndexType, Writer

from echostep.errors import EchostepError
from echostep.sources import Chunk

METADATA_NAME = "echostep"
FLUSH_NS = 1_000_000_000
RECORD_LIMIT = 1 << 24
MCAP_MAGIC = b"\x89MCAP0\r\n"
_HEAD = struct.Struct("<BQ")  # opcode, length
_MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time; the bytes follow

Record = TypeVar("Record", Channel, Metadata)


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
        for opcode, body in self._records():
            if opcode == Opcode.MESSAGE and len(body) >= _MESSAGE.size:
                channel, _, t_arrival_ns, _ = _MESSAGE.unpack_from(body)
                if channel in ports:
                    yield Chunk(ports[channel], t_arrival_ns, body[_MESSAGE.size :])
            elif opcode == Opcode.CHANNEL and (found := _parsed(Channel, body)):
                ports[found.id] = found.topic.removeprefix("/").removesuffix("/bytes")
        self.fraction = 1.0

    def _records(self) -> Iterator[tuple[int, bytes]]:
        """Opcode and body of each record up to the footer, or to where the file ends in the middle of one [MCAP specification]."""
        with self.path.open("rb") as file:
            size = max(1, os.fstat(file.fileno()).st_size)
            place = len(file.read(len(MCAP_MAGIC)))
            self.truncated = True
            while len(head := file.read(_HEAD.size)) == _HEAD.size:
                opcode, length = _HEAD.unpack(head)
                if length > RECORD_LIMIT or len(body := file.read(length)) < length:
                    return
                place += _HEAD.size + length
                self.fraction = place / size
                if opcode == Opcode.FOOTER:
                    self.truncated = False
                    return
                yield opcode, body


def _parsed(kind: type[Record], body: bytes) -> Record | None:
    """A record by the library's own reader; None when the body is damaged."""
    try:
        return kind.read(ReadDataStream(BytesIO(body)))
    except (McapError, struct.error, UnicodeDecodeError):
        return None


def open_recording(path: Path | str) -> Recording:
    """A recording and its metadata; raises EchostepError when the file is missing or is none of ours."""
    recording = Recording(Path(path))
    try:
        with recording.path.open("rb") as file:
            ours = file.read(len(MCAP_MAGIC)) == MCAP_MAGIC
        for opcode, body in recording._records() if ours else ():
            if opcode == Opcode.METADATA and (found := _parsed(Metadata, body)) and found.name == METADATA_NAME:
                recording.about = dict(found.metadata)
            if opcode == Opcode.MESSAGE:
                return recording
    except OSError as error:
        raise EchostepError(f"{path}: cannot read the recording: {error.strerror}") from error
    raise EchostepError(f"{path}: no recorded bytes in it: is this an echostep recording (.mcap)?")
