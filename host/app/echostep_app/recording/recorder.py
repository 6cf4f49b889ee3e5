# SPDX-License-Identifier: MIT
"""The recorder: every chunk is written to an MCAP file before it is used.

In: chunks in order of arrival, and messages derived from them. Out: a file, which `reading.py` reads. Owns the open file.
The file is MCAP in chunks, whose records do not wait for their chunk's end (`open_chunk`), written by a thread (`background_writer`). After a crash
it is readable up to its last whole record, and a slow disk does not delay the tracker.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Self

from mcap.records import Channel, Schema
from mcap.writer import CompressionType, IndexType, Writer

from echostep.errors import IncompleteError
from echostep.ports.chunks import Chunk
from echostep.recording import log_offset_ns, with_log_time
from echostep.recording.mcap_records import DAMAGE_NAME, LIBRARY, METADATA_NAME, RAW_ENCODING, RECORD_LIMIT
from echostep_app.recording.background_writer import BackgroundWriter
from echostep_app.recording.open_chunk import CHUNK_BYTES, OpenChunk

# All assumed.
WAIT_NS = 500_000_000  # arrival time between two waits of `wait_for_disk`
RAW_LIMIT = 1 << 26  # bytes of chunks that may wait for a full disk: an hour and a half
DERIVED_LIMIT = 1 << 20  # unwritten bytes from which derived messages are skipped: they can be computed again


@dataclass(frozen=True, slots=True)
class Topic:
    """A channel of derived messages: JSON objects of the JSON Schema `schema` (text); viewers know the schema by `schema_name`."""

    name: str
    schema_name: str
    schema: str


@dataclass(frozen=True, slots=True)
class DerivedMessage:
    """One derived message; `t_ns` in UTC where the run knows the time of day, else on the clock of the arrivals."""

    topic: Topic
    t_ns: int
    body: Mapping[str, Any]


def begin_file(file: IO[bytes] | OpenChunk, chunk_bytes: int = CHUNK_BYTES) -> Writer:
    """A writer of chunks that are not compressed: a flipped bit costs one message, and other programs read by the index of chunks alone."""
    writer = Writer(
        file,  # type: ignore[arg-type]  # it calls only `write`, `tell` and `flush`
        compression=CompressionType.NONE,
        index_types=IndexType.ALL,
        chunk_size=chunk_bytes,
        enable_data_crcs=True,
    )
    writer.start(profile="", library=LIBRARY)
    return writer


def numbered(lines: Iterable[str]) -> dict[str, str]:
    """Lines as the values of a metadata record."""
    return {f"{k:03}": line for k, line in enumerate(dict.fromkeys(lines))}


class Recorder:
    """Writes chunks to a new file; raises EchostepError when the file cannot be created, or exists."""

    def __init__(self, path: Path | str, metadata: Mapping[str, str]) -> None:
        """`metadata`: start, seed, plan and note, as text, for replays and readers."""
        self._begin(BackgroundWriter(path), metadata)
        self._waited_ns: int | None = None  # arrival time of the chunk of the last wait
        self.lost_chunks = 0  # not recorded: more than `RAW_LIMIT` bytes waited for the disk
        # Derived ones, not recorded: more than `DERIVED_LIMIT` bytes waited, or the disk is nearly full
        self.skipped_messages = 0

    def _begin(self, file: BackgroundWriter, metadata: Mapping[str, str]) -> None:
        """Write to this file from now on."""
        self._file = file
        self._chunk = OpenChunk(file)
        self._writer = begin_file(self._chunk, RECORD_LIMIT)  # chunks are closed by `_add_message`
        fields = with_log_time(metadata)
        self.log_offset_ns = log_offset_ns(fields)  # log time minus arrival time
        self._writer.add_metadata(METADATA_NAME, fields)
        self._channels: dict[str, int] = {}  # by port or topic
        self._sequence = 0

    @property
    def path(self) -> Path:
        """The file."""
        return self._file.path

    @property
    def offset(self) -> int:
        """Bytes of the file so far, including those that wait for the disk."""
        return self._file.tell()

    @property
    def is_whole(self) -> bool:
        """Whether the disk has all chunks, once the recorder is closed."""
        return self._file.is_whole and not self.lost_chunks

    def check_whole(self) -> None:
        """Raises IncompleteError when the closed recording lacks something; `notices` say why."""
        if not self.is_whole:
            raise IncompleteError(f"{self.path}: the recording is not whole; all else was done")

    @property
    def notices(self) -> deque[str]:
        """Messages about the disk; the caller prints and clears them."""
        return self._file.notices

    def write(self, chunk: Chunk) -> None:
        """Record one chunk; never waits for the disk."""
        if self._file.unwritten_bytes > RAW_LIMIT:
            self.lost_chunks += 1
            return
        channel = self._channels.get(chunk.port) or self._register(chunk.port, f"/{chunk.port}/bytes", RAW_ENCODING, 0)
        self._add_message(channel, chunk.t_arrival_ns + self.log_offset_ns, chunk.data)

    def wait_for_disk(self, chunk: Chunk) -> None:
        """Wait for the file once per `WAIT_NS` of arrival time; for sources that can be slowed down."""
        if self._waited_ns is None or chunk.t_arrival_ns - self._waited_ns >= WAIT_NS:
            self._waited_ns = chunk.t_arrival_ns
            self._file.wait_until_written()

    def write_derived(self, messages: Iterable[DerivedMessage]) -> None:
        """Record derived messages; they are skipped while the disk is behind or nearly full, in favour of the chunks."""
        for message in messages:
            if self._file.nearly_full or self._file.unwritten_bytes > DERIVED_LIMIT:
                self.skipped_messages += 1
                continue
            channel = self._channels.get(message.topic.name) or self._register_topic(message.topic)
            body = json.dumps(message.body, allow_nan=False, separators=(",", ":")).encode()
            self._add_message(channel, message.t_ns, body)

    def write_damage(self, lines: Iterable[str]) -> None:
        """Record the damage of the recording from which the chunks come; nothing when it was whole."""
        if noted := numbered(lines):
            self._add_metadata(DAMAGE_NAME, noted)

    def _add_metadata(self, name: str, fields: Mapping[str, str]) -> None:
        self._close_chunk()
        self._writer.add_metadata(name, dict(fields))

    def _add_message(self, channel: int, t_ns: int, data: bytes) -> None:
        self._chunk.lay_message(channel, self._sequence, t_ns, data)
        self._writer.add_message(channel, t_ns, data, t_ns, self._sequence)
        self._sequence += 1
        if self._chunk.is_full:
            self._close_chunk()

    def _close_chunk(self) -> None:
        self._writer.flush()  # type: ignore[no-untyped-call]

    def _register_topic(self, topic: Topic) -> int:
        name, encoding, schema = topic.schema_name, "jsonschema", topic.schema.encode()
        number = self._writer.register_schema(name, encoding, schema)
        self._chunk.lay(Schema(data=schema, encoding=encoding, id=number, name=name))
        return self._register(topic.name, topic.name, "json", number)

    def _register(self, key: str, topic: str, encoding: str, schema: int) -> int:
        number = self._channels[key] = self._writer.register_channel(topic, encoding, schema)
        self._chunk.lay(Channel(id=number, topic=topic, message_encoding=encoding, metadata={}, schema_id=schema))
        return number

    def close(self) -> None:
        """Write summary and footer, and close the file."""
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.close()
        if self.lost_chunks:
            self.notices.append(f"{self._file.path}: {self.lost_chunks} chunks were not recorded")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
