"""Board frames, sans-I/O: bytes in any split -> messages, and messages -> bytes.

In: bytes from the board's USB port. Out: frames as columns (`Frames`), and the same as messages (`echostep.messages`). Owns the unfinished frame
and the counters. The frame is described in protocol/README.md.
"""

from __future__ import annotations

import binascii
import struct
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from cobs import cobs
from numpy.typing import NDArray

from echostep.arrays import Ints, Octets
from echostep.board.messages import BY_ID, GREATEST, ROWS, SCHEMA_HASH, SCHEMA_SEED, Message
from echostep.errors import EchostepError
from echostep.jit import kernel, lean_kernel

MAX_ENCODED = 65  # payloads are at most 64 bytes; COBS adds one
SHORTEST = 7  # an empty body: id, sequence, checksum, one byte of COBS, the closing zero
MAX_BODY = max(kind.itemsize for kind in ROWS.values())
_HEAD = struct.Struct("<BH")
_IDENTITY, _IDENTIFY, _BEACON = 0x01, 0x81, 0x20
_FIXED_SEED = 0xFFFF  # never changes [protocol/README.md]
_FIXED_SEED_IDS = (_IDENTITY, _IDENTIFY, _BEACON)
_GOOD, _BAD_COBS, _BAD_LENGTH, _BAD_CRC, _BAD_MESSAGE, _LOST, _SEQUENCE, _TALLY = range(
    8
)  # the first as in `FrameCounts`


class _Schema(NamedTuple):
    """What the kernel needs to know of the schema; an argument, as numba's cache would keep the values of globals from another file."""

    size: Ints  # of each id's body, -1: no such message
    greatest: Octets  # (256, MAX_BODY) value of each byte
    crc: Ints  # (256,) of one byte
    seed: int
    hash: int
    hash_at: int


def _schema() -> _Schema:
    sizes, greatest = np.full(256, -1, np.int64), np.full((256, MAX_BODY), 255, np.uint8)
    for identifier, kind in ROWS.items():
        sizes[identifier] = kind.itemsize
    for identifier, offset, value in GREATEST:
        greatest[identifier, offset] = value
    hash_at = int(ROWS[_IDENTITY].fields["schema_hash"][1])  # type: ignore[index]
    crcs = np.array([binascii.crc_hqx(bytes([k]), 0) for k in range(256)], np.int64)
    return _Schema(sizes, greatest, crcs, SCHEMA_SEED, SCHEMA_HASH, hash_at)


_SCHEMA = _schema()


class StaleFirmwareError(EchostepError):
    """The board speaks another schema than this host."""


@dataclass(slots=True)
class FrameCounts:
    """What a `BoardReader` has seen; `lost` counts sequence numbers that never came."""

    good: int = 0
    bad_cobs: int = 0
    bad_length: int = 0
    bad_crc: int = 0
    bad_message: int = 0
    lost: int = 0

    @property
    def rejected(self) -> int:
        return self.bad_cobs + self.bad_length + self.bad_crc + self.bad_message


def crc(identifier: int, plain: bytes) -> int:
    """CRC-16 of id, sequence and body, seeded by the schema [protocol/README.md]."""
    return binascii.crc_hqx(plain, _FIXED_SEED if identifier in _FIXED_SEED_IDS else SCHEMA_SEED)


def encode(message: Message, sequence: int) -> bytes:
    """One frame with its closing zero; the sequence wraps at 65536."""
    plain = _HEAD.pack(message.id, sequence & 0xFFFF) + message.pack()
    payload = plain + crc(message.id, plain).to_bytes(2, "little")
    return bytes(cobs.encode(payload)) + b"\0"


@dataclass(frozen=True, slots=True)
class Frames:
    """Frames that passed every check, as columns: `id`, `sequence`, `end` = index after the closing zero in the bytes fed, `body` (n, MAX_BODY)."""

    id: Octets
    sequence: NDArray[np.uint16]
    end: Ints
    body: Octets

    def rows(self, identifier: int) -> tuple[Ints, NDArray[np.void]]:
        """Which frames (k,) carry this id, and their bodies (k,) by the schema's dtype."""
        at = (self.id == identifier).nonzero()[0]
        kind = ROWS[identifier]
        return at, np.ascontiguousarray(self.body[at, : kind.itemsize]).view(kind)[:, 0]

    def messages(self) -> list[Message]:
        """The same as named tuples."""
        bodies = self.body.tobytes()
        return [
            BY_ID[i].unpack(bodies[k * MAX_BODY : k * MAX_BODY + ROWS[i].itemsize])
            for k, i in enumerate(self.id.tolist())
        ]


