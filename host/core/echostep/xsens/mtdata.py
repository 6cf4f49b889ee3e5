# SPDX-License-Identifier: MIT
"""MTData (0x32), the measurement message of the MTi and the MTx, in every output mode and setting of an MTx.

In: payloads, and the output format that was set on the device, as the message does not contain it. Out: values in SI units. Owns nothing.
Order of a payload: temperature, calibrated (accel, gyro, mag), orientation, auxiliary, status, UTC time, sample counter [Manual 5.3.3, MTData].
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Floats, Ints, Octets
from echostep.xsens.axes import from_values

# Output mode [Manual 5.3.3, SetOutputMode; status: CMT].
TEMPERATURE, CALIBRATED, ORIENTATION, AUXILIARY, STATUS, RAW = 0x0001, 0x0002, 0x0004, 0x0008, 0x0800, 0x4000
# Output settings [Manual 5.3.3, SetOutputSettings; the second analog input: CMT].
SAMPLE_COUNTER, UTC = 0x0001, 0x0002
QUATERNION, EULER, MATRIX, ORIENTATION_MASK = 0x0000, 0x0004, 0x0008, 0x000C
NO_ACCEL, NO_GYRO, NO_MAG = 0x0010, 0x0020, 0x0040
FLOAT, FIXED_12_20, FORMAT_MASK = 0x0000, 0x0100, 0x0300
NO_ANALOG_1, NO_ANALOG_2 = 0x0400, 0x0800

_MODES = TEMPERATURE | CALIBRATED | ORIENTATION | AUXILIARY | STATUS | RAW
_SETTINGS = (
    SAMPLE_COUNTER | UTC | ORIENTATION_MASK | NO_ACCEL | NO_GYRO | NO_MAG | FORMAT_MASK | NO_ANALOG_1 | NO_ANALOG_2
)
_UNIT_12_20 = 2.0**-20
_ORIENTATION_VALUES = {QUATERNION: 4, EULER: 3, MATRIX: 9}
UTC_TIME = struct.Struct(">IH6B")  # ns, year, month, day, hour, minute, second, validity
RAW_BYTES = 20  # accel, gyro, mag and temperature as u16, not calibrated

# Columns of decoded values, the same for both measurement messages; NaN for a quantity that was not sent.
ACCEL, GYRO, MAG, ATTITUDE, CELSIUS, COLUMNS = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 13), 13, 14


Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


class MtSample(NamedTuple):
    """Counter (u16), accel m/s2, gyro rad/s, mag in units of the earth's field (sensor frame); quaternion w x y z (sensor -> MT world)."""

    counter: int
    accel: Vector
    gyro: Vector
    mag: Vector
    quaternion: Quaternion


class Decoded(NamedTuple):
    """`values` (n, 14): accel m/s2, gyro rad/s, mag, quaternion (sensor -> MT world), temperature degC.

    `counter` (n,): -1 where not sent. `sent` (n, 4): whether the message has accel, gyro, mag, orientation.
    """

    values: Floats
    counter: Ints
    sent: Bools


