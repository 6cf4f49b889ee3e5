# SPDX-License-Identifier: MIT
"""The recorder: every chunk is written to an MCAP file before it is used.

In: chunks in order of arrival, and messages derived from them. Out: a file, which `reading.py` reads. Owns the open file.
The file is MCAP without chunk records, written by a thread (`background_writer`). After a crash it is readable up to its last whole record, and
a slow disk does not delay the tracker.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self

from mcap.writer import CompressionType, IndexType, Writer

from echostep.errors import IncompleteError
from echostep.ports.chunks import Chunk
from echostep.recording import log_offset_ns, with_log_time
from echostep.recording.mcap_records import DAMAGE_NAME, LIBRARY, METADATA_NAME, RAW_ENCODING
from echostep_app.recording.background_writer import BackgroundWriter

# All assumed.
WAIT_NS = 500_000_000  # arrival time between two waits of `wait_for_disk`
RAW_LIMIT = 1 << 26  # bytes of chunks that may wait for a full disk: an hour and a half
CHUNK_BYTES = 1 << 16  # of a chunk of an indexed file
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


def begin_file(file: IO[bytes], *, indexed: bool = False) -> Writer:
    """A writer of records without chunks: a flipped bit, or the end of a run without notice, costs one message.

    `indexed`: in chunks that are not compressed, for other programs that read by an index of chunks alone.
    """
    writer = Writer(
        file,
        compression=CompressionType.NONE,
        index_types=IndexType.ALL,
        use_chunking=indexed,
        chunk_size=CHUNK_BYTES,
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
        """`metadata`: what a replay needs and a reader may want to know (start, seed, plan, note), as text."""
        self._begin(BackgroundWriter(path), metadata)
        self._waited_ns: int | None = None  # arrival time of the chunk of the last wait
        self.lost_chunks = 0  # not recorded: more than `RAW_LIMIT` bytes waited for the disk
        # Derived ones, not recorded: more than `DERIVED_LIMIT` bytes waited, or the disk is nearly full
        self.skipped_messages = 0

    def _begin(self, file: BackgroundWriter, metadata: Mapping[str, str]) -> None:
        """Write to this file from now on."""
        self._file = file
        self._writer = begin_file(file)  # type: ignore[arg-type]  # the writer calls only `write` and `tell`
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
        """Raises IncompleteError when the closed recording lacks something; `notices` tell why."""
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
        channel = self._channels.get(chunk.port) or self._register_port(chunk.port)
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
            self._writer.add_metadata(DAMAGE_NAME, noted)

    def _add_message(self, channel: int, t_ns: int, data: bytes) -> None:
        self._writer.add_message(channel, t_ns, data, t_ns, self._sequence)
        self._sequence += 1

    def _register_port(self, port: str) -> int:
        self._channels[port] = self._writer.register_channel(f"/{port}/bytes", RAW_ENCODING, schema_id=0)
        return self._channels[port]

    def _register_topic(self, topic: Topic) -> int:
        schema = self._writer.register_schema(topic.schema_name, "jsonschema", topic.schema.encode())
        self._channels[topic.name] = self._writer.register_channel(topic.name, "json", schema)
        return self._channels[topic.name]

    def close(self) -> None:
        """Write summary and footer, and close the file."""
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.close()
        if self.lost_chunks:
            self.notices.append(f"{self._file.path}: {self.lost_chunks} chunks were not recorded")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()