class BoardReader:
    """Frames out of a byte stream; every malformed frame is counted, none raises."""

    def __init__(self) -> None:
        self._rest = b""
        self._tally = np.zeros(_TALLY, np.int64)
        self._tally[_SEQUENCE] = -1

    @property
    def counts(self) -> FrameCounts:
        """What was seen so far."""
        return FrameCounts(*self._tally[:_SEQUENCE].tolist())

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
        found, done, stale = _read(
            np.frombuffer(stream, np.uint8), _SCHEMA, self._tally, frames.id, frames.sequence, frames.end, frames.body
        )
        if stale >= 0:
            raise StaleFirmwareError(
                f"the board's firmware speaks schema 0x{stale:08X}, this host 0x{SCHEMA_HASH:08X}: "
                "flash the firmware that belongs to this host (make flash)"
            )
        ends = frames.end[:found] - len(self._rest)
        self._rest = stream[done : done + MAX_ENCODED + 1]
        return Frames(frames.id[:found], frames.sequence[:found], ends, frames.body[:found])


@kernel
def _read(
    stream: Octets, schema: _Schema, tally: Ints, ids: Octets, sequences: NDArray[np.uint16], ends: Ints, bodies: Octets
) -> tuple[int, int, int]:
    """Fill the columns; returns how many frames were found, where the unfinished one begins, and a foreign schema hash or -1."""
    payload = np.empty(MAX_ENCODED, np.uint8)
    found, start = 0, 0
    for end in range(len(stream)):
        if stream[end] != 0:
            continue
        length = end - start
        if length > 0 and _open(stream, start, end, payload, schema, tally):
            identifier, size = payload[0], length - 6
            if identifier == _IDENTITY and _schema_hash(payload, schema) != schema.hash and tally[_GOOD] == 0:
                return found, start, _schema_hash(payload, schema)
            if _known(payload, size, schema):
                ids[found] = identifier
                sequences[found] = payload[1] | payload[2] << 8
                ends[found] = end + 1
                bodies[found, :size] = payload[3 : 3 + size]
                _count_sequence(payload[1] | payload[2] << 8, identifier, tally)
                found += 1
            else:
                tally[_BAD_MESSAGE] += 1
        start = end + 1
    return found, start, -1


@lean_kernel
def _open(stream: Octets, start: int, end: int, payload: Octets, schema: _Schema, tally: Ints) -> bool:
    """Whether stream[start:end] is a frame with a right checksum; then `payload` holds its id, sequence, body and checksum."""
    if not SHORTEST - 1 <= end - start <= MAX_ENCODED:
        tally[_BAD_LENGTH] += 1
        return False
    if not _unstuff(stream, start, end, payload):
        tally[_BAD_COBS] += 1
        return False
    length = end - start - 1
    crc = _FIXED_SEED if payload[0] in _FIXED_SEED_IDS else schema.seed
    for k in range(length - 2):
        crc = (crc << 8 & 0xFF00) ^ schema.crc[crc >> 8 ^ payload[k]]
    if crc != payload[length - 2] | payload[length - 1] << 8:
        tally[_BAD_CRC] += 1
        return False
    return True


@lean_kernel
def _unstuff(stream: Octets, at: int, end: int, payload: Octets) -> bool:
    """Undo COBS for one frame of at most MAX_ENCODED bytes; false when a block reaches beyond its end [Cheshire, Baker 1999]."""
    n = 0
    while at < end:
        code = stream[at] & 0xFF
        if at + code > end:
            return False
        for k in range(at + 1, at + code):
            payload[n] = stream[k]
            n += 1
        at += code
        payload[n] = 0  # a zero after each block; the last one lies behind the payload
        n += 1
    return True


@lean_kernel
def _known(payload: Octets, size: int, schema: _Schema) -> bool:
    """Whether there is such a message, of this size, without unknown enumeration values, and from our own schema if it names one."""
    identifier = payload[0]
    if schema.size[identifier] != size:
        return False
    for k in range(size):
        if payload[3 + k] > schema.greatest[identifier, k]:
            return False
    return identifier != _IDENTITY or _schema_hash(payload, schema) == schema.hash


@lean_kernel
def _schema_hash(payload: Octets, schema: _Schema) -> int:
    value = 0
    for k in range(4):
        value |= (payload[3 + schema.hash_at + k] & 0xFF) << 8 * k
    return value


@lean_kernel
def _count_sequence(sequence: int, identifier: int, tally: Ints) -> None:
    tally[_GOOD] += 1
    if tally[_SEQUENCE] >= 0 and identifier != _IDENTIFY:
        gap = (sequence - tally[_SEQUENCE] - 1) & 0xFFFF
        if gap < 0x8000:  # a step back is a board that restarted
            tally[_LOST] += gap
    tally[_SEQUENCE] = sequence