@dataclass(frozen=True)
class OutputFormat:
    """Output mode and settings as set by SetOutputMode and SetOutputSettings; raises ValueError for a format that no MTx has."""

    mode: int
    settings: int

    def __post_init__(self) -> None:
        """Raise ValueError for reserved bits, and for raw data together with any other."""
        if self.mode & ~_MODES:
            raise ValueError(f"output mode 0x{self.mode:04X} is not a mode of an MTx")
        if self.settings & ~_SETTINGS:
            raise ValueError(f"output settings 0x{self.settings:08X} are not settings of an MTx")
        if self.settings & ORIENTATION_MASK not in _ORIENTATION_VALUES:
            raise ValueError("output settings: quaternion, Euler angles or matrix")
        if self.settings & FORMAT_MASK not in (FLOAT, FIXED_12_20):
            raise ValueError("output settings: an MTx sends floats or fixed point 12.20")
        if self.mode & RAW and self.mode != RAW:
            raise ValueError("output mode: raw data come alone")

    @cached_property
    def calibrated(self) -> tuple[slice, ...]:
        """Columns of the calibrated quantities that are sent, in order."""
        pairs = ((NO_ACCEL, ACCEL), (NO_GYRO, GYRO), (NO_MAG, MAG))
        return tuple(columns for bit, columns in pairs if self.mode & CALIBRATED and not self.settings & bit)

    @cached_property
    def sent(self) -> Bools:
        """Whether accel, gyro, mag and orientation are sent (4,)."""
        return np.array([c in self.calibrated for c in (ACCEL, GYRO, MAG)] + [self.orientation_values > 0])

    @cached_property
    def orientation_values(self) -> int:
        """Number of values of the orientation: 0, 3, 4 or 9."""
        return _ORIENTATION_VALUES[self.settings & ORIENTATION_MASK] if self.mode & ORIENTATION else 0

    @cached_property
    def numbers(self) -> int:
        """Number of 4-byte values at the beginning of a payload."""
        return (self.mode & TEMPERATURE > 0) + 3 * len(self.calibrated) + self.orientation_values

    @cached_property
    def analog_inputs(self) -> int:
        """Number of analog inputs that are sent."""
        return (not self.settings & NO_ANALOG_1) + (not self.settings & NO_ANALOG_2) if self.mode & AUXILIARY else 0

    @property
    def end_bytes(self) -> int:
        """Bytes of UTC time and counter at the end."""
        return UTC_TIME.size * (self.settings & UTC > 0) + 2 * (self.settings & SAMPLE_COUNTER > 0)

    @cached_property
    def length(self) -> int:
        """Bytes of a payload."""
        if self.mode & RAW:
            return RAW_BYTES + self.end_bytes
        return 4 * self.numbers + 2 * self.analog_inputs + (self.mode & STATUS > 0) + self.end_bytes


PROJECT = OutputFormat(CALIBRATED | ORIENTATION, SAMPLE_COUNTER | QUATERNION | FLOAT)  # 54 bytes
_PROJECT = struct.Struct(">13fH")


def decode_mtdata(rows: Octets, output: OutputFormat) -> Decoded:
    """Values of payloads (n, `output.length`); NaN for raw data, which are not calibrated."""
    count = len(rows)
    values = np.full((count, COLUMNS), np.nan)
    counter = np.full(count, -1, np.int64)
    sent = np.repeat(output.sent[None, :], count, axis=0)
    if output.settings & SAMPLE_COUNTER:
        counter = np.ascontiguousarray(rows[:, -2:]).view(">u2")[:, 0].astype(np.int64)
    if output.mode & RAW:
        return Decoded(values, counter, sent)
    fixed = bool(output.settings & FIXED_12_20)
    bytewise = np.ascontiguousarray(rows[:, : 4 * output.numbers]).view(">i4" if fixed else ">f4")
    with np.errstate(invalid="ignore"):  # a damaged float can be a signalling NaN
        numbers: Floats = bytewise.astype(np.float64)
    if fixed:
        numbers *= _UNIT_12_20
    first = 0  # column of the next quantity
    if output.mode & TEMPERATURE:
        values[:, CELSIUS] = numbers[:, 0]
        first = 1
    for columns in output.calibrated:
        values[:, columns] = numbers[:, first : first + 3]
        first += 3
    if output.orientation_values:
        values[:, ATTITUDE] = from_values(numbers[:, first:])
    return Decoded(values, counter, sent)


def rest_of(payload: bytes, output: OutputFormat) -> dict[str, list[int] | int]:
    """Fields of a payload besides `Decoded`, as sent: `raw` (accel, gyro, mag, temperature), `analog` (one or two inputs), `status`,
    `utc` (ns, year, month, day, hour, minute, second, validity).
    """
    fields: dict[str, list[int] | int] = {}
    if output.settings & UTC:
        fields["utc"] = list(UTC_TIME.unpack_from(payload, output.length - output.end_bytes))
    if output.mode & RAW:
        return {"raw": list(struct.unpack_from(">10H", payload)), **fields}
    begin = 4 * output.numbers
    if output.analog_inputs:
        fields["analog"] = list(struct.unpack_from(f">{output.analog_inputs}H", payload, begin))
    if output.mode & STATUS:
        fields["status"] = payload[begin + 2 * output.analog_inputs]
    return fields


def pack_mtdata(sample: MtSample) -> bytes:
    """MTData payload in the format `PROJECT`: calibrated values, quaternion and sample counter as floats (54 bytes)."""
    return _PROJECT.pack(*sample.accel, *sample.gyro, *sample.mag, *sample.quaternion, sample.counter & 0xFFFF)
