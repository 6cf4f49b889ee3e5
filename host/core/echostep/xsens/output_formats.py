# SPDX-License-Identifier: MIT
"""The output format of the MTData in a capture, which the messages do not contain.

In: frames of a capture's beginning, and the caller's knowledge. Out: the format by bus and length, and how it was found. Owns the formats found.

It is, in this order: given; from a Configuration message or the answers to ReqOutputMode and ReqOutputSettings in the capture; or the simplest
format of that length with which the values are possible. A capture that states a format which is not read has none.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from functools import cache
from itertools import product
from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Octets
from echostep.xsens import mtdata as mt
from echostep.xsens.frames import BUS_ID, CONFIGURATION, MTDATA, OUTPUT_MODE, OUTPUT_SETTINGS, Frame
from echostep.xsens.mtdata import Decoded, OutputFormat, decode_mtdata

# Of a Configuration message, in bytes: the number of devices, the first device's block, the length of a block [CMT].
_DEVICES, _BLOCKS, _BLOCK = 96, 98, 20
_BLOCK_FORMAT = struct.Struct(">IHHI")  # of a block: device, length of its data, output mode, output settings
MOST_ROWS = 500  # messages by which a format is judged; assumed
POSSIBLE = 0.9  # least share of messages with possible values: some are damaged
# Possible values: magnitudes of a sensor on a body, m/s2, rad/s, earth's fields; mean acceleration including gravity; air, degC.
MOST = ((mt.ACCEL, 200.0), (mt.GYRO, 40.0), (mt.MAG, 20.0))
STRONGEST_FIELD = 4.0  # median: some iron, no magnet
MEAN_ACCEL = (5.0, 20.0)  # m/s2
AIR_C = (-40.0, 85.0)  # [MTx data sheet, operating temperature]
TINY = 1e-20  # in any unit: no sensor shows less
UNIT_ERROR = 0.01  # of |q| = 1
GIVEN, CONFIGURED, BY_LENGTH = "given", "by a configuration message of the capture", "by the length and the values"


class Found(NamedTuple):
    """A format and how it was found."""

    output: OutputFormat
    how: str


@dataclass(slots=True)
class OutputFormats:
    """Formats by bus and length of the payload. `mode`, `settings`: given by the caller, None if unknown."""

    mode: int | None = None
    settings: int | None = None
    found: dict[tuple[int, int], Found | None] = field(default_factory=dict)  # None: no format fits
    _told: dict[int, list[int | None]] = field(default_factory=dict)  # mode and settings by bus

    def learn(self, frames: list[Frame]) -> None:
        """Find the formats of these frames' MTData, if not found yet."""
        by_key: dict[tuple[int, int], list[bytes]] = {}
        for frame in frames:
            self._listen(frame)
            key = frame.bus, len(frame.payload)
            if frame.mid == MTDATA and key not in self.found and len(by_key.setdefault(key, [])) < MOST_ROWS:
                by_key[key].append(frame.payload)
        for key, payloads in by_key.items():
            rows = np.frombuffer(b"".join(payloads), np.uint8).reshape(len(payloads), key[1])
            self.found[key] = self._find(key[0], rows)

    def of(self, bus: int, length: int) -> OutputFormat | None:
        """The format of MTData of this length; None if unknown."""
        known = self.found.get((bus, length))
        return None if known is None else known.output

    def _listen(self, frame: Frame) -> None:
        """Keep mode and settings from a configuration message."""
        if frame.mid == CONFIGURATION:
            for bus, (_, _, mode, settings) in enumerate(configured_devices(frame.payload), 1):
                self._told[bus] = [mode, settings]
                self._told.setdefault(BUS_ID, [mode, settings])
        elif frame.mid == OUTPUT_MODE and len(frame.payload) == 2:
            self._told.setdefault(frame.bus, [None, None])[0] = int.from_bytes(frame.payload, "big")
        elif frame.mid == OUTPUT_SETTINGS and len(frame.payload) == 4:
            self._told.setdefault(frame.bus, [None, None])[1] = int.from_bytes(frame.payload, "big")

    def _find(self, bus: int, rows: Octets) -> Found | None:
        """The format of this device's payloads (n, length)."""
        if self.mode is not None or self.settings is not None:
            return _first(self.mode, self.settings, rows, GIVEN)
        told_mode, told_settings = self._told.get(bus, (None, None))
        configured = None if told_mode is None else _first(told_mode, told_settings, rows, CONFIGURED)
        is_told = configured is None and told_mode is not None and told_settings is not None
        if is_told and _known(told_mode or 0, told_settings or 0) is None:
            return None
        return configured or _first(None, None, rows, BY_LENGTH)


