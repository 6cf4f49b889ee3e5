# SPDX-License-Identifier: MIT
"""MTData2 (0x36), the measurement message of the MTi 10, 100 and 1 series: a list of packets with identifiers.

In: frames. Out: the same values as from MTData, frame by frame. Owns nothing. Packets of other quantities are skipped (packets.py reads them all).
A packet is a big-endian u16 identifier, a length byte and its values; the identifier's low bits give the number format (0, 1) and the world (2, 3)
[LLCP, MTData2 and data identifiers].
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Floats, Ints, Octets
from echostep.jit import kernel
from echostep.xsens.axes import from_values, to_mt_world
from echostep.xsens.frames import copy_payloads
from echostep.xsens.mtdata import ACCEL, ATTITUDE, CELSIUS, COLUMNS, GYRO, MAG, Decoded

FLOAT32, FP1220, FP1632, FLOAT64 = 0, 1, 2, 3  # low two bits of an identifier
WIDTHS = (4, 4, 6, 8)  # bytes of a number in each format
TYPE_MASK, WORLD_MASK, FORMAT_MASK = 0xFFF0, 0x000C, 0x0003

# The quantities of a sample: identifier and number of values [LLCP, MTData2].
_TEMPERATURE, _COUNTER, _QUATERNION, _MATRIX, _EULER, _ACCEL, _GYRO, _MAG = range(8)
_TYPES = np.array([0x0810, 0x1020, 0x2010, 0x2020, 0x2030, 0x4020, 0x8020, 0xC020])
_VALUES = np.array([1, 1, 4, 9, 3, 3, 3, 3])
_COLUMNS = {_TEMPERATURE: slice(CELSIUS, CELSIUS + 1), _ACCEL: ACCEL, _GYRO: GYRO, _MAG: MAG}


class PacketIndex(NamedTuple):
    """Per frame and quantity: `begin` (n, 8) of its values in the stream, 0 if not sent, and `bits` (n, 8), the low bits of its identifier.

    `whole` (n,): whether the packets fill the frame exactly.
    """

    begin: Ints
    bits: Ints
    whole: Bools


def find_packets(stream: Octets, body: Ints, length: Ints) -> PacketIndex:
    """Index of the quantities of a sample in payloads that begin at `body` (n,) and have `length` (n,) bytes."""
    packets = PacketIndex(
        np.zeros((len(body), len(_TYPES)), np.int64),
        np.zeros((len(body), len(_TYPES)), np.int64),
        np.zeros(len(body), np.bool_),
    )
    _fill_index(stream, body, length, packets)
    return packets


@kernel
def _fill_index(stream: Octets, body: Ints, length: Ints, packets: PacketIndex) -> None:
    """Fill `packets` from the packets of each frame; a frame with a wrong size or world has no quantity."""
    for k in range(len(body)):
        begin, end = body[k], body[k] + length[k]
        fits = True
        while fits and begin + 3 <= end:
            identifier = (np.int64(stream[begin]) << 8) | np.int64(stream[begin + 1])
            size = np.int64(stream[begin + 2])
            begin += 3
            for j in range(len(_TYPES)):
                if identifier & TYPE_MASK == _TYPES[j]:
                    form = identifier & FORMAT_MASK
                    width = 2 if j == _COUNTER else (4 if form < FP1632 else 2 + 2 * form)
                    known_world = identifier & WORLD_MASK != WORLD_MASK  # there is no fourth world
                    fits = fits and size == width * _VALUES[j] and known_world
                    packets.begin[k, j], packets.bits[k, j] = begin, identifier & (WORLD_MASK | FORMAT_MASK)
            begin += size
        packets.whole[k] = fits and begin == end
        if not packets.whole[k]:
            packets.begin[k] = 0


def decode_mtdata2(stream: Octets, packets: PacketIndex) -> Decoded:
    """Values of the payloads with these packets; packets of equal number format and world are decoded together."""
    count = len(packets.begin)
    values = np.full((count, COLUMNS), np.nan)
    counter = np.full(count, -1, np.int64)
    for quantity in range(len(_TYPES)):
        sent = np.flatnonzero(packets.begin[:, quantity])
        if not len(sent):
            continue
        bits = packets.bits[sent, quantity]
        for low in np.unique(bits).tolist():
            which = sent[bits == low]
            begin = packets.begin[which, quantity]
            if quantity == _COUNTER:
                counter[which] = copy_payloads(stream, begin, 2).view(">u2")[:, 0]
                continue
            form = low & FORMAT_MASK
            numbers = read_numbers(copy_payloads(stream, begin, int(_VALUES[quantity]) * WIDTHS[form]), form)
            if quantity in _COLUMNS:
                values[which, _COLUMNS[quantity]] = numbers
            else:
                values[which, ATTITUDE] = to_mt_world(from_values(numbers), low & WORLD_MASK)
    oriented = (packets.begin[:, _QUATERNION : _EULER + 1] > 0).any(axis=1)
    return Decoded(values, counter, np.column_stack([packets.begin[:, _ACCEL:] > 0, oriented]))


def read_numbers(rows: Octets, form: int) -> Floats:
    """Numbers (n, k) of rows of bytes (n, k * width): float32, 12.20, 16.32 (fraction first), double [LLCP, output formats]."""
    with np.errstate(invalid="ignore"):  # a damaged float can be a signalling NaN
        if form == FLOAT32:
            return rows.view(">f4").astype(np.float64)
        if form == FLOAT64:
            return rows.view(">f8").astype(np.float64)
    if form == FP1220:
        return rows.view(">i4") * 2.0**-20
    parts = rows.reshape(len(rows), -1, 6)
    fraction = np.ascontiguousarray(parts[:, :, :4]).view(">u4")[:, :, 0]
    whole = np.ascontiguousarray(parts[:, :, 4:]).view(">i2")[:, :, 0]
    return whole + fraction * 2.0**-32
