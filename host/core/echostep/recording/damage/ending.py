# SPDX-License-Identifier: MIT
"""Evidence at the end of an MCAP file about the bytes before it [MCAP format specification, mcap.dev/spec].

In: the bytes of a file, possibly damaged. Out: whether its data section is as written, and the channels and schemas repeated after it. Owns
nothing.

A closed file ends like this; both checksums are CRC-32:

    data section | data end: checksum of all before | summary: schemas, channels, ... | footer: start of the summary, its checksum | magic

A data section with the right checksum is whole, whatever has become of the bytes after it. If it is damaged, the channels in a summary with the
right checksum are believed, not the channels between the messages.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

import numpy as np
from mcap.opcode import Opcode

from echostep.arrays import Octets
from echostep.recording.damage.scan import record_end
from echostep.recording.mcap_records import CHANNEL_IDS, HEAD_SIZE, MCAP_MAGIC

# [MCAP format specification]
FOOTER_SIZE = 20  # bytes of its body: start of the summary u64, start of its offsets u64, checksum u32
DATA_END_SIZE = 4  # bytes of its body: the checksum, 0 for none
CRC_SIZE = 4
CHECKSUM_BYTES = 1 << 20  # of one call: Ctrl-C is seen between two
# A beginning that differs from the magic bytes in at most this many bits is damaged, not another format; assumed
MAGIC_BITS = 8


@dataclass(frozen=True, slots=True)
class Ending:
    """`data_end`: offset of the data-end record, -1 if the footer lacks it; `summary`: opcode and body of the records after it.

    `trusted`: the checksum of the summary is right.
    """

    data_end: int = -1
    summary: tuple[tuple[int, bytes], ...] = ()
    trusted: bool = False


def begins_as_mcap(file: Octets | bytes) -> bool:
    """Whether a file begins with the magic bytes, but for some flipped bits."""
    begin = bytes(file[: len(MCAP_MAGIC)])
    if len(begin) < len(MCAP_MAGIC):
        return False
    return sum((a ^ b).bit_count() for a, b in zip(begin, MCAP_MAGIC, strict=True)) <= MAGIC_BITS


def read_ending(file: Octets) -> Ending:
    """The end of a file; nothing is known without a footer."""
    footer = len(file) - len(MCAP_MAGIC) - FOOTER_SIZE - HEAD_SIZE
    if footer < len(MCAP_MAGIC) or file[footer] != Opcode.FOOTER:
        return Ending()
    end = footer + HEAD_SIZE + FOOTER_SIZE
    begin, _, summary_crc = struct.unpack("<QQI", file[footer + HEAD_SIZE : end].tobytes())
    data_end = (begin or footer) - HEAD_SIZE - DATA_END_SIZE
    if not len(MCAP_MAGIC) <= data_end < footer:
        return Ending()
    trusted = not summary_crc or zlib.crc32(file[begin or footer : end - CRC_SIZE].tobytes()) == summary_crc
    return Ending(data_end, _records(file, begin or footer, footer), trusted)


def checksum_matches(file: Octets, data_end: int) -> bool | None:
    """Whether the bytes before the data-end record at this offset are those that were written; None without a checksum.

    Checksums that differ in one bit match: that bit of the stored one was flipped. A single flipped bit before it has this effect only at a distance
    of 512 MB, the period of CRC-32.
    """
    body = data_end + HEAD_SIZE
    expected = int.from_bytes(file[body : body + DATA_END_SIZE].tobytes(), "little")
    if not expected:
        return None
    crc = 0
    for begin in range(0, data_end, CHECKSUM_BYTES):
        crc = zlib.crc32(file[begin : min(begin + CHECKSUM_BYTES, data_end)].data, crc)
    return (crc ^ expected).bit_count() <= 1


def _records(file: Octets, begin: int, footer: int) -> tuple[tuple[int, bytes], ...]:
    """Opcode and body of the records of the summary, up to the first damaged one."""
    no_channel, records = np.zeros(CHANNEL_IDS, np.bool_), []
    while begin < footer and (end := record_end(file, begin, no_channel)) >= 0:
        records.append((int(file[begin]), file[begin + HEAD_SIZE : end].tobytes()))
        begin = end
    return tuple(records)
