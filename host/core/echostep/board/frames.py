# SPDX-License-Identifier: MIT
"""Board frames, sans-I/O: bytes in any split -> messages, and messages -> bytes.

In: bytes from the board's USB port. Out: frames as columns (`Frames`), and as messages (`echostep.messages`). Owns the unfinished frame and the
counters.

    payload = id (1) | sequence (2) | body | checksum (2)      frame = COBS of the payload | 00      [protocol/README.md]
"""

from __future__ import annotations

import binascii
import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from cobs import cobs
from numpy.typing import NDArray

from echostep.arrays import Bools, Ints, Octets
from echostep.board.messages import BY_ID, GREATEST, LEAST, ROWS, SCHEMA_HASH, SCHEMA_SEED, Message
from echostep.errors import EchostepError
from echostep.jit import kernel, lean_part

MAX_ENCODED = 65  # bytes; payloads are at most 64 bytes [protocol/README.md], COBS adds one
HEAD = 3  # bytes before the body: id, sequence
CHECKSUM = 2  # bytes
SHORTEST = HEAD + CHECKSUM + 2  # bytes of a frame with an empty body: one byte of COBS, the closing zero
TICKS_SIZE = 4  # bytes at the beginning of a body with a time stamp; ticks of 0.5 us [protocol/messages.toml]
# Limits of the ticks since the last frame: between them missing numbers mean lost frames, outside the board restarted. Pings are reported late.
OLDEST_TICKS, GAP_TICKS = 2_000_000, 120_000_000  # 1 s, 60 s: in a shorter time the sequence number does not wrap
MAX_BODY = max(kind.itemsize for kind in ROWS.values())
_HEAD_FORMAT = struct.Struct("<BH")
_IDENTITY, _IDENTIFY, _BEACON = 0x01, 0x81, 0x20
_FIXED_SEED = 0xFFFF  # the same in every schema [protocol/README.md]
_FIXED_SEED_IDS = (_IDENTITY, _IDENTIFY, _BEACON)
# Entries of a tally: the counters in the order of `FrameCounts`, the last sequence number and ticks (-1: none), and the length of a tally.
_GOOD, _BAD_COBS, _BAD_LENGTH, _BAD_CRC, _BAD_MESSAGE, _LOST, _SEQUENCE, _TICKS, _TALLY = range(9)


class _Schema(NamedTuple):
    """The schema as arrays. It is an argument of the kernels, because numba's cache would keep the old values of globals of another file."""

    size: Ints  # (256, 2) least and greatest number of bytes of the body by id, -1: no such message
    greatest: Octets  # (256, MAX_BODY) greatest value of each byte of a body
    crc: Ints  # (256,) CRC of one byte
    seed: int
    hash: int
    hash_offset: int  # of the schema's hash in the body of an `Identity`
    timed: Bools  # (256,) whether the body begins with ticks


def _schema() -> _Schema:
    """The generated tables of `messages` as arrays."""
    sizes, greatest = np.full((256, 2), -1, np.int64), np.full((256, MAX_BODY), 255, np.uint8)
    for identifier, kind in ROWS.items():
        sizes[identifier] = LEAST.get(identifier, kind.itemsize), kind.itemsize
    for identifier, offset, value in GREATEST:
        greatest[identifier, offset] = value
    hash_offset = int(ROWS[_IDENTITY].fields["schema_hash"][1])  # type: ignore[index]
    crcs = np.array([binascii.crc_hqx(bytes([k]), 0) for k in range(256)], np.int64)
    timed = np.array([i in ROWS and (ROWS[i].names or ("",))[0] == "ticks" for i in range(256)])
    return _Schema(sizes, greatest, crcs, SCHEMA_SEED, SCHEMA_HASH, hash_offset, timed)


_SCHEMA = _schema()
_ID_OF = {kind: identifier for identifier, kind in BY_ID.items()}


class StaleFirmwareError(EchostepError):
    """The board uses another schema than this host."""


@dataclass(slots=True)
class FrameCounts:
    """Frames that a `BoardReader` has counted; `lost`: sequence numbers that never came."""

    good: int = 0
    bad_cobs: int = 0
    bad_length: int = 0
    bad_crc: int = 0
    bad_message: int = 0
    lost: int = 0

    @property
    def rejected(self) -> int:
        """Frames that failed a check."""
        return self.bad_cobs + self.bad_length + self.bad_crc + self.bad_message


