"""Xsens frames: bytes -> message identifier and payload, in any split of the bytes.

In: bytes as they came. Out: where each complete frame lies. Owns the unfinished frame (at most 2054 bytes) and the counts of what it rejected.
FA, bus, message, length, payload, checksum; length FF announces two more bytes of length; all bytes after FA sum to 0 mod 256
[Manual 5.3.1; LLCP, message structure and extended length].
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from echostep.arrays import Ints, Octets
from echostep.jit import kernel

PREAMBLE = 0xFA
BUS_ID = 0xFF
EXTENDED = 0xFF
MTDATA = 0x32
MTDATA2 = 0x36
WAKE_UP = 0x3E
ERROR = 0x42
MAX_LENGTH = 2048  # longest payload that an MT sends
SHORTEST = 5  # bytes in a frame without payload


SKIPPED, BAD_CHECKSUM = 0, 1  # what `_scan` counts


class Frame(NamedTuple):
    """One frame that passed its checksum."""

    mid: int
    payload: bytes


class MtFrames(NamedTuple):
    """Complete frames: `stream` holds them; `mid`, `body` and `length` of each payload (n,); `end` (n,): after which of
    the bytes just fed it was clear that it is a frame: its last one, or that of a false frame which began before it.
    """

    stream: Octets
    mid: Ints
    body: Ints
    length: Ints
    end: Ints


@dataclass(slots=True)
class MtFrameCounts:
    """Octets that belong to no frame, and frames with a wrong checksum."""

    skipped_bytes: int = 0
    bad_checksum: int = 0


def encode_frame(mid: int, payload: bytes = b"", bus_id: int = BUS_ID) -> bytes:
    """One frame with its checksum; raises ValueError for a payload that is too long."""
    if len(payload) > MAX_LENGTH:
        raise ValueError(f"{len(payload)} bytes do not fit an Xsens frame")
    length = bytes([len(payload)]) if len(payload) < EXTENDED else bytes([EXTENDED]) + len(payload).to_bytes(2, "big")
    body = bytes([bus_id, mid]) + length + payload
    return bytes([PREAMBLE]) + body + bytes([-sum(body) & 0xFF])


@dataclass(slots=True)
class FrameReader:
    """Frames out of a byte stream; after damage it looks for the next preamble inside what it rejected."""

    counts: MtFrameCounts = field(default_factory=MtFrameCounts)
    _rest: bytes = b""

    @property
    def pending(self) -> int:
        """Octets of the unfinished frame."""
        return len(self._rest)

    def scan(self, received: bytes) -> MtFrames:
        """Frames completed by these bytes."""
        stream = np.frombuffer(self._rest + received, np.uint8)
        found = np.empty((len(stream) // SHORTEST, 4), np.int64)
        counted = np.zeros(2, np.int64)
        count, resume = _scan(stream, found, counted)
        self.counts.skipped_bytes += int(counted[SKIPPED])
        self.counts.bad_checksum += int(counted[BAD_CHECKSUM])
        before = len(self._rest)
        self._rest = stream[resume:].tobytes()
        mid, body, length, end = found[:count].T
        return MtFrames(stream, mid, body, length, end - before)

    def feed(self, received: bytes) -> list[Frame]:
        """Frames completed by these bytes, one by one."""
        found = self.scan(received)
        rows = zip(found.mid.tolist(), found.body.tolist(), found.length.tolist(), strict=True)
        return [Frame(mid, found.stream[body : body + length].tobytes()) for mid, body, length in rows]


@kernel
def payloads_at(stream: Octets, begin: Ints, length: int) -> Octets:
    """Rows of `length` bytes (n, length) that begin at `begin` (n,)."""
    rows = np.empty((len(begin), length), np.uint8)
    for k in range(len(begin)):
        rows[k] = stream[begin[k] : begin[k] + length]
    return rows


@kernel
def _scan(stream: Octets, found: Ints, counted: Ints) -> tuple[int, int]:
    """Fill rows (message, body, length, known) of `found`; returns their number, and where the unfinished frame begins.

    `known` is the byte after which it is clear that the frame is one: its end, or the end of a false frame that began before it.
    Running sums make every checksum two look-ups: noise full of preambles costs no more than frames.
    """
    size = len(stream)
    sums = np.empty(size + 1, np.uint8)
    running = 0
    for k in range(size):
        sums[k] = running
        running = (running + stream[k]) & 0xFF
    sums[size] = running
    count, at, known = 0, 0, 0
    while at < size:
        have = size - at
        if stream[at] != PREAMBLE or (have > 1 and stream[at + 1] != BUS_ID):
            known = max(known, at + 1 + (stream[at] == PREAMBLE))
            counted[SKIPPED] += 1
            at += 1
            continue
        if have < 4:
            break
        length, head = int(stream[at + 3]), 4
        if length == EXTENDED:
            if have < 6:
                break
            length, head = (int(stream[at + 4]) << 8) | int(stream[at + 5]), 6
            if length < EXTENDED or length > MAX_LENGTH:
                known = max(known, at + 6)
                counted[SKIPPED] += 1
                at += 1
                continue
        end = at + head + length + 1
        if end > size:
            break
        known = max(known, end)
        if sums[end] != sums[at + 1]:
            counted[BAD_CHECKSUM] += 1
            counted[SKIPPED] += 1
            at += 1
            continue
        found[count, 0], found[count, 1], found[count, 2], found[count, 3] = stream[at + 2], at + head, length, known
        count += 1
        at = end
    return count, at
