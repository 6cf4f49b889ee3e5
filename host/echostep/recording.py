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

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata
from mcap.writer import CompressionType, IndexType, Writer
from numba import njit
from numpy.typing import NDArray

from echostep.errors import EchostepError
from echostep.sources import LATEST_NS, Chunk, Portion

Ints = NDArray[np.int64]
Octets = NDArray[np.uint8]

METADATA_NAME = "echostep"
FLUSH_NS = 1_000_000_000
PIECE = 1 << 18  # bytes of a file that are read at once: about five seconds of a walk
RECORD_LIMIT = 1 << 24
MCAP_MAGIC = b"\x89MCAP0\r\n"
_HEAD = struct.Struct("<BQ")  # opcode, length
HEAD_SIZE = 9
MESSAGE = 0x05  # its opcode
MESSAGE_SIZE = 22  # channel u16, sequence u32, log time u64, publish time u64; the bytes follow

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
        for portion in self.portions():
            yield from portion.chunks()

    def portions(self) -> Iterator[Portion]:
        """The same, many at a time."""
        for read in self._records():
            if isinstance(read, Portion):
                yield read
        self.fraction = 1.0

    def _records(self) -> Iterator[Portion | tuple[int, bytes]]:
        """Messages by the portion, other records as opcode and body, in order, up to the footer or to where the file ends too early."""
        ports = _Ports()
        with self.path.open("rb") as file:
            size = max(1, os.fstat(file.fileno()).st_size)
            place = len(file.read(len(MCAP_MAGIC)))
            self.truncated = True
            rest, missing = b"", 0
            while missing <= RECORD_LIMIT and (more := file.read(max(PIECE, missing))):
                buffer, at = rest + more, 0
                while True:
                    portion, at = _messages(buffer, at, ports)
                    self.fraction = (place + at) / size
                    if portion:
                        yield portion
                    record, missing = _record(buffer, at)
                    if record is None:
                        break
                    if record[0] == Opcode.FOOTER:
                        self.truncated = False
                        return
                    if record[0] == Opcode.CHANNEL:
                        ports.add(record[1])
                    yield record
                    at += HEAD_SIZE + len(record[1])
                place, rest = place + at, buffer[at:]


@dataclass
class _Ports:
    """The ports of the channels seen so far: their names, and by channel id the place among the names, -1: no such channel."""

    names: tuple[str, ...] = ()
    of_channel: Ints = field(default_factory=lambda: np.full(1 << 16, -1, np.int64))

    def add(self, body: bytes) -> None:
        """Take a channel record into account, if it is one."""
        if found := _parsed(Channel, body):
            name = found.topic.removeprefix("/").removesuffix("/bytes")
            self.names = tuple(dict.fromkeys((*self.names, name)))
            self.of_channel[found.id] = self.names.index(name)


def _record(buffer: bytes, at: int) -> tuple[tuple[int, bytes] | None, int]:
    """Opcode and body of the record at `at`, or None and how many bytes are missing."""
    if len(buffer) - at < HEAD_SIZE:
        return None, at + HEAD_SIZE - len(buffer)
    opcode, length = _HEAD.unpack_from(buffer, at)
    body = buffer[at + HEAD_SIZE : at + HEAD_SIZE + length]
    return ((opcode, body), 0) if len(body) == length else (None, length - len(body))


def _messages(buffer: bytes, at: int, ports: _Ports) -> tuple[Portion | None, int]:
    """The unbroken run of complete messages from `at` on, if there is any, and where it ends."""
    most = (len(buffer) - at) // (HEAD_SIZE + MESSAGE_SIZE)
    port, t_arrival_ns, start, end = (np.empty(most, np.int64) for _ in range(4))
    found, at = _sweep(np.frombuffer(buffer, np.uint8), at, ports.of_channel, port, t_arrival_ns, start, end)
    portion = Portion(ports.names, port[:found], t_arrival_ns[:found], start[:found], end[:found], buffer)
    return (portion if found else None), at


@njit(cache=True, error_model="numpy")
def _sweep(
    buffer: Octets, at: int, port_of: Ints, port: Ints, t_arrival_ns: Ints, start: Ints, end: Ints
) -> tuple[int, int]:
    """Fill the columns from message records of known channels; returns how many there were, and where another record or the end came."""
    found = 0
    while at + HEAD_SIZE <= len(buffer) and buffer[at] == MESSAGE:
        length = _number(buffer, at + 1, 8)
        body = at + HEAD_SIZE
        if not 0 <= length <= len(buffer) - body:
            break
        at = body + length
        if length >= MESSAGE_SIZE and port_of[_number(buffer, body, 2)] >= 0:
            port[found] = port_of[_number(buffer, body, 2)]
            log_time_ns = _number(buffer, body + 6, 8)
            t_arrival_ns[found] = log_time_ns if 0 <= log_time_ns <= LATEST_NS else LATEST_NS
            start[found], end[found] = body + MESSAGE_SIZE, at
            found += 1
    return found, at


@njit(cache=True, error_model="numpy")
def _number(buffer: Octets, at: int, size: int) -> int:
    """A little-endian number; from 2^63 on negative."""
    value = 0
    for k in range(size):
        value |= (buffer[at + k] & 0xFF) << 8 * k
    return value


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
        for read in recording._records() if ours else ():
            if isinstance(read, Portion):
                return recording
            opcode, body = read
            if opcode == Opcode.METADATA and (found := _parsed(Metadata, body)) and found.name == METADATA_NAME:
                recording.about = dict(found.metadata)
    except OSError as error:
        raise EchostepError(f"{path}: cannot read the recording: {error.strerror}") from error
    raise EchostepError(f"{path}: no recorded bytes in it: is this an echostep recording (.mcap)?")
