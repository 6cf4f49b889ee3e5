"""Recordings: every chunk in an MCAP file, on its way to the disk before anything else sees it.

In: chunks in order of arrival, and what was derived from them. Out: a file, and the same chunks again. Owns the open file.
Unchunked MCAP, written by a thread of its own (`spool`): what a crash leaves behind is readable up to its last moment, and no disk slows the tracker.
"""

from __future__ import annotations

import json
import os
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from mcap.opcode import Opcode
from mcap.records import Metadata
from mcap.writer import CompressionType, IndexType, Writer

from echostep.errors import EchostepError
from echostep.ports.chunks import Chunk, Portion
from echostep.recording.background_writer import Spool
from echostep.recording.mcap_records import (
    HEAD_SIZE,
    MCAP_MAGIC,
    RAW_ENCODING,
    RECORD_LIMIT,
    Ports,
    inside_of,
    messages,
    opened,
    parsed,
    record_at,
)

METADATA_NAME = "echostep"
SETTLE_NS = 500_000_000
PIECE = 1 << 18  # bytes of a file that are read at once: about five seconds of a walk
RAW_LIMIT = 1 << 26  # bytes that wait for a full disk: an hour and a half
DERIVED_LIMIT = 1 << 20


@dataclass(frozen=True, slots=True)
class Topic:
    """A channel of derived messages: JSON objects of a JSON Schema (`schema`, as text) with a name that viewers know."""

    name: str
    schema_name: str
    schema: str


@dataclass(frozen=True, slots=True)
class Note:
    """One derived message; `t_ns` on the clock of the arrivals."""

    topic: Topic
    t_ns: int
    body: Mapping[str, Any]


class Recorder:
    """Writes chunks to a new file; raises EchostepError when the file cannot be made."""

    def __init__(self, path: Path | str, about: Mapping[str, str]) -> None:
        """`about`: what a replay needs and a reader may want to know (start, seed, plan, note), as text."""
        self._spool = Spool(path)
        self._writer = Writer(
            self._spool,  # type: ignore[arg-type]  # it writes and tells, no more is asked
            compression=CompressionType.NONE,
            index_types=IndexType.ALL,
            use_chunking=False,
            enable_data_crcs=True,
        )
        self._writer.start(profile="", library="echostep")
        self._writer.add_metadata(METADATA_NAME, dict(about))
        self._channels: dict[str, int] = {}
        self._sequence = 0
        self._settled_ns: int | None = None
        self.lost = 0  # chunks, after the disk had been full for long
        self.skipped = 0  # derived messages, while it was

    @property
    def notices(self) -> deque[str]:
        """What happened to the disk, in words; for the caller to tell and to clear."""
        return self._spool.notices

    def write(self, chunk: Chunk) -> None:
        """Keep one chunk; never waits for the disk."""
        if self._spool.behind > RAW_LIMIT:
            self.lost += 1
            return
        channel = self._channels.get(chunk.port) or self._register(chunk.port)
        self._writer.add_message(channel, chunk.t_arrival_ns, chunk.data, chunk.t_arrival_ns, self._sequence)
        self._sequence += 1

    def settle(self, chunk: Chunk) -> None:
        """Wait for the disk when it is half a second of arrivals behind this chunk: for sources that can wait."""
        if self._settled_ns is None or chunk.t_arrival_ns - self._settled_ns >= SETTLE_NS:
            self._settled_ns = chunk.t_arrival_ns
            self._spool.settle()

    def notes(self, notes: Iterable[Note]) -> None:
        """Keep derived messages."""
        for note in notes:
            self.note(note)

    def note(self, note: Note) -> None:
        """Keep a derived message, unless the disk is busy with the bytes."""
        if self._spool.behind > DERIVED_LIMIT:
            self.skipped += 1
            return
        topic = note.topic
        channel = self._channels.get(topic.name) or self._register_topic(topic)
        body = json.dumps(note.body, allow_nan=False, separators=(",", ":")).encode()
        self._writer.add_message(channel, note.t_ns, body, note.t_ns, self._sequence)
        self._sequence += 1

    def _register(self, port: str) -> int:
        self._channels[port] = self._writer.register_channel(f"/{port}/bytes", RAW_ENCODING, schema_id=0)
        return self._channels[port]

    def _register_topic(self, topic: Topic) -> int:
        schema = self._writer.register_schema(topic.schema_name, "jsonschema", topic.schema.encode())
        self._channels[topic.name] = self._writer.register_channel(topic.name, "json", schema)
        return self._channels[topic.name]

    def close(self) -> None:
        """Finish the file."""
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._spool.close()
        if self.lost:
            self.notices.append(f"{self._spool.path}: {self.lost} chunks were not recorded")

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
    closed: int = 0  # chunks of the file that could not be opened

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
        ports = Ports()
        with self.path.open("rb") as file:
            size = max(1, os.fstat(file.fileno()).st_size)
            place = len(file.read(len(MCAP_MAGIC)))
            self.truncated = True
            rest, missing = b"", 0
            while missing <= RECORD_LIMIT and (more := file.read(max(PIECE, missing))):
                buffer, at = rest + more, 0
                while True:
                    portion, at = messages(buffer, at, ports)
                    self.fraction = (place + at) / size
                    if portion:
                        yield portion
                    record, missing = record_at(buffer, at)
                    if record is None:
                        break
                    if record[0] == Opcode.FOOTER:
                        self.truncated = False
                        return
                    if record[0] == Opcode.CHANNEL:
                        ports.add(record[1])
                    if record[0] == Opcode.CHUNK:
                        yield from self._opened(record[1], ports)
                    yield record
                    at += HEAD_SIZE + len(record[1])
                place, rest = place + at, buffer[at:]

    def _opened(self, body: bytes, ports: Ports) -> Iterator[Portion | tuple[int, bytes]]:
        inside = opened(body)
        if inside is None:
            self.closed += 1
            return
        yield from inside_of(inside, ports)


def open_recording(path: Path | str) -> Recording:
    """A recording and its metadata; raises EchostepError when the file is missing or is none of ours."""
    recording, found_bytes = Recording(Path(path)), False
    try:
        with recording.path.open("rb") as file:
            ours = file.read(len(MCAP_MAGIC)) == MCAP_MAGIC
        for read in recording._records() if ours else ():
            if isinstance(read, Portion):
                found_bytes = True
                if recording.about:
                    break
                continue
            opcode, body = read
            if opcode == Opcode.METADATA and (found := parsed(Metadata, body)) and found.name == METADATA_NAME:
                recording.about = dict(found.metadata)
    except OSError as error:
        raise EchostepError(f"{path}: cannot read the recording: {error.strerror}") from error
    if found_bytes:
        return recording
    raise EchostepError(f"{path}: no recorded bytes in it: is this an echostep recording (.mcap)?")
