"""The records of an MCAP file: runs of messages as columns, all others as opcode and body.

In: bytes of a file, from anybody, with anything wrong in them. Out: `Portion`s of what the ports delivered, and records. Owns nothing.
Messages of other channels than the ports' bytes are passed over. Chunks, compressed or not, are opened.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from typing import TypeVar

import lz4.frame
import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Header, Metadata, Schema
from mcap.records import Chunk as Batch

from echostep.arrays import Ints, Octets
from echostep.jit import kernel
from echostep.ports.chunks import LATEST_NS, Portion

MCAP_MAGIC = b"\x89MCAP0\r\n"
RECORD_LIMIT = 1 << 28  # bytes of one record, of one chunk when opened
_HEAD = struct.Struct("<BQ")  # opcode, length
HEAD_SIZE = 9
MESSAGE = 0x05  # its opcode
MESSAGE_SIZE = 22  # channel u16, sequence u32, log time u64, publish time u64; the bytes follow
RAW_ENCODING = "application/octet-stream"

Record = TypeVar("Record", Header, Schema, Channel, Metadata, Batch)


@dataclass
class Ports:
    """The ports of the channels seen so far: their names, and by channel id the place among the names, -1: no port's channel."""

    names: tuple[str, ...] = ()
    of_channel: Ints = field(default_factory=lambda: np.full(1 << 16, -1, np.int64))

    def add(self, body: bytes) -> None:
        """Take a channel record into account, if it is one of a port's bytes."""
        if (found := parsed(Channel, body)) and (name := port_of(found)):
            self.names = tuple(dict.fromkeys((*self.names, name)))
            self.of_channel[found.id] = self.names.index(name)


def port_of(channel: Channel) -> str:
    """The port whose bytes a channel carries; empty for any other channel."""
    if channel.message_encoding != RAW_ENCODING or not channel.topic.endswith("/bytes"):
        return ""
    return channel.topic.removeprefix("/").removesuffix("/bytes")


def record_at(buffer: bytes, at: int) -> tuple[tuple[int, bytes] | None, int]:
    """Opcode and body of the record at `at`, or None and how many bytes are missing."""
    if len(buffer) - at < HEAD_SIZE:
        return None, at + HEAD_SIZE - len(buffer)
    opcode, length = _HEAD.unpack_from(buffer, at)
    body = buffer[at + HEAD_SIZE : at + HEAD_SIZE + length]
    return ((opcode, body), 0) if len(body) == length else (None, length - len(body))


def messages(buffer: bytes, at: int, ports: Ports) -> tuple[Portion | None, int]:
    """The ports' messages in the unbroken run of complete messages from `at` on, if there are any, and where it ends."""
    most = (len(buffer) - at) // (HEAD_SIZE + MESSAGE_SIZE)
    port, t_arrival_ns, start, end = (np.empty(most, np.int64) for _ in range(4))
    found, at = _sweep(np.frombuffer(buffer, np.uint8), at, ports.of_channel, port, t_arrival_ns, start, end)
    portion = Portion(ports.names, port[:found], t_arrival_ns[:found], start[:found], end[:found], buffer)
    return (portion if found else None), at


def opened(body: bytes) -> bytes | None:
    """The records inside a chunk; None when it is damaged, larger than anybody's or compressed in an unknown way."""
    batch = parsed(Batch, body)
    if batch is None or batch.uncompressed_size > RECORD_LIMIT:
        return None
    try:
        inside = _expanded(batch.compression, batch.data, batch.uncompressed_size)
    except (zstandard.ZstdError, RuntimeError, EOFError, MemoryError):  # RuntimeError: lz4
        return None
    if inside is None or len(inside) != batch.uncompressed_size:
        return None
    return inside if not batch.uncompressed_crc or zlib.crc32(inside) == batch.uncompressed_crc else None


def _expanded(compression: str, squeezed: bytes, size: int) -> bytes | None:
    """Never more than one byte more than is claimed, however much there is."""
    if compression == "zstd":
        with zstandard.ZstdDecompressor(max_window_size=1 << 27).stream_reader(squeezed) as stream:
            return stream.read(size + 1)
    if compression == "lz4":
        return bytes(lz4.frame.LZ4FrameDecompressor().decompress(squeezed, max_length=size + 1))
    return squeezed if not compression else None


def inside_of(buffer: bytes, ports: Ports) -> Iterator[Portion | tuple[int, bytes]]:
    """Portions and records of an opened chunk."""
    at = 0
    while True:
        portion, at = messages(buffer, at, ports)
        if portion:
            yield portion
        record, _ = record_at(buffer, at)
        if record is None:
            return
        if record[0] == Opcode.CHANNEL:
            ports.add(record[1])
        yield record
        at += HEAD_SIZE + len(record[1])


@kernel
def _sweep(
    buffer: Octets, at: int, port_of: Ints, port: Ints, t_arrival_ns: Ints, start: Ints, end: Ints
) -> tuple[int, int]:
    """Fill the columns from message records of the ports; returns how many there were, and where another record or the end came."""
    found = 0
    while at + HEAD_SIZE <= len(buffer) and buffer[at] == MESSAGE:
        length = number_at(buffer, at + 1, 8)
        body = at + HEAD_SIZE
        if not 0 <= length <= len(buffer) - body:
            break
        at = body + length
        if length >= MESSAGE_SIZE and port_of[number_at(buffer, body, 2)] >= 0:
            port[found] = port_of[number_at(buffer, body, 2)]
            log_time_ns = number_at(buffer, body + 6, 8)
            t_arrival_ns[found] = log_time_ns if 0 <= log_time_ns <= LATEST_NS else LATEST_NS
            start[found], end[found] = body + MESSAGE_SIZE, at
            found += 1
    return found, at


@kernel
def number_at(buffer: Octets, at: int, size: int) -> int:
    """A little-endian number; from 2^63 on negative."""
    value = 0
    for k in range(size):
        value |= (buffer[at + k] & 0xFF) << 8 * k
    return value


def parsed(kind: type[Record], body: bytes) -> Record | None:
    """A record by the library's own reader; None when the body is damaged."""
    try:
        return kind.read(ReadDataStream(BytesIO(body)))
    except (McapError, struct.error, UnicodeDecodeError, OverflowError, MemoryError):
        return None
