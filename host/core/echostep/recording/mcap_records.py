# SPDX-License-Identifier: MIT
"""Records of an MCAP file [MCAP format specification, mcap.dev/spec]: their layout, parsing and decompression.

In: bytes of records, possibly damaged or hostile. Out: records as the MCAP library has them, and the bytes in chunk records. Owns nothing.

    record   opcode u8 | length u64 | body                                     HEAD_SIZE = 9 bytes before the body
    message  channel u16 | sequence u32 | log time u64 | publish time u64 | data      opcode MESSAGE, MESSAGE_SIZE = 22 bytes before the data
    chunk    times 2 u64 | size u64 | checksum u32 | compression u32, name | length u64 | records
"""

from __future__ import annotations

import struct
import zlib
from io import BytesIO
from typing import TypeVar

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.records import Channel, Header, Metadata, Schema
from mcap.records import Chunk as ChunkRecord

from echostep.arrays import Octets
from echostep.jit import part

# Layout of the records, bytes [MCAP format specification].
MCAP_MAGIC = b"\x89MCAP0\r\n"
HEAD_SIZE = 9
MESSAGE = 0x05  # opcode
MESSAGE_SIZE = 22
SEQUENCE_OFFSET = 2  # in the body of a message
LOG_TIME_OFFSET = 6  # in the body of a message
CHANNEL_IDS = 1 << 16  # a channel number has 16 bits

METADATA_NAME = "echostep"  # of the metadata record
# Of a second one, at the end: damage of the recording from which this one was made
DAMAGE_NAME = "echostep.damage"
PART_NAME = "echostep.part"  # of a record at the end of a part: the next file, as the value of `NEXT`
RUN, PART, NEXT = "run", "part", "next"  # metadata keys of a recording in parts: its first file, the number of the part
LIBRARY = "echostep"  # in the header: it numbers the messages of all channels together
RAW_ENCODING = "application/octet-stream"  # message encoding of the ports' channels
# Assumed: bounds the memory that a damaged file can ask for.
RECORD_LIMIT = 1 << 28  # bytes of one record, and of one decompressed chunk
ZSTD_WINDOW = 1 << 27  # bytes

Record = TypeVar("Record", Header, Schema, Channel, Metadata, ChunkRecord)


def port_of(channel: Channel) -> str:
    """Name of the port whose bytes a channel carries; empty for any other channel."""
    if channel.message_encoding != RAW_ENCODING or not channel.topic.endswith("/bytes"):
        return ""
    return channel.topic.removeprefix("/").removesuffix("/bytes")


def is_misnamed(channel: Channel) -> bool:
    """Whether a channel has either the encoding or the name of a port's, not both."""
    return (channel.message_encoding == RAW_ENCODING) != channel.topic.endswith("/bytes")


def decompress_chunk(body: bytes) -> bytes | None:
    """The records in a compressed chunk; None when it is larger than `RECORD_LIMIT`, cannot be opened, or its checksum is wrong."""
    chunk = parse_record(ChunkRecord, body)
    if chunk is None or chunk.uncompressed_size > RECORD_LIMIT:
        return None
    most, records = chunk.uncompressed_size + 1, b""  # one byte too many shows that the stated size is wrong
    try:
        if chunk.compression == "zstd":
            with zstandard.ZstdDecompressor(max_window_size=ZSTD_WINDOW).stream_reader(chunk.data) as stream:
                records = stream.read(most)
        elif chunk.compression == "lz4":
            records = bytes(lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=most))
    except (zstandard.ZstdError, RuntimeError, EOFError, MemoryError):  # RuntimeError: lz4
        return None
    whole = len(records) == chunk.uncompressed_size and chunk.uncompressed_crc in (0, zlib.crc32(records))
    return records if whole else None


@part
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
