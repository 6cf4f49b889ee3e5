"""Recovery: every readable message of a recording, however damaged the file is.

In: an MCAP file: complete, truncated, damaged in the middle, from our recorder or rewritten by another tool. Out: its messages in the order of
the file, both the ports' and derived ones, and the byte ranges without valid records. Owns the read position in the file.

Where a record is not valid, the scan goes on at the next offset from which several consecutive records are valid.
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
from echostep.jit import kernel
from echostep.recording.mcap_records import (
    CHANNEL_IDS,
    HEAD_SIZE,
    MCAP_MAGIC,
    MESSAGE,
    MESSAGE_SIZE,
    RECORD_LIMIT,
    decompress_chunk,
    parse_record,
    read_uint,
)
from echostep.recording.recorder import METADATA_NAME

# [MCAP format specification]
CHUNK = 0x06  # opcode
LAST_OPCODE = 0x0F
FOOTER_SIZE = 20  # bytes of its body
_MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
# By reason.
VALID_RUN = 4  # so many consecutive records are not valid by chance
OTHER_LIMIT = 1 << 20  # bytes; only messages and chunk records are larger


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
    size: int = 0  # of the file, bytes
    byte_offset: int = 0  # of the record that was read last
    _is_channel: Bools = field(default_factory=lambda: np.zeros(CHANNEL_IDS, np.bool_))  # by channel number

    @property
    def fraction(self) -> float:
        """Fraction of the file read so far."""
        return self.byte_offset / max(self.size, 1)

    def messages(self) -> Iterator[RecordedMessage]:
        """All readable messages; raises EchostepError when the file cannot be read or is not an MCAP file."""
        file = _map_file(self.path)
        self.size = len(file)
        if file[: len(MCAP_MAGIC)].tobytes() != MCAP_MAGIC:
            raise EchostepError(f"{self.path}: not a recording: it does not begin as an MCAP file does")
        self._read_summary(file)
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
            end = _record_end(file, begin, self._is_channel)
            if end < 0:
                end = _next_valid_run(file, begin + 1, self._is_channel)
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

    def _read_summary(self, file: Octets) -> None:
        """Register the channels and schemas repeated at the end of a closed file, for the case that its beginning is damaged."""
        footer = len(file) - len(MCAP_MAGIC) - FOOTER_SIZE - HEAD_SIZE
        ends_as_mcap = file[-len(MCAP_MAGIC) :].tobytes() == MCAP_MAGIC
        if footer < len(MCAP_MAGIC) or not ends_as_mcap or file[footer] != Opcode.FOOTER:
            return
        begin = read_uint(file, footer + HEAD_SIZE, 8)
        while len(MCAP_MAGIC) <= begin < footer:
            end = _record_end(file, begin, self._is_channel)
            if end < 0:
                return
            self._register(int(file[begin]), file[begin + HEAD_SIZE : end].tobytes())
            begin = end


def _map_file(path: Path) -> Octets:
    """The bytes of a file, mapped into memory."""
    try:
        if not path.stat().st_size:
            raise EchostepError(f"{path}: not a recording: the file is empty")
        return np.memmap(path, np.uint8, "r")
    except (OSError, ValueError) as error:
        raise EchostepError(
            f"{path}: cannot read the recording: {getattr(error, 'strerror', None) or error}"
        ) from error


@kernel
def _record_end(file: Octets, begin: int, is_channel: Bools) -> int:
    """Offset after the record at `begin`; -1 when that record is not valid: opcode, length, or the channel of a message."""
    body = begin + HEAD_SIZE
    if body > len(file):
        return -1
    opcode, length = file[begin], read_uint(file, begin + 1, 8)
    if not 1 <= opcode <= LAST_OPCODE or not 0 <= length <= min(RECORD_LIMIT, len(file) - body):
        return -1
    if opcode == MESSAGE:
        return body + length if length >= MESSAGE_SIZE and is_channel[read_uint(file, body, 2)] else -1
    return body + length if opcode == CHUNK or length <= OTHER_LIMIT else -1


@kernel
def _next_valid_run(file: Octets, first: int, is_channel: Bools) -> int:
    """Smallest offset >= `first` from which `VALID_RUN` consecutive records, or all up to the end, are valid; the file's length if there is none."""
    for begin in range(first, len(file) - HEAD_SIZE + 1):
        offset, records = begin, 0
        while records < VALID_RUN and offset >= 0:
            offset = _record_end(file, offset, is_channel)
            records += 1
            if offset == len(file) or offset == len(file) - len(MCAP_MAGIC):
                return begin
        if offset >= 0:
            return begin
    return len(file)
