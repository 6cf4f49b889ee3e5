"""Xsens MT frames and the MTx's measurement message, sans-I/O.

In: bytes from the MTx's port. Out: `MtSample`s that have passed every gate. Owns the unfinished frame, the last counter and the counts.
Values are as the device sends them: sensor frame, and for the orientation the MT world (magnetic north, west, up)
[Xsens MT Low-Level Communication Protocol Documentation, MT0101P].
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass, field
from typing import NamedTuple

PREAMBLE = 0xFA
BUS_ID = 0xFF
EXTENDED = 0xFF
MTDATA = 0x32
MAX_LENGTH = 2048  # longest payload that an MT sends

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

_MTDATA = struct.Struct(">13fH")  # calibrated accel, gyro, mag; quaternion; sample counter


class Frame(NamedTuple):
    """One frame that passed its checksum."""

    mid: int
    payload: bytes


class MtSample(NamedTuple):
    """One measurement: accel m/s2, gyro rad/s, mag in units of the earth's field, quaternion w x y z (sensor -> MT world), u16 counter."""

    counter: int
    accel: Vector
    gyro: Vector
    mag: Vector
    quaternion: Quaternion


@dataclass(slots=True)
class MtxCounts:
    """What an `MtxReader` has seen; `lost` counts sample numbers that never came."""

    good: int = 0
    skipped_bytes: int = 0
    bad_checksum: int = 0
    bad_length: int = 0
    bad_quaternion: int = 0
    not_finite: int = 0
    out_of_range: int = 0
    repeated: int = 0
    other_messages: int = 0
    lost: int = 0


@dataclass(frozen=True, slots=True)
class MtxLimits:
    """Beyond these a value cannot be a measurement [MTx data sheet: 18 g and 1200 deg/s versions, with a tenth to spare]."""

    accel_m_s2: float = 200.0
    gyro_rad_s: float = 24.0
    mag: float = 20.0
    quaternion_error: float = 0.01


def encode_frame(mid: int, payload: bytes, bus_id: int = BUS_ID) -> bytes:
    """One frame with its checksum; raises ValueError for a payload that is too long."""
    if len(payload) > MAX_LENGTH:
        raise ValueError(f"{len(payload)} bytes do not fit an Xsens frame")
    length = bytes([len(payload)]) if len(payload) < EXTENDED else bytes([EXTENDED]) + len(payload).to_bytes(2, "big")
    body = bytes([bus_id, mid]) + length + payload
    return bytes([PREAMBLE]) + body + bytes([-sum(body) & 0xFF])


def pack_mtdata(sample: MtSample) -> bytes:
    """MTData payload: calibrated values, quaternion and sample counter as floats (54 bytes)."""
    return _MTDATA.pack(*sample.accel, *sample.gyro, *sample.mag, *sample.quaternion, sample.counter & 0xFFFF)


@dataclass(slots=True)
class FrameReader:
    """Frames out of a byte stream in any split; after damage it looks for the next preamble inside what it rejected."""

    counts: MtxCounts = field(default_factory=MtxCounts)
    _rest: bytes = b""

    def feed(self, received: bytes) -> list[Frame]:
        """Frames completed by these bytes."""
        stream = self._rest + received
        frames: list[Frame] = []
        at = 0
        while True:
            start = stream.find(PREAMBLE, at)
            if start < 0:
                self.counts.skipped_bytes += len(stream) - at
                self._rest = b""
                return frames
            self.counts.skipped_bytes += start - at
            end = self._end(stream, start)
            if end is None:
                self._rest = stream[start:]
                return frames
            if end < 0 or sum(stream[start + 1 : end]) & 0xFF:
                self.counts.bad_checksum += end > 0
                self.counts.skipped_bytes += 1
                at = start + 1
                continue
            body = start + (6 if stream[start + 3] == EXTENDED else 4)
            frames.append(Frame(stream[start + 2], stream[body : end - 1]))
            at = end

    @staticmethod
    def _end(stream: bytes, start: int) -> int | None:
        """Index after the frame that begins at `start`; None while it is unfinished, -1 when no frame can begin there."""
        have = len(stream) - start
        if have < 4:
            return None if have < 2 or stream[start + 1] == BUS_ID else -1
        if stream[start + 1] != BUS_ID:
            return -1
        length, head = stream[start + 3], 4
        if length == EXTENDED:
            if have < 6:
                return None
            length, head = int.from_bytes(stream[start + 4 : start + 6], "big"), 6
            if not EXTENDED <= length <= MAX_LENGTH:
                return -1
        return start + head + length + 1 if have >= head + length + 1 else None


class MtxReader:
    """Samples out of a byte stream; what fails a gate is counted by reason, nothing raises."""

    def __init__(self, limits: MtxLimits | None = None) -> None:
        self._frames = FrameReader()
        self._limits = limits or MtxLimits()
        self._counter: int | None = None

    @property
    def counts(self) -> MtxCounts:
        """What was seen so far."""
        return self._frames.counts

    def feed(self, received: bytes) -> list[MtSample]:
        """Samples completed by these bytes."""
        return [s for frame in self._frames.feed(received) if (s := self._sample(frame)) is not None]

    def _sample(self, frame: Frame) -> MtSample | None:
        if frame.mid != MTDATA:
            self.counts.other_messages += 1
            return None
        if len(frame.payload) != _MTDATA.size:
            self.counts.bad_length += 1
            return None
        v = _MTDATA.unpack(frame.payload)
        sample = MtSample(v[13], v[0:3], v[3:6], v[6:9], v[9:13])
        return sample if self._passes(sample) else None

    def _passes(self, s: MtSample) -> bool:
        """Every gate after the checksum: it is 8 bits wide and lets one damaged frame in 256 through."""
        counts, limits = self.counts, self._limits
        if not all(map(math.isfinite, (*s.accel, *s.gyro, *s.mag, *s.quaternion))):
            counts.not_finite += 1
            return False
        if abs(math.hypot(*s.quaternion) - 1.0) > limits.quaternion_error:
            counts.bad_quaternion += 1
            return False
        if (
            max(map(abs, s.accel)) > limits.accel_m_s2
            or max(map(abs, s.gyro)) > limits.gyro_rad_s
            or max(map(abs, s.mag)) > limits.mag
        ):
            counts.out_of_range += 1
            return False
        return self._in_order(s.counter)

    def _in_order(self, counter: int) -> bool:
        """Count gaps and drop repetitions by the sample counter, which wraps after 65535."""
        if self._counter is not None:
            gap = (counter - self._counter) & 0xFFFF
            if gap == 0:
                self.counts.repeated += 1
                return False
            self.counts.lost += gap - 1 if gap < 0x8000 else 0
        self._counter = counter
        self.counts.good += 1
        return True