def configured_devices(payload: bytes) -> list[tuple[int, int, int, int]]:
    """Device identifier, length of its data, output mode and settings of each device of a Configuration message."""
    if len(payload) < _BLOCKS:
        return []
    count = int.from_bytes(payload[_DEVICES:_BLOCKS], "big")
    whole = min(count, (len(payload) - _BLOCKS) // _BLOCK)
    return [_BLOCK_FORMAT.unpack_from(payload, _BLOCKS + _BLOCK * k) for k in range(whole)]


def _first(mode: int | None, settings: int | None, rows: Octets, how: str) -> Found | None:
    """The simplest format of this length, with this mode and these settings if they are known. A fully known format needs no possible values."""
    formats = _formats(rows.shape[1])
    if mode is not None and settings is not None:
        known = _known(mode, settings)
        formats = (known,) if known is not None and known.length == rows.shape[1] else ()
    for output in formats:
        if (mode is None or output.mode == mode) and (settings is None or output.settings == settings):
            whole = mode is not None and settings is not None
            if whole or (_is_measured(rows, output) and _is_possible(decode_mtdata(rows, output), output)):
                return Found(output, how)
    return None


def _known(mode: int, settings: int) -> OutputFormat | None:
    """The format with this mode and these settings, if an MTx has it."""
    try:
        return OutputFormat(mode, settings)
    except ValueError:
        return None


@cache
def _formats(length: int) -> tuple[OutputFormat, ...]:
    """All formats whose payloads have this length, the simplest first: with fewer bits set; floats before fixed point, raw data last."""
    modes = [
        mode
        for mode in _sums(mt.CALIBRATED, mt.ORIENTATION, mt.TEMPERATURE, mt.STATUS, mt.AUXILIARY)
        if mode & (mt.CALIBRATED | mt.ORIENTATION)  # with neither, the values show nothing
    ]
    choices = product(
        modes,
        (mt.FLOAT, mt.FIXED_12_20),
        (mt.SAMPLE_COUNTER, 0),
        (mt.QUATERNION, mt.EULER, mt.MATRIX),
        _sums(mt.NO_ACCEL, mt.NO_GYRO, mt.NO_MAG)[:-1],  # not all three
        (0, mt.NO_ANALOG_1, mt.NO_ANALOG_2),
    )
    formats = set()
    for mode, form, counter, orientation, missing, analog in choices:
        used = ((orientation, mt.ORIENTATION), (missing, mt.CALIBRATED), (analog, mt.AUXILIARY))
        formats.add(OutputFormat(mode, form | counter | sum(bits for bits, sent in used if mode & sent)))
    formats |= {OutputFormat(mt.RAW, counter) for counter in (mt.SAMPLE_COUNTER, 0)}
    fits = [output for output in formats if output.length == length]
    return tuple(sorted(fits, key=_complexity))


def _sums(*bits: int) -> list[int]:
    """The sum of each choice of some of these bits, of none first and of all last."""
    return [sum(chosen) for chosen in product(*((0, bit) for bit in bits))]


def _complexity(output: OutputFormat) -> tuple[int, ...]:
    """Order of the formats of one length: raw last, fixed point later, few bits besides calibrated data and the counter first."""
    rare = (output.mode & ~(mt.CALIBRATED | mt.ORIENTATION)).bit_count() + (
        output.settings & ~(mt.SAMPLE_COUNTER | mt.FIXED_12_20)
    ).bit_count()
    no_calibrated = not output.mode & mt.CALIBRATED
    missing = output.settings & mt.NO_ACCEL, output.settings & mt.NO_GYRO  # rarer than a missing magnetometer
    return (
        output.mode & mt.RAW,
        output.settings & mt.FIXED_12_20,
        rare + no_calibrated,
        no_calibrated,
        *missing,
        output.mode,
        output.settings,
    )


def _is_measured(rows: Octets, output: OutputFormat) -> bool:
    """Whether the floats of most messages are zero or larger than TINY: the bytes of a date give smaller ones."""
    if output.settings & mt.FIXED_12_20:
        return True
    with np.errstate(invalid="ignore"):
        size = np.abs(np.ascontiguousarray(rows[:, : 4 * output.numbers]).view(">f4").astype(np.float64))
    return bool(((size == 0.0) | ~(size < TINY)).all(axis=1).mean() >= POSSIBLE)


def _is_possible(decoded: Decoded, output: OutputFormat) -> bool:
    """Whether most messages have possible values."""
    values, _, sent = decoded
    good: Bools = np.ones(len(values), np.bool_)
    with np.errstate(all="ignore"):
        for group, (columns, most) in enumerate(MOST):
            if sent[0, group]:
                good &= np.isfinite(values[:, columns]).all(axis=1) & (np.abs(values[:, columns]) <= most).all(axis=1)
        if sent[0, len(MOST)]:
            good &= np.abs(np.linalg.norm(values[:, mt.ATTITUDE], axis=1) - 1.0) <= UNIT_ERROR
        if output.mode & mt.TEMPERATURE:
            good &= (values[:, mt.CELSIUS] >= AIR_C[0]) & (values[:, mt.CELSIUS] <= AIR_C[1])
    if good.mean() < POSSIBLE:
        return False
    force = np.linalg.norm(values[good][:, mt.ACCEL], axis=1).mean() if sent[0, 0] else np.mean(MEAN_ACCEL)
    strength = np.median(np.linalg.norm(values[good][:, mt.MAG], axis=1)) if sent[0, 2] else 0.0
    return bool(MEAN_ACCEL[0] <= force <= MEAN_ACCEL[1] and strength <= STRONGEST_FIELD)
