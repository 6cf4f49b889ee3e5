"""Records of an MCAP file [MCAP format specification, mcap.dev/spec]: runs of messages as columns, other records as opcode and body.

In: bytes of a file, possibly damaged or hostile. Out: `Portion`s of the ports' messages, and records. Owns nothing.
Messages of other channels than the ports' are skipped. Chunk records, compressed or not, are decompressed.

    record   opcode u8 | length u64 | body                                     HEAD_SIZE = 9 bytes before the body
    message  channel u16 | sequence u32 | log time u64 | publish time u64 | data      opcode MESSAGE, MESSAGE_SIZE = 22 bytes before the data
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
from mcap.records import Chunk as ChunkRecord

from echostep.arrays import Ints, Octets
from echostep.jit import kernel
from echostep.ports.chunks import LATEST_NS, Portion

# Layout of the records, bytes [MCAP format specification].
MCAP_MAGIC = b"\x89MCAP0\r\n"
HEAD_SIZE = 9
MESSAGE = 0x05  # opcode
MESSAGE_SIZE = 22
LOG_TIME_OFFSET = 6  # in the body of a message
CHANNEL_IDS = 1 << 16  # a channel number has 16 bits
_HEAD = struct.Struct("<BQ")

RAW_ENCODING = "application/octet-stream"  # message encoding of the ports' channels
# By reason: bounds the memory that a damaged file can ask for.
RECORD_LIMIT = 1 << 28  # bytes of one record, and of one decompressed chunk
ZSTD_WINDOW = 1 << 27  # bytes

Record = TypeVar("Record", Header, Schema, Channel, Metadata, ChunkRecord)


@dataclass
class PortChannels:
    """Ports of the channels read so far: `names`, and by channel number the index into `names`; -1 for a channel of no port."""

    names: tuple[str, ...] = ()
    port_of_channel: Ints = field(default_factory=lambda: np.full(CHANNEL_IDS, -1, np.int64))

    def add(self, body: bytes) -> None:
        """Add the channel of a channel record, if it carries a port's bytes."""
        if (channel := parse_record(Channel, body)) and (name := port_of(channel)):
            self.names = tuple(dict.fromkeys((*self.names, name)))
            self.port_of_channel[channel.id] = self.names.index(name)


def port_of(channel: Channel) -> str:
    """Name of the port whose bytes a channel carries; empty for any other channel."""
    if channel.message_encoding != RAW_ENCODING or not channel.topic.endswith("/bytes"):
        return ""
    return channel.topic.removeprefix("/").removesuffix("/bytes")


def read_record(buffer: bytes, offset: int) -> tuple[tuple[int, bytes] | None, int]:
    """Opcode and body of the record at `offset`, and 0; None and the number of missing bytes when the buffer ends before the record."""
    if len(buffer) - offset < HEAD_SIZE:
        return None, offset + HEAD_SIZE - len(buffer)
    opcode, length = _HEAD.unpack_from(buffer, offset)
    body = buffer[offset + HEAD_SIZE : offset + HEAD_SIZE + length]
    return ((opcode, body), 0) if len(body) == length else (None, length - len(body))


def read_messages(buffer: bytes, offset: int, channels: PortChannels) -> tuple[Portion | None, int]:
    """The ports' messages among the consecutive complete message records from `offset` on, and the offset after these records."""
    most = (len(buffer) - offset) // (HEAD_SIZE + MESSAGE_SIZE)
    port, t_arrival_ns, start, end = (np.empty(most, np.int64) for _ in range(4))
    count, offset = _read_message_run(
        np.frombuffer(buffer, np.uint8), offset, channels.port_of_channel, port, t_arrival_ns, start, end
    )
    portion = Portion(channels.names, port[:count], t_arrival_ns[:count], start[:count], end[:count], buffer)
    return (portion if count else None), offset


def decompress_chunk(body: bytes) -> bytes | None:
    """The records in a chunk record; None when it is damaged, larger than `RECORD_LIMIT` or compressed in an unknown way."""
    chunk = parse_record(ChunkRecord, body)
    if chunk is None or chunk.uncompressed_size > RECORD_LIMIT:
        return None
    try:
        records = _decompress(chunk.compression, chunk.data, chunk.uncompressed_size)
    except (zstandard.ZstdError, RuntimeError, EOFError, MemoryError):  # RuntimeError: lz4
        return None
    if records is None or len(records) != chunk.uncompressed_size:
        return None
    return records if not chunk.uncompressed_crc or zlib.crc32(records) == chunk.uncompressed_crc else None


def _decompress(compression: str, compressed: bytes, size: int) -> bytes | None:
    """At most `size` + 1 bytes: one byte too many shows that the stated size is wrong. None for an unknown compression."""
    if compression == "zstd":
        with zstandard.ZstdDecompressor(max_window_size=ZSTD_WINDOW).stream_reader(compressed) as stream:
            return stream.read(size + 1)
    if compression == "lz4":
        return bytes(lz4.frame.LZ4FrameDecompressor().decompress(compressed, max_length=size + 1))
    return compressed if not compression else None


def records_in_chunk(buffer: bytes, channels: PortChannels) -> Iterator[Portion | tuple[int, bytes]]:
    """Portions and other records (opcode, body) of a decompressed chunk, in order."""
    offset = 0
    while True:
        portion, offset = read_messages(buffer, offset, channels)
        if portion:
            yield portion
        record, _ = read_record(buffer, offset)
        if record is None:
            return
        opcode, body = record
        if opcode == Opcode.CHANNEL:
            channels.add(body)
        yield record
        offset += HEAD_SIZE + len(body)


@kernel
def _read_message_run(
    buffer: Octets, offset: int, port_of_channel: Ints, port: Ints, t_arrival_ns: Ints, start: Ints, end: Ints
) -> tuple[int, int]:
    """Fill the columns of a portion from consecutive message records; returns the number of rows, and the offset of the first other record."""
    count = 0
    while offset + HEAD_SIZE <= len(buffer) and buffer[offset] == MESSAGE:
        length = read_uint(buffer, offset + 1, 8)
        body = offset + HEAD_SIZE
        if not 0 <= length <= len(buffer) - body:
            break
        offset = body + length
        if length >= MESSAGE_SIZE and port_of_channel[read_uint(buffer, body, 2)] >= 0:
            port[count] = port_of_channel[read_uint(buffer, body, 2)]
            log_time_ns = read_uint(buffer, body + LOG_TIME_OFFSET, 8)
            t_arrival_ns[count] = log_time_ns if 0 <= log_time_ns <= LATEST_NS else LATEST_NS
            start[count], end[count] = body + MESSAGE_SIZE, offset
            count += 1
    return count, offset


@kernel
def read_uint(buffer: Octets, offset: int, size: int) -> int:
    """A little-endian unsigned number of `size` bytes; negative from 2^63 on."""
    value = 0
    for k in range(size):
        value |= (buffer[offset + k] & 0xFF) << 8 * k
    return value


def parse_record(kind: type[Record], body: bytes) -> Record | None:
    """A record as the MCAP library parses it; None when the body is damaged."""
    try:
        return kind.read(ReadDataStream(BytesIO(body)))
    except (McapError, struct.error, UnicodeDecodeError, OverflowError, MemoryError):
        return None
