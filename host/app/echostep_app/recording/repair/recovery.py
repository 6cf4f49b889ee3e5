# SPDX-License-Identifier: MIT
"""Recovery: every readable message of a recording, however damaged the file is.

In: an MCAP file: complete, truncated, damaged in the middle, from our recorder or rewritten by another tool. Out: its messages in the order of
the file, both the ports' and derived ones, and the byte ranges without valid records. Owns the read position in the file.

Validity of a record: `damage/scan.py`.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from itertools import chain, compress, islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Channel, Header, Metadata, Schema

from echostep.arrays import Bools, Octets
from echostep.errors import EchostepError
from echostep.recording import MCAP_MAGIC, is_being_written
from echostep.recording.damage import scan
from echostep.recording.damage.ending import begins_as_mcap, checksum_matches, read_ending
from echostep.recording.damage.notes import FileDamage
from echostep.recording.damage.placing import Placement
from echostep.recording.mcap_records import (
    CHANNEL_IDS,
    DAMAGE_NAME,
    HEAD_SIZE,
    LIBRARY,
    MESSAGE,
    MESSAGE_SIZE,
    METADATA_NAME,
    decompress_chunk,
    is_misnamed,
    parse_record,
    port_of,
)

PLACED_AT_ONCE = 8192  # messages whose places are decided together: some seconds of a walk; assumed
PLACE = scan.PRIVATE, bytes(scan.CHUNK_HEAD - HEAD_SIZE)  # that the head of an open chunk will have
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
    own_damage: FileDamage = field(default_factory=FileDamage)  # of this very file
    has_footer: bool = False  # the recorder was closed
    grows: bool = False  # a process is writing it
    intact: bool = False  # the file's checksum says that no byte has changed since it was written
    misnamed: set[str] = field(default_factory=set)  # topics of channels whose name or encoding is damaged
    library: str = ""  # by which the file was written
    before: list[str] = field(default_factory=list)  # damage of the recordings of which this one was made
    keep_private: Callable[[int, bytes], None] = lambda _opcode, _body: None  # called with other programs' own records
    size: int = 0  # of the file, bytes
    byte_offset: int = 0  # of the record that was read last
    _is_channel: Bools = field(default_factory=lambda: np.zeros(CHANNEL_IDS, np.bool_))  # by channel number
    _settled: bool = False  # the channels are from a summary whose checksum is right

    @property
    def fraction(self) -> float:
        """Fraction of the file read so far."""
        return self.byte_offset / max(self.size, 1)

    def messages(self) -> Iterator[RecordedMessage]:
        """All readable messages in their place; raises EchostepError when the file cannot be read or is not an MCAP file."""
        file = scan.map_file(self.path)
        self.size, self.grows = len(file), is_being_written(self.path)
        if not begins_as_mcap(file):
            raise EchostepError(
                f"{self.path}: not a recording: it does not begin as an MCAP file does; "
                "bytes of one port are read by echostep decode"
            )
        ending = read_ending(file)
        self.intact = self.has_footer = ending.data_end >= 0 and checksum_matches(file, ending.data_end) is True
        for opcode, body in () if self.intact else ending.summary:
            self._register(opcode, body)
        self._settled = bool(self.channels) and ending.trusted
        yield from self._placed(self._contents(file[: ending.data_end] if self.intact else file))
        self.byte_offset = self.size
        self.own_damage.truncated = not (self.has_footer or self.grows or self.intact)

    def _contents(self, file: Octets) -> Iterator[RecordedMessage]:
        """All readable messages in the order of the file."""
        for begin, end, content in self._scan(file, len(MCAP_MAGIC)):
            self.byte_offset = begin
            if content is None:
                self.own_damage.skip(begin, end, self.size)
            elif isinstance(content, RecordedMessage):
                yield content
            else:
                yield from self._messages_in_chunk(content)

    def _placed(self, messages: Iterator[RecordedMessage]) -> Iterator[RecordedMessage]:
        """The messages that are in their place; all messages of an intact file, or of another recorder."""
        placement, this = Placement(), list(islice(messages, PLACED_AT_ONCE))
        while this and not self.intact and self.library.startswith(LIBRARY):
            following = list(islice(messages, PLACED_AT_ONCE))
            numbers, ahead = (np.array([m.sequence for m in part], np.int64) for part in (this, following))
            yield from compress(this, placement.keep(numbers, ahead).tolist())
            self.own_damage.misplaced, this = placement.misplaced, following
        yield from chain(this, messages)

    def _scan(self, file: Octets, begin: int) -> Iterator[tuple[int, int, RecordedMessage | bytes | None]]:
        """Begin, end and content from offset `begin` on: a message, the body of a chunk record, or None for a range without valid records."""
        view = file.data
        size = len(file)
        while begin < size:
            end = scan.record_end(file, begin, self._is_channel)
            if (inside := scan.begin_in_chunk(file, begin)) >= 0:
                self.own_damage.altered |= not self.intact and end >= 0 and not scan.chunk_matches(file, inside, end)
                begin = inside
                continue
            if end < 0:
                end = scan.next_valid_run(file, begin + 1, self._is_channel)
                if self.grows and end == size:
                    return
                yield begin, end, None
                begin = end
                continue
            opcode, body = view[begin], begin + HEAD_SIZE
            if opcode == MESSAGE:
                yield begin, end, self._message(view[body:end])
            elif opcode == scan.CHUNK:
                yield begin, end, bytes(view[body:end])
            elif opcode == Opcode.FOOTER and end + len(MCAP_MAGIC) >= size:
                self.has_footer = True
                return
            elif opcode == Opcode.DATA_END:
                matches = checksum_matches(file, begin)
                self.own_damage.altered |= matches is False
                if matches:  # whatever follows, everything before is there
                    self.intact = True
                    self.has_footer = bytes(view[size - len(MCAP_MAGIC) : size]) == MCAP_MAGIC
                    return
            else:
                self._register(opcode, bytes(view[body:end]))
            begin = end

    def _message(self, body: memoryview) -> RecordedMessage:
        channel, sequence, t_ns, publish_ns = _MESSAGE.unpack_from(body)
        return RecordedMessage(self.channels[channel], sequence, t_ns, publish_ns, bytes(body[MESSAGE_SIZE:]))

    def _messages_in_chunk(self, body: bytes) -> Iterator[RecordedMessage]:
        if (records := decompress_chunk(body)) is None:
            self.own_damage.unreadable_chunks += 1
            return
        whole = True
        for _, _, content in self._scan(np.frombuffer(records, np.uint8), 0):
            whole &= content is not None
            if isinstance(content, RecordedMessage):
                yield content
        self.own_damage.unreadable_chunks += not whole

    def _register(self, opcode: int, body: bytes) -> None:
        """Keep a channel, a schema, the recorder's name and its metadata, and what other programs keep; ignore other records."""
        if opcode == Opcode.CHANNEL and (channel := parse_record(Channel, body)):
            if self._settled and channel.id in self.channels:
                return
            self.channels[channel.id] = channel
            self._is_channel[channel.id] = True
            self.misnamed |= {channel.topic} if is_misnamed(channel) else set()
        elif opcode == Opcode.SCHEMA and (schema := parse_record(Schema, body)):
            if not (self._settled and schema.id in self.schemas):
                self.schemas[schema.id] = schema
        elif opcode == Opcode.HEADER and (header := parse_record(Header, body)):
            self.library = header.library
        elif opcode == Opcode.METADATA and (stored := parse_record(Metadata, body)):
            if stored.name == METADATA_NAME:
                self.metadata = dict(stored.metadata)
            elif stored.name == DAMAGE_NAME:
                self.before = list(stored.metadata.values())
        elif opcode >= scan.PRIVATE and (opcode, body) != PLACE:
            self.keep_private(opcode, body)


