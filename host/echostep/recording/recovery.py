"""Every message of a recording, whatever is wrong with the file.

In: an MCAP file, whole, cut off, with damage in the middle, of our own recorder or packed by another tool. Out: its messages in the order of
the file, of ports and derived ones alike, and what had to be passed over. Owns the place in the file.

Where a record makes no sense, the next place is looked for from which several records in a row do.
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
    HEAD_SIZE,
    MCAP_MAGIC,
    MESSAGE,
    MESSAGE_SIZE,
    RECORD_LIMIT,
    number_at,
    opened,
    parsed,
)
from echostep.recording.recorder import METADATA_NAME

CHUNK = 0x06
LAST_OPCODE = 0x0F
CHAIN = 4  # so many records in a row make sense by chance in no file
FOOTER_SIZE = 20
SMALL = 1 << 20  # bytes; nothing but messages and chunks is larger
_MESSAGE = struct.Struct("<HIQQ")
_HEAD = struct.Struct("<BQ")


class Entry(NamedTuple):
    """One message of a channel; times in nanoseconds on the clock of the arrivals."""

    channel: Channel
    sequence: int
    t_ns: int
    publish_ns: int
    body: bytes


@dataclass
class Salvage:
    """`entries` fills the rest: `about` as the recorder was told, `skipped` (byte ranges without sense), `closed` (chunks that cannot be opened)."""

    path: Path
    about: dict[str, str] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, Schema] = field(default_factory=dict)
    skipped: list[tuple[int, int]] = field(default_factory=list)
    closed: int = 0
    finished: bool = False  # the file has an end, as a recorder that was closed gives it
    size: int = 0
    at: int = 0
    _known: Bools = field(default_factory=lambda: np.zeros(1 << 16, np.bool_))

    @property
    def fraction(self) -> float:
        """Of the file, read so far."""
        return self.at / max(self.size, 1)

    @property
    def lost_bytes(self) -> int:
        """All that was passed over."""
        return sum(end - begin for begin, end in self.skipped)

    def entries(self) -> Iterator[Entry]:
        """All messages; raises EchostepError when the file cannot be read or is no MCAP file at all."""
        file = _mapped(self.path)
        self.size = len(file)
        if file[: len(MCAP_MAGIC)].tobytes() != MCAP_MAGIC:
            raise EchostepError(f"{self.path}: not a recording: it does not begin as an MCAP file does")
        self._read_summary(file)
        for begin, end, what in self._walk(file, len(MCAP_MAGIC)):
            self.at = begin
            if what is None:
                self.skipped.append((begin, end))
            elif isinstance(what, Entry):
                yield what
            else:
                yield from self._inside(what)
        self.at = self.size

    def _walk(self, file: Octets, at: int) -> Iterator[tuple[int, int, Entry | bytes | None]]:
        """Begin, end and content of each message and each chunk (its body); None for bytes without sense."""
        view = memoryview(file)  # type: ignore[arg-type]
        size = len(file)
        while at < size:
            end = _record_end(file, at, self._known)
            if end < 0:
                end = _next_chain(file, at + 1, self._known)
                yield at, end, None
                at = end
                continue
            opcode, body = view[at], at + HEAD_SIZE
            if opcode == MESSAGE:
                channel, sequence, t_ns, publish_ns = _MESSAGE.unpack_from(view, body)
                entry = Entry(
                    self.channels[channel], sequence, t_ns, publish_ns, bytes(view[body + MESSAGE_SIZE : end])
                )
                yield at, end, entry
            elif opcode == CHUNK:
                yield at, end, bytes(view[body:end])
            elif opcode == Opcode.FOOTER and end + len(MCAP_MAGIC) >= size:
                self.finished = bytes(view[end:size]) == MCAP_MAGIC
                return
            else:
                self._keep(opcode, bytes(view[body:end]))
            at = end

    def _inside(self, body: bytes) -> Iterator[Entry]:
        inside = opened(body)
        if inside is None:
            self.closed += 1
            return
        for _, _, what in self._walk(np.frombuffer(inside, np.uint8), 0):
            if isinstance(what, Entry):
                yield what

    def _keep(self, opcode: int, body: bytes) -> None:
        """Channels, schemas and what the recorder was told."""
        if opcode == Opcode.CHANNEL and (channel := parsed(Channel, body)):
            self.channels[channel.id] = channel
            self._known[channel.id] = True
        elif opcode == Opcode.SCHEMA and (schema := parsed(Schema, body)):
            self.schemas[schema.id] = schema
        elif opcode == Opcode.METADATA and (said := parsed(Metadata, body)) and said.name == METADATA_NAME:
            self.about = dict(said.metadata)

    def _read_summary(self, file: Octets) -> None:
        """Channels and schemas stand once more at the end of a finished file: good to know when the beginning is damaged."""
        at = len(file) - len(MCAP_MAGIC) - FOOTER_SIZE - HEAD_SIZE
        if at < len(MCAP_MAGIC) or file[-len(MCAP_MAGIC) :].tobytes() != MCAP_MAGIC or file[at] != Opcode.FOOTER:
            return
        start = number_at(file, at + HEAD_SIZE, 8)
        while len(MCAP_MAGIC) <= start < at:
            end = _record_end(file, start, self._known)
            if end < 0:
                return
            self._keep(int(file[start]), file[start + HEAD_SIZE : end].tobytes())
            start = end


def _mapped(path: Path) -> Octets:
    try:
        if not path.stat().st_size:
            raise EchostepError(f"{path}: not a recording: the file is empty")
        return np.memmap(path, np.uint8, "r")
    except (OSError, ValueError) as error:
        raise EchostepError(
            f"{path}: cannot read the recording: {getattr(error, 'strerror', None) or error}"
        ) from error


@kernel
def _record_end(file: Octets, at: int, known: Bools) -> int:
    """Where the record at `at` ends; -1 when it makes no sense."""
    body = at + HEAD_SIZE
    if body > len(file):
        return -1
    opcode, length = file[at], number_at(file, at + 1, 8)
    if not 1 <= opcode <= LAST_OPCODE or not 0 <= length <= min(RECORD_LIMIT, len(file) - body):
        return -1
    if opcode == MESSAGE:
        return body + length if length >= MESSAGE_SIZE and known[number_at(file, body, 2)] else -1
    return body + length if opcode == CHUNK or length <= SMALL else -1


@kernel
def _next_chain(file: Octets, at: int, known: Bools) -> int:
    """The next place from which records make sense, several in a row or up to the end of the file; the end when there is none."""
    for begin in range(at, len(file) - HEAD_SIZE + 1):
        place, links = begin, 0
        while links < CHAIN and place >= 0:
            place = _record_end(file, place, known)
            links += 1
            if place == len(file) or place == len(file) - len(MCAP_MAGIC):
                return begin
        if place >= 0:
            return begin
    return len(file)