def crc(identifier: int, plain: bytes) -> int:
    """CRC-16 of `plain` (id, sequence and body), with the schema's seed [protocol/README.md]."""
    return binascii.crc_hqx(plain, _FIXED_SEED if identifier in _FIXED_SEED_IDS else SCHEMA_SEED)


def encode(message: Message, sequence: int) -> bytes:
    """One frame with its closing zero; the sequence wraps at 65536."""
    plain = _HEAD_FORMAT.pack(message.id, sequence & 0xFFFF) + message.pack()
    return bytes(cobs.encode(plain + crc(message.id, plain).to_bytes(2, "little"))) + b"\0"


@dataclass(frozen=True, slots=True)
class Frames:
    """Frames that passed every check, as columns: `id`, `sequence`, `end` = index after the closing zero in the bytes fed, `body` (n, MAX_BODY)."""

    id: Octets
    sequence: NDArray[np.uint16]
    end: Ints
    body: Octets

    @property
    def is_timed(self) -> Bools:
        """Whether each body (n,) begins with ticks."""
        return _SCHEMA.timed[self.id]

    def rows(self, kind: type[Message]) -> tuple[Ints, NDArray[np.void]]:
        """Indices (k,) of the messages of a kind, and their bodies (k,) in the schema's dtype."""
        frame_index = (self.id == _ID_OF[kind]).nonzero()[0]
        row = ROWS[_ID_OF[kind]]
        return frame_index, np.ascontiguousarray(self.body[frame_index, : row.itemsize]).view(row)[:, 0]

    def each(self, kinds: Iterable[type[Message]]) -> Iterator[Message]:
        """The messages of these kinds, one kind after the other."""
        for kind in kinds:
            for row in self.rows(kind)[1]:
                yield kind.unpack(row.tobytes())

    def messages(self) -> list[Message]:
        """The frames as named tuples."""
        bodies = self.body.tobytes()
        return [
            BY_ID[i].unpack(bodies[k * MAX_BODY : k * MAX_BODY + ROWS[i].itemsize])
            for k, i in enumerate(self.id.tolist())
        ]


class BoardReader:
    """Frames of a byte stream; malformed frames are counted and raise no error."""

    def __init__(self) -> None:
        self._rest = b""
        self._tally = np.zeros(_TALLY, np.int64)
        self._tally[_SEQUENCE] = self._tally[_TICKS] = -1

    @property
    def counts(self) -> FrameCounts:
        """Counts since the start."""
        return FrameCounts(*self._tally[:_SEQUENCE].tolist())

    @property
    def pending(self) -> int:
        """Bytes of the unfinished frame."""
        return len(self._rest)

    def feed(self, received: bytes) -> list[Message]:
        """Messages completed by these bytes; raises StaleFirmwareError when the board has another schema."""
        return self.frames(received).messages()

    def frames(self, received: bytes) -> Frames:
        """Frames completed by these bytes; raises StaleFirmwareError when the board has another schema."""
        stream = self._rest + received
        most = len(stream) // SHORTEST
        frames = Frames(
            np.empty(most, np.uint8),
            np.empty(most, np.uint16),
            np.empty(most, np.int64),
            np.zeros((most, MAX_BODY), np.uint8),
        )
        count, resume, stale = _find_frames(
            np.frombuffer(stream, np.uint8), _SCHEMA, self._tally, frames.id, frames.sequence, frames.end, frames.body
        )
        if stale >= 0:
            raise StaleFirmwareError(
                f"the board's firmware has schema 0x{stale:08X}, this host 0x{SCHEMA_HASH:08X}: "
                "flash the firmware that belongs to this host (make flash)"
            )
        ends = frames.end[:count] - len(self._rest)
        self._rest = stream[resume : resume + MAX_ENCODED + 1]
        return Frames(frames.id[:count], frames.sequence[:count], ends, frames.body[:count])


