# SPDX-License-Identifier: MIT
"""Xsens frames: bytes -> message identifier and payload, in any split of the bytes.

In: bytes of the port, in order. Out: position and length of each complete frame. Owns the unfinished frame (at most 2054 bytes, unless longer frames
are asked for) and the counts of rejected bytes.

    FA | bus | message | length        | payload | checksum      length < FF
    FA | bus | message | FF | length, 2 | payload | checksum      extended

All bytes after FA sum to 0 mod 256 [Manual 5.3.1; LLCP, message structure and extended length]. The bus is FF for a device alone and for a
master, and 1 upward for the devices of an Xbus or Awinda master.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from echostep.arrays import Ints, Octets
from echostep.jit import kernel, part

PREAMBLE = 0xFA  # this and the next two [Manual 5.3.1]
BUS_ID = 0xFF  # of a device alone, and of a master
FIRST_BUS, LAST_BUS = 1, 32  # of the devices of a master; the last: more than any master has; assumed
EXTENDED = 0xFF
MTDATA, MTDATA2, WAKE_UP, ERROR = 0x32, 0x36, 0x3E, 0x42  # message identifiers [LLCP]
CONFIGURATION, OUTPUT_MODE, OUTPUT_SETTINGS = 0x0D, 0xD1, 0xD3  # the same: answers to requests
MAX_LENGTH = 2048  # bytes, longest payload that an MT sends by itself [LLCP, extended length]
LONGEST = 0xFFFF  # bytes, longest payload of an extended frame: in captures, loggers' settings have 15 kB
SHORTEST = 5  # bytes of a frame without payload

SKIPPED, BAD_CHECKSUM, _TALLY = range(3)  # entries of a tally, and its length
_BUS, _MID, _BODY, _LENGTH, _CERTAIN, _COLUMNS = range(6)  # columns of a row of `_find_frames`, and their number
_NO_HEADER, _UNFINISHED = -1, 0  # results of `_header`; else the header's size in bytes


class Frame(NamedTuple):
    """One frame that passed its checksum."""

    mid: int
    payload: bytes
    bus: int = BUS_ID


class MtFrames(NamedTuple):
    """Complete frames: `bus` (n,), identifier `mid` (n,), and first byte `body` (n,) and `length` (n,) of the payload in `stream`.

    `end` (n,): index, in the bytes just fed, after the byte that completed the frame. That is the frame's last byte, or the last byte of a false
    frame that began before it and had to be rejected first.
    """

    stream: Octets
    bus: Ints
    mid: Ints
    body: Ints
    length: Ints
    end: Ints


@dataclass(slots=True)
class MtFrameCounts:
    """Bytes that belong to no frame, and frames with a wrong checksum."""

    skipped_bytes: int = 0
    bad_checksum: int = 0


def encode_frame(mid: int, payload: bytes = b"", bus_id: int = BUS_ID) -> bytes:
    """One frame with its checksum; raises ValueError for a payload that is too long."""
    if len(payload) > LONGEST:
        raise ValueError(f"{len(payload)} bytes do not fit an Xsens frame")
    length = bytes([len(payload)]) if len(payload) < EXTENDED else bytes([EXTENDED]) + len(payload).to_bytes(2, "big")
    body = bytes([bus_id, mid]) + length + payload
    return bytes([PREAMBLE]) + body + bytes([-sum(body) & 0xFF])


@dataclass(slots=True)
class FrameReader:
    """Frames of a byte stream. After a rejected frame, the next preamble is searched inside it.

    `longest`: payload of a frame, bytes. Short on a live port: a false preamble must not hold back the samples that follow it.
    """

    longest: int = MAX_LENGTH
    counts: MtFrameCounts = field(default_factory=MtFrameCounts)
    _rest: bytes = b""

    @property
    def pending(self) -> int:
        """Bytes of the unfinished frame."""
        return len(self._rest)

    def scan(self, received: bytes, *, ended: bool = False) -> MtFrames:
        """Frames completed by these bytes. `ended`: no byte follows, so a frame that is still unfinished is rejected and searched inside."""
        stream = np.frombuffer(self._rest + received, np.uint8)
        rows = np.empty((len(stream) // SHORTEST, _COLUMNS), np.int64)
        tally = np.zeros(_TALLY, np.int64)
        count, resume = _find_frames(stream, ended, self.longest, rows, tally)
        self.counts.skipped_bytes += int(tally[SKIPPED])
        self.counts.bad_checksum += int(tally[BAD_CHECKSUM])
        before = len(self._rest)
        self._rest = stream[resume:].tobytes()
        bus, mid, body, length, certain = np.ascontiguousarray(rows[:count].T)
        return MtFrames(stream, bus, mid, body, length, certain - before)

    def feed(self, received: bytes, *, ended: bool = False) -> list[Frame]:
        """Frames completed by these bytes, one by one."""
        frames = self.scan(received, ended=ended)
        columns = (frames.bus, frames.mid, frames.body, frames.length)
        rows = zip(*(column.tolist() for column in columns), strict=True)
        return [Frame(mid, frames.stream[body : body + length].tobytes(), bus) for bus, mid, body, length in rows]


def copy_payloads(stream: Octets, begin: Ints, length: int) -> Octets:
    """Copy of the `length` bytes that follow each index of `begin` (n,), as rows (n, length)."""
    return stream[begin[:, np.newaxis] + np.arange(length)]


@kernel
def _find_frames(stream: Octets, ended: bool, longest: int, rows: Ints, tally: Ints) -> tuple[int, int]:
    """Fill `rows` (n, 5) with the columns `_BUS` to `_CERTAIN`; returns the number of frames, and where the unfinished frame begins.

    After a rejected frame the search continues one byte later. Running sums make each checksum two look-ups, so noise full of preambles costs no more
    than frames.
    """
    size, sums = len(stream), _running_sums(stream)
    count, begin, certain = 0, 0, 0
    while begin < size:
        head, length = _header(stream, begin, longest)
        if head == _NO_HEADER:
            certain = max(certain, begin + length)
            tally[SKIPPED] += 1
            begin += 1
            continue
        end = begin + head + length + 1
        if head == _UNFINISHED or end > size:
            if not ended:
                break
            tally[SKIPPED] += 1
            certain, begin = size, begin + 1
            continue
        certain = max(certain, end)
        if sums[end] != sums[begin + 1]:
            tally[BAD_CHECKSUM] += 1
            tally[SKIPPED] += 1
            begin += 1
            continue
        rows[count, _BUS], rows[count, _MID] = stream[begin + 1], stream[begin + 2]
        rows[count, _BODY], rows[count, _LENGTH], rows[count, _CERTAIN] = begin + head, length, certain
        count += 1
        begin = end
    return count, begin


@part
def _running_sums(stream: Octets) -> Octets:
    """Sums mod 256 (n + 1,) of the first k bytes."""
    sums = np.empty(len(stream) + 1, np.uint8)
    running = 0
    for k in range(len(stream)):
        sums[k] = running
        running = (running + stream[k]) & 0xFF
    sums[len(stream)] = running
    return sums


@part
def _header(stream: Octets, begin: int, longest: int) -> tuple[int, int]:
    """Size of the header at `begin` and length of the payload; `_UNFINISHED` when bytes are missing.

    `_NO_HEADER` with the number of bytes that show it: no preamble, an impossible bus, or an impossible extended length.
    """
    have = len(stream) - begin
    if stream[begin] != PREAMBLE:
        return _NO_HEADER, 1
    if have > 1 and stream[begin + 1] != BUS_ID and not FIRST_BUS <= stream[begin + 1] <= LAST_BUS:
        return _NO_HEADER, 2
    if have < 4:
        return _UNFINISHED, 0
    length = int(np.int64(stream[begin + 3]))
    if length != EXTENDED:
        return 4, length
    if have < 6:
        return _UNFINISHED, 0
    length = int(np.int64(stream[begin + 4]) << 8 | np.int64(stream[begin + 5]))
    return (_NO_HEADER, 6) if length < EXTENDED or length > longest else (6, length)
