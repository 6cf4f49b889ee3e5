"""MTData2 (0x36), the measurement message of the MTi 10, 100 and 1 series: packets that name themselves.

In: frames. Out: the same values as from MTData, frame by frame. Owns nothing; every other packet is passed over (packets.py reads them all).
A packet is a big-endian u16 identifier, a length byte and its values; the identifier's low bits give the number format (0, 1) and the world (2, 3)
[LLCP, MTData2 and data identifiers].
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Floats, Ints, Octets
from echostep.jit import kernel
from echostep.xsens.axes import from_euler, from_matrix, to_mt_world
from echostep.xsens.frames import payloads_at
from echostep.xsens.mtdata import ACCEL, ATTITUDE, CELSIUS, COLUMNS, GYRO, MAG, Decoded

FLOAT32, FP1220, FP1632, FLOAT64 = 0, 1, 2, 3  # low two bits of an identifier
WIDTHS = (4, 4, 6, 8)
TYPE_MASK, WORLD_MASK, FORMAT_MASK = 0xFFF0, 0x000C, 0x0003

# What a sample is made of: identifier and number of values.
_TEMPERATURE, _COUNTER, _QUATERNION, _MATRIX, _EULER, _ACCEL, _GYRO, _MAG = range(8)
_TYPES = np.array([0x0810, 0x1020, 0x2010, 0x2020, 0x2030, 0x4020, 0x8020, 0xC020])
_VALUES = np.array([1, 1, 4, 9, 3, 3, 3, 3])
_COLUMNS = {_TEMPERATURE: slice(CELSIUS, CELSIUS + 1), _ACCEL: ACCEL, _GYRO: GYRO, _MAG: MAG}


class Places(NamedTuple):
    """Where each quantity begins in the stream (n, 8), 0 if it was not sent; the low bits of its identifier (n, 8);
    whether the packets fill the frame (n,).
    """

    at: Ints
    bits: Ints
    whole: Bools


def find_packets(stream: Octets, body: Ints, length: Ints) -> Places:
    """Places of the quantities of a sample in payloads that begin at `body` (n,) and are `length` (n,) long."""
    places = Places(
        np.zeros((len(body), len(_TYPES)), np.int64),
        np.zeros((len(body), len(_TYPES)), np.int64),
        np.zeros(len(body), np.bool_),
    )
    _find(stream, body, length, _TYPES, _VALUES, *places)
    return places


@kernel
def _find(
    stream: Octets, body: Ints, length: Ints, types: Ints, values: Ints, at: Ints, bits: Ints, whole: Bools
) -> None:
    for k in range(len(body)):
        here, end = body[k], body[k] + length[k]
        fits = True
        while fits and here + 3 <= end:
            identifier = (np.int64(stream[here]) << 8) | np.int64(stream[here + 1])
            size = np.int64(stream[here + 2])
            here += 3
            for j in range(len(types)):
                if identifier & 0xFFF0 == types[j]:
                    form = identifier & 3
                    width = 2 if types[j] == 0x1020 else (4 if form < 2 else 2 + 2 * form)
                    fits = fits and size == width * values[j] and identifier & 0xC != 0xC  # there is no fourth world
                    at[k, j], bits[k, j] = here, identifier & 0xF
            here += size
        whole[k] = fits and here == end
        if not whole[k]:
            at[k] = 0


def decode_mtdata2(stream: Octets, places: Places) -> Decoded:
    """Values of the payloads whose packets lie at these places."""
    count = len(places.at)
    values = np.full((count, COLUMNS), np.nan)
    counter = np.full(count, -1, np.int64)
    for quantity in range(len(_TYPES)):
        sent = np.flatnonzero(places.at[:, quantity])
        if not len(sent):
            continue
        bits = places.bits[sent, quantity]
        for low in np.unique(bits).tolist():
            which = sent[bits == low]
            at = places.at[which, quantity]
            if quantity == _COUNTER:
                counter[which] = payloads_at(stream, at, 2).view(">u2")[:, 0]
                continue
            form = low & FORMAT_MASK
            numbers = read_numbers(payloads_at(stream, at, int(_VALUES[quantity]) * WIDTHS[form]), form)
            if quantity in _COLUMNS:
                values[which, _COLUMNS[quantity]] = numbers
            else:
                values[which, ATTITUDE] = to_mt_world(_quaternions(quantity, numbers), low & WORLD_MASK)
    oriented = (places.at[:, _QUATERNION : _EULER + 1] > 0).any(axis=1)
    return Decoded(values, counter, np.column_stack([places.at[:, _ACCEL:] > 0, oriented]))


def _quaternions(quantity: int, numbers: Floats) -> Floats:
    if quantity == _QUATERNION:
        return numbers
    return from_matrix(numbers) if quantity == _MATRIX else from_euler(numbers)


def read_numbers(rows: Octets, form: int) -> Floats:
    """Numbers (n, k) of rows of bytes (n, k * width): float32, 12.20, 16.32 (fraction first), double [LLCP, output formats]."""
    with np.errstate(invalid="ignore"):  # a damaged float may be a signalling NaN
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
