# SPDX-License-Identifier: MIT
"""Where the valid records of a possibly damaged MCAP file are [MCAP format specification, mcap.dev/spec].

In: the bytes of a file. Out: offsets of records, and of the next valid ones behind damage. Owns nothing.

A record is valid when its opcode and its length are possible, and, for a message, when its channel is known. After any other record the scan goes on
at the next offset from which several consecutive records are valid.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from mcap.opcode import Opcode

from echostep.arrays import Bools, Octets
from echostep.errors import EchostepError
from echostep.jit import kernel
from echostep.recording.mcap_records import (
    CHANNEL_IDS,
    HEAD_SIZE,
    MCAP_MAGIC,
    MESSAGE,
    MESSAGE_SIZE,
    RECORD_LIMIT,
    read_uint,
)

# [MCAP format specification]
CHUNK = 0x06  # opcode
LAST_OPCODE = 0x0F
FOOTER_SIZE = 20  # bytes of its body
DATA_END_SIZE = 4  # bytes of its body: the checksum of all bytes before it, 0 for none
# Assumed.
VALID_RUN = 4  # so many consecutive records are not valid by chance
OTHER_LIMIT = 1 << 20  # bytes; only messages and chunk records are larger
LARGE = (
    1 << 12
)  # bytes; a larger message must be followed by a possible record: one wrong bit of its length would swallow many others
CHECKSUM_BYTES = 1 << 20  # of one call: Ctrl-C is seen between two


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


def summary(file: Octets) -> Iterator[tuple[int, bytes]]:
    """Opcode and body of the records at the end of a closed file; it repeats channels and schemas there, in case its beginning is damaged."""
    footer = len(file) - len(MCAP_MAGIC) - FOOTER_SIZE - HEAD_SIZE
    ends_as_mcap = file[-len(MCAP_MAGIC) :].tobytes() == MCAP_MAGIC
    if footer < len(MCAP_MAGIC) or not ends_as_mcap or file[footer] != Opcode.FOOTER:
        return
    begin = read_uint(file, footer + HEAD_SIZE, 8)
    no_channel = np.zeros(CHANNEL_IDS, np.bool_)
    while len(MCAP_MAGIC) <= begin < footer and (end := record_end(file, begin, no_channel)) >= 0:
        yield int(file[begin]), file[begin + HEAD_SIZE : end].tobytes()
        begin = end


def checksum_differs(file: Octets, data_end: int) -> bool:
    """Whether the bytes before the data-end record at this offset are others than those that were written; False without a checksum."""
    body = data_end + HEAD_SIZE
    expected = int.from_bytes(file[body : body + DATA_END_SIZE].tobytes(), "little")
    crc = 0
    for begin in range(0, data_end if expected else 0, CHECKSUM_BYTES):
        crc = zlib.crc32(file[begin : min(begin + CHECKSUM_BYTES, data_end)], crc)  # type: ignore[arg-type]
    return crc != expected


@kernel
def record_end(file: Octets, begin: int, is_channel: Bools) -> int:
    """Offset after the record at `begin`; -1 when that record is not valid."""
    body = begin + HEAD_SIZE
    if body > len(file):
        return -1
    opcode, length = file[begin], read_uint(file, begin + 1, 8)
    if not 1 <= opcode <= LAST_OPCODE or not 0 <= length <= min(RECORD_LIMIT, len(file) - body):
        return -1
    if opcode == MESSAGE:
        if length < MESSAGE_SIZE or not is_channel[read_uint(file, body, 2)]:
            return -1
        return body + length if length <= LARGE or _may_follow(file, body + length) else -1
    return body + length if opcode == CHUNK or length <= OTHER_LIMIT else -1


@kernel
def _may_follow(file: Octets, begin: int) -> bool:
    """Whether the file ends at `begin`, or a record may begin there; its body may be missing."""
    if begin + HEAD_SIZE > len(file):
        return True
    return 1 <= file[begin] <= LAST_OPCODE and 0 <= read_uint(file, begin + 1, 8) <= RECORD_LIMIT


@kernel
def next_valid_run(file: Octets, first: int, is_channel: Bools) -> int:
    """Smallest offset >= `first` from which `VALID_RUN` consecutive records, or all up to the end, are valid; the file's length if there is none."""
    for begin in range(first, len(file) - HEAD_SIZE + 1):
        offset, records = begin, 0
        while records < VALID_RUN and offset >= 0:
            offset = record_end(file, offset, is_channel)
            records += 1
            if offset == len(file) or offset == len(file) - len(MCAP_MAGIC):
                return begin
        if offset >= 0:
            return begin
    return len(file)