MOST_WAITING = 4096  # messages: some seconds of a walk, while another port is silent


@dataclass(slots=True)
class _Waiting:
    """A message that waits for the next one of its port; `port` is empty for a derived one, which does not wait."""

    message: RecordedMessage
    port: str
    settled: bool


@dataclass
class ArrivalOrder:
    """Corrects arrival times of one recording that lie outside the port's neighbouring times: to the later one; `corrected` counts them."""

    corrected: int = 0
    _waiting: deque[_Waiting] = field(default_factory=deque)
    _newest: dict[str, _Waiting] = field(default_factory=dict)  # by port
    _before_ns: dict[str, int] = field(default_factory=dict)  # by port: time of the last settled chunk

    def correct(self, messages: Iterable[RecordedMessage]) -> Iterator[RecordedMessage]:
        """The messages, chunks with corrected times."""
        for message in messages:
            port = port_of(message.channel)
            if port and port in self._newest:
                self._settle(self._newest[port], message.t_ns)
            waiting = _Waiting(message, port, not port)
            if port:
                self._newest[port] = waiting
            self._waiting.append(waiting)
            while self._waiting and (self._waiting[0].settled or len(self._waiting) > MOST_WAITING):
                yield self._pop()
        while self._waiting:
            yield self._pop()

    def _settle(self, waiting: _Waiting, next_ns: int) -> None:
        """Decide the time of a chunk whose successor is known."""
        if waiting.settled:
            return
        before_ns = self._before_ns.get(waiting.port, -1)
        if before_ns <= next_ns and not before_ns <= waiting.message.t_ns <= next_ns:
            waiting.message = waiting.message._replace(t_ns=next_ns)
            self.corrected += 1
        waiting.settled = True
        self._before_ns[waiting.port] = waiting.message.t_ns

    def _pop(self) -> RecordedMessage:
        """The oldest message; without a successor its time stays."""
        waiting = self._waiting.popleft()
        self._settle(waiting, waiting.message.t_ns)
        return waiting.message