@kernel
def _find_frames(
    stream: Octets, schema: _Schema, tally: Ints, ids: Octets, sequences: NDArray[np.uint16], ends: Ints, bodies: Octets
) -> tuple[int, int, int]:
    """Fill the columns; returns the number of frames, the beginning of the unfinished one, and the hash of another schema or -1.

    Another schema ends the search only before the first good frame; after it, such an identity is a bad message.
    """
    payload = np.empty(MAX_ENCODED, np.uint8)
    count, start = 0, 0
    for end in range(len(stream)):
        if stream[end] != 0:
            continue
        length = end - start
        if length > 0 and _decode_frame(stream, start, end, payload, schema, tally):
            identifier, size = payload[0], length - 1 - HEAD - CHECKSUM
            if identifier == _IDENTITY and _schema_hash(payload, schema) != schema.hash and tally[_GOOD] == 0:
                return count, start, _schema_hash(payload, schema)
            if _is_valid(payload, size, schema):
                ids[count] = identifier
                sequences[count] = payload[1] | payload[2] << 8
                ends[count] = end + 1
                for k in range(size):
                    bodies[count, k] = payload[HEAD + k]
                _count_sequence(payload[1] | payload[2] << 8, identifier, _uint32(payload, HEAD), schema, tally)
                count += 1
            else:
                tally[_BAD_MESSAGE] += 1
        start = end + 1
    return count, start, -1


@lean_part
def _decode_frame(stream: Octets, start: int, end: int, payload: Octets, schema: _Schema, tally: Ints) -> bool:
    """Decode stream[start:end] into `payload` (id, sequence, body, checksum); false, and counted, if COBS, length or checksum is wrong."""
    if not SHORTEST - 1 <= end - start <= MAX_ENCODED:
        tally[_BAD_LENGTH] += 1
        return False
    if not _decode_cobs(stream, start, end, payload):
        tally[_BAD_COBS] += 1
        return False
    length = end - start - 1
    crc = _FIXED_SEED if payload[0] in _FIXED_SEED_IDS else schema.seed
    for k in range(length - CHECKSUM):
        crc = (crc << 8 & 0xFF00) ^ schema.crc[crc >> 8 ^ payload[k]]
    if crc != payload[length - 2] | payload[length - 1] << 8:
        tally[_BAD_CRC] += 1
        return False
    return True


@lean_part
def _decode_cobs(stream: Octets, begin: int, end: int, payload: Octets) -> bool:
    """Decode COBS of one frame of at most MAX_ENCODED bytes; false when a block ends beyond the frame [Cheshire, Baker 1999]."""
    n = 0
    while begin < end:
        code = stream[begin] & 0xFF
        if begin + code > end:
            return False
        for k in range(begin + 1, begin + code):
            payload[n] = stream[k]
            n += 1
        begin += code
        payload[n] = 0  # a zero after each block; the last block's zero is beyond the payload
        n += 1
    return True


@lean_part
def _is_valid(payload: Octets, size: int, schema: _Schema) -> bool:
    """Whether the schema has this message, with such a size and these enumeration values; an identity must have this host's schema."""
    identifier = payload[0]
    if not schema.size[identifier, 0] <= size <= schema.size[identifier, 1]:
        return False
    for k in range(size):
        if payload[HEAD + k] > schema.greatest[identifier, k]:
            return False
    return identifier != _IDENTITY or _schema_hash(payload, schema) == schema.hash


@lean_part
def _schema_hash(payload: Octets, schema: _Schema) -> int:
    """The schema's hash in the payload of an identity."""
    return _uint32(payload, HEAD + schema.hash_offset)


@lean_part
def _uint32(payload: Octets, offset: int) -> int:
    """A little-endian number of 32 bits."""
    value = 0
    for k in range(TICKS_SIZE):
        value |= (payload[offset + k] & 0xFF) << 8 * k
    return value


@lean_part
def _count_sequence(sequence: int, identifier: int, ticks: int, schema: _Schema, tally: Ints) -> None:
    """Count a good frame, and the frames lost before it. `ticks`: the first four bytes of the body.

    A board that restarts begins at any number with small ticks. If the ticks are smaller than before, or larger by minutes, no loss is counted.
    """
    tally[_GOOD] += 1
    passed = 0
    if schema.timed[identifier]:
        passed = (ticks - tally[_TICKS] + OLDEST_TICKS) % (1 << 32) - OLDEST_TICKS if tally[_TICKS] >= 0 else 0
        if passed > 0 or tally[_TICKS] < 0:
            tally[_TICKS] = ticks
    if tally[_SEQUENCE] >= 0 and identifier != _IDENTIFY and passed <= GAP_TICKS:
        gap = (sequence - tally[_SEQUENCE] - 1) & 0xFFFF
        if gap < 0x8000:
            tally[_LOST] += gap
    tally[_SEQUENCE] = sequence
