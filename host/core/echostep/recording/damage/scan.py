# SPDX-License-Identifier: MIT
"""Where the valid records of a possibly damaged MCAP file are [MCAP format specification, mcap.dev/spec].

In: the bytes of a file. Out: offsets of records, and of the next valid ones after damage. Owns nothing.

A record is valid when its opcode and its length are possible, and, for a message, when its channel is known; a private record, when no valid ones are
in it, and it is no message with one wrong bit. After any other record the scan goes on at the next offset from which several consecutive records are
valid.
"""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np

from echostep.arrays import Bools, Octets
from echostep.errors import EchostepError
from echostep.jit import kernel, part
from echostep.recording.mcap_records import HEAD_SIZE, MCAP_MAGIC, MESSAGE, MESSAGE_SIZE, RECORD_LIMIT, read_uint

# [MCAP format specification]
CHUNK, CHUNK_HEAD = 0x06, HEAD_SIZE + 40  # opcode; bytes before the records of a chunk that is not compressed
# Of the specification; the first of other programs, and of the place that `open_chunk` keeps for a chunk's head
LAST_OPCODE, PRIVATE = 0x0F, 0x80
# Assumed.
VALID_RUN = 4  # this many consecutive records are not valid by chance
OTHER_LIMIT = 1 << 20  # bytes; only messages and chunk records are larger
# Bytes; a larger message must be followed by a possible record: one wrong bit of its length would swallow many others
LARGE = 1 << 12


def map_file(path: Path) -> Octets:
    """The bytes of a file, mapped into memory; raises EchostepError when it cannot be read or is empty."""
    try:
        if not path.stat().st_size:
            raise EchostepError(f"{path}: not a recording: the file is empty")
        return np.memmap(path, np.uint8, "r")
    except (OSError, ValueError) as error:
        raise EchostepError(
            f"{path}: cannot read the recording: {getattr(error, 'strerror', None) or error}"
        ) from error


@kernel
def record_end(file: Octets, begin: int, is_channel: Bools) -> int:
    """Offset after the record at `begin`; -1 when that record is not valid."""
    end = _possible_end(file, begin, is_channel)
    if end < 0 or file[begin] < PRIVATE or (file[begin] == PRIVATE and end == begin + CHUNK_HEAD):
        return end
    for inside in range(begin + HEAD_SIZE, end):
        if _is_run(file, inside, is_channel):
            return -1
    return end


@part
def _is_run(file: Octets, begin: int, is_channel: Bools) -> bool:
    """Whether `VALID_RUN` consecutive records, or all up to the end, are possible from `begin` on."""
    offset, records = begin, 0
    while records < VALID_RUN and offset >= 0:
        offset = _possible_end(file, offset, is_channel)
        records += 1
        if offset == len(file) or offset == len(file) - len(MCAP_MAGIC):
            return True
    return offset >= 0


@part
def _possible_end(file: Octets, begin: int, is_channel: Bools) -> int:
    """Offset after the record at `begin`; -1 when its head is impossible."""
    body = begin + HEAD_SIZE
    if body > len(file):
        return -1
    opcode, length = file[begin], read_uint(file, begin + 1, 8)
    if not _is_opcode(opcode) or not 0 <= length <= min(RECORD_LIMIT, len(file) - body):
        return -1
    is_message = length >= MESSAGE_SIZE and is_channel[read_uint(file, body, 2)]
    if opcode == MESSAGE:
        possible = is_message and (length <= LARGE or _may_follow(file, body + length))
    elif opcode > LAST_OPCODE:
        possible = (
            length <= OTHER_LIMIT
            and not (opcode - PRIVATE == MESSAGE and is_message)
            and _may_follow(file, body + length)
        )
    else:
        possible = opcode == CHUNK or length <= OTHER_LIMIT
    return body + length if possible else -1


@part
def _is_opcode(opcode: int) -> bool:
    return 1 <= opcode <= LAST_OPCODE or opcode >= PRIVATE


@part
def _may_follow(file: Octets, begin: int) -> bool:
    """Whether the file ends at `begin`, or a record may begin there; its body may be missing."""
    if begin + HEAD_SIZE > len(file):
        return True
    return _is_opcode(file[begin]) and 0 <= read_uint(file, begin + 1, 8) <= RECORD_LIMIT


@kernel
def begin_in_chunk(file: Octets, begin: int) -> int:
    """Offset of the first record of the chunk at `begin` if it is not compressed, whatever its length; -1 if there is none."""
    records = begin + CHUNK_HEAD
    is_plain = records <= len(file) and file[begin] == CHUNK and read_uint(file, records - 12, 4) == 0
    return records if is_plain else -1


def chunk_matches(file: Octets, records: int, end: int) -> bool:
    """Whether the records of a chunk that is not compressed, up to its end, are those that were written."""
    expected = int.from_bytes(file[records - 16 : records - 12].tobytes(), "little")
    return not expected or zlib.crc32(file[records:end].data) == expected


@kernel
def next_valid_run(file: Octets, first: int, is_channel: Bools) -> int:
    """Smallest offset >= `first` from which `VALID_RUN` consecutive records, or all up to the end, are valid; the file's length if none."""
    for begin in range(first, len(file) - HEAD_SIZE + 1):
        if _is_run(file, begin, is_channel):
            return begin
    return len(file)
