# SPDX-License-Identifier: MIT
"""Recovery: every readable message of a recording, however damaged the file is.

In: an MCAP file: complete, truncated, damaged in the middle, from our recorder or rewritten by another tool. Out: its messages in the order of
the file, both the ports' and derived ones, and the byte ranges without valid records. Owns the read position in the file.

What a valid record is: `scan.py`.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, Schema

from echostep.arrays import Bools, Octets
from echostep.errors import EchostepError
from echostep.recording.mcap_records import (
    CHANNEL_IDS,
    HEAD_SIZE,
    MCAP_MAGIC,
    MESSAGE,
    MESSAGE_SIZE,
    decompress_chunk,
    parse_record,
)
from echostep.recording.recorder import METADATA_NAME
from echostep.recording.scan import CHUNK, checksum_differs, map_file, next_valid_run, record_end, summary

_MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time


class RecordedMessage(NamedTuple):
    """One message of a channel; times in nanoseconds on the clock of the arrivals."""

    channel: Channel
    sequence: int
    t_ns: int
    publish_ns: int
    body: bytes


@dataclass
class Recovery:
    """Scan of one file; the fields are filled while `messages` is iterated."""

    path: Path
    metadata: dict[str, str] = field(default_factory=dict)  # as given to the recorder
    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, Schema] = field(default_factory=dict)
    damaged: list[tuple[int, int]] = field(default_factory=list)  # byte ranges (begin, end) without valid records
    unreadable_chunks: int = 0  # chunk records that cannot be decompressed
    has_footer: bool = False  # the recorder was closed
    altered: bool = False  # the file's checksum says that bytes have changed since they were written
    size: int = 0  # of the file, bytes
    byte_offset: int = 0  # of the record that was read last
    _is_channel: Bools = field(default_factory=lambda: np.zeros(CHANNEL_IDS, np.bool_))  # by channel number

    @property
    def fraction(self) -> float:
        """Fraction of the file read so far."""
        return self.byte_offset / max(self.size, 1)

    def messages(self) -> Iterator[RecordedMessage]:
        """All readable messages; raises EchostepError when the file cannot be read or is not an MCAP file."""
        file = map_file(self.path)
        self.size = len(file)
        if file[: len(MCAP_MAGIC)].tobytes() != MCAP_MAGIC:
            raise EchostepError(
                f"{self.path}: not a recording: it does not begin as an MCAP file does; "
                "bytes of one port are read by echostep decode"
            )
        for opcode, body in summary(file):
            self._register(opcode, body)
        for begin, end, content in self._scan(file, len(MCAP_MAGIC)):
            self.byte_offset = begin
            if content is None:
                self.damaged.append((begin, end))
            elif isinstance(content, RecordedMessage):
                yield content
            else:
                yield from self._messages_in_chunk(content)
        self.byte_offset = self.size

    def _scan(self, file: Octets, begin: int) -> Iterator[tuple[int, int, RecordedMessage | bytes | None]]:
        """Begin, end and content from offset `begin` on: a message, the body of a chunk record, or None for a range without valid records."""
        view = memoryview(file)  # type: ignore[arg-type]
        size = len(file)
        while begin < size:
            end = record_end(file, begin, self._is_channel)
            if end < 0:
                end = next_valid_run(file, begin + 1, self._is_channel)
                yield begin, end, None
                begin = end
                continue
            opcode, body = view[begin], begin + HEAD_SIZE
            if opcode == MESSAGE:
                yield begin, end, self._message(view[body:end])
            elif opcode == CHUNK:
                yield begin, end, bytes(view[body:end])
            elif opcode == Opcode.FOOTER and end + len(MCAP_MAGIC) >= size:
                self.has_footer = bytes(view[end:size]) == MCAP_MAGIC
                return
            elif opcode == Opcode.DATA_END:
                self.altered = self.altered or checksum_differs(file, begin)
            else:
                self._register(opcode, bytes(view[body:end]))
            begin = end

    def _message(self, body: memoryview) -> RecordedMessage:
        channel, sequence, t_ns, publish_ns = _MESSAGE.unpack_from(body)
        return RecordedMessage(self.channels[channel], sequence, t_ns, publish_ns, bytes(body[MESSAGE_SIZE:]))

    def _messages_in_chunk(self, body: bytes) -> Iterator[RecordedMessage]:
        records = decompress_chunk(body)
        if records is None:
            self.unreadable_chunks += 1
            return
        for _, _, content in self._scan(np.frombuffer(records, np.uint8), 0):
            if isinstance(content, RecordedMessage):
                yield content

    def _register(self, opcode: int, body: bytes) -> None:
        """Keep a channel, a schema or the recorder's metadata; ignore other records."""
        if opcode == Opcode.CHANNEL and (channel := parse_record(Channel, body)):
            self.channels[channel.id] = channel
            self._is_channel[channel.id] = True
        elif opcode == Opcode.SCHEMA and (schema := parse_record(Schema, body)):
            self.schemas[schema.id] = schema
        elif opcode == Opcode.METADATA and (stored := parse_record(Metadata, body)) and stored.name == METADATA_NAME:
            self.metadata = dict(stored.metadata)
