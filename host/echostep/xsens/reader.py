"""Measurements of an MT that have passed every gate, in batches of arrays.

In: bytes from the MT's port, in any split. Out: `MtBatch`es. Owns the unfinished frame, the last counter and the counts.
Vectors are in the sensor frame. Orientations are sensor -> MT world (magnetic north, west, up).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Floats, Ints
from echostep.jit import kernel
from echostep.xsens.frames import ERROR, MTDATA, MTDATA2, WAKE_UP, FrameReader, MtFrames, copy_payloads, encode_frame
from echostep.xsens.mtdata import (
    ACCEL,
    ATTITUDE,
    CELSIUS,
    COLUMNS,
    GYRO,
    MAG,
    PROJECT,
    Decoded,
    OutputFormat,
    decode_mtdata,
    pack_mtdata,
)  # fmt: skip
from echostep.xsens.mtdata2 import decode_mtdata2, find_packets
from echostep.xsens.sample import MtSample

# Results of the gates, in the order of the gates; also entries of the tally. LOST is an entry only.
GOOD, INCOMPLETE, NOT_FINITE, BAD_QUATERNION, OUT_OF_RANGE, REPEATED, BAD_COUNTER, LOST = range(8)

MAX_GAP = 500  # samples; a larger jump of the counter is accepted when the next counter confirms it; by reason
ACCEPTED, JUMPED = 0, 1  # entries of the last counters: the last accepted one, and one that jumped since; -1: none
_ACCEL, _GYRO, _MAG, _ATTITUDE, _GROUPS = range(
    5
)  # groups of values: columns of `Decoded.sent` and entries of the limits; their number
_BEGIN = (ACCEL.start, GYRO.start, MAG.start, ATTITUDE.start, ATTITUDE.stop)  # first column of each group, and the end
_Q = ATTITUDE.start  # column of the quaternion's w


class MtBatch(NamedTuple):
    """Measurements in order, the fields as in `MtSample`, and the temperature in degC; NaN for mag, quaternion and temperature that are not sent.

    `end` (n,): index, in the bytes just fed, behind the byte that completed the measurement.
    """

    counter: Ints
    accel: Floats
    gyro: Floats
    mag: Floats
    quaternion: Floats
    celsius: Floats
    end: Ints

    def samples(self) -> list[MtSample]:
        """The same measurements as a list of samples."""
        rows = zip(
            self.counter.tolist(), self.accel.tolist(), self.gyro.tolist(), self.mag.tolist(), self.quaternion.tolist(),
            strict=True,
        )  # fmt: skip
        return [MtSample(n, tuple(a), tuple(g), tuple(m), tuple(q)) for n, a, g, m, q in rows]


EMPTY = MtBatch(
    np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 4)), np.zeros(0), np.zeros(0, np.int64)
)  # fmt: skip


@dataclass(slots=True)
class MtxCounts:
    """What an `MtxReader` has counted.

    `lost`: numbers of samples that never came. `incomplete`: samples without counter, accel or gyro. `bad_counter`: samples whose counter jumps;
    they are dropped until the next counter confirms the jump.
    """

    good: int = 0
    skipped_bytes: int = 0
    bad_checksum: int = 0
    bad_length: int = 0
    incomplete: int = 0
    bad_quaternion: int = 0
    not_finite: int = 0
    out_of_range: int = 0
    repeated: int = 0
    bad_counter: int = 0
    other_messages: int = 0
    wake_ups: int = 0
    device_errors: int = 0
    lost: int = 0


@dataclass(frozen=True, slots=True)
class MtxLimits:
    """Largest magnitude of a measurement [MTx data sheet: 18 g and 1200 deg/s versions, and a tenth more]; largest error of |q| = 1."""

    accel_m_s2: float = 200.0
    gyro_rad_s: float = 24.0
    mag: float = 20.0
    quaternion_error: float = 0.01


class MtxReader:
    """Measurements of a byte stream. Samples that fail a gate are dropped and counted by reason; no bytes raise an error.

    `output`: format of MTData as set on the device; MTData2 contains its format.
    """

    def __init__(self, limits: MtxLimits | None = None, output: OutputFormat = PROJECT) -> None:
        limits = limits or MtxLimits()
        self._frames = FrameReader()
        self._output = output
        self._limits = np.array([limits.accel_m_s2, limits.gyro_rad_s, limits.mag, limits.quaternion_error])
        self._tally = np.zeros(LOST + 1, np.int64)
        self._last = np.full(2, -1, np.int64)  # counters ACCEPTED and JUMPED
        self._bad_length = self._other = self._wake_ups = self._errors = 0

    @property
    def counts(self) -> MtxCounts:
        """Counts since the start."""
        tally = self._tally.tolist()
        return MtxCounts(
            good=tally[GOOD],
            skipped_bytes=self._frames.counts.skipped_bytes,
            bad_checksum=self._frames.counts.bad_checksum,
            bad_length=self._bad_length,
            incomplete=tally[INCOMPLETE],
            bad_quaternion=tally[BAD_QUATERNION],
            not_finite=tally[NOT_FINITE],
            out_of_range=tally[OUT_OF_RANGE],
            repeated=tally[REPEATED],
            bad_counter=tally[BAD_COUNTER],
            other_messages=self._other,
            wake_ups=self._wake_ups,
            device_errors=self._errors,
            lost=tally[LOST],
        )

    @property
    def pending(self) -> int:
        """Bytes of the unfinished frame."""
        return self._frames.pending

    def feed(self, received: bytes) -> list[MtSample]:
        """Measurements completed by these bytes, one by one."""
        return self.feed_batch(received).samples()

    def feed_batch(self, received: bytes) -> MtBatch:
        """Measurements completed by these bytes."""
        frames = self._frames.scan(received)
        if not len(frames.mid):
            return EMPTY
        (values, counter, sent), end = self._decode(frames)
        kept = _apply_gates(values, counter, sent, self._limits, self._last, self._tally)
        if not kept.all():
            values, counter, end = values[kept], counter[kept], end[kept]
        return MtBatch(
            counter, values[:, ACCEL], values[:, GYRO], values[:, MAG], values[:, ATTITUDE], values[:, CELSIUS], end
        )

    def _decode(self, frames: MtFrames) -> tuple[Decoded, Ints]:
        """Values of all measurement messages in order, and their ends (n,); other messages are counted."""
        legacy = (frames.mid == MTDATA) & (frames.length == self._output.length)
        if legacy.all():
            return decode_mtdata(
                copy_payloads(frames.stream, frames.body, self._output.length), self._output
            ), frames.end
        self._count_others(frames)
        count = len(frames.mid)
        decoded = Decoded(np.empty((count, COLUMNS)), np.empty(count, np.int64), np.empty((count, 4), np.bool_))
        usable = legacy.copy()
        first, second = np.flatnonzero(legacy), np.flatnonzero(frames.mid == MTDATA2)
        if len(first):
            rows = copy_payloads(frames.stream, frames.body[first], self._output.length)
            _fill(decoded, first, decode_mtdata(rows, self._output))
        if len(second):
            packets = find_packets(frames.stream, frames.body[second], frames.length[second])
            _fill(decoded, second, decode_mtdata2(frames.stream, packets))
            usable[second] = packets.whole
            self._bad_length += int(np.sum(~packets.whole))
        return Decoded(*(part[usable] for part in decoded)), frames.end[usable]

    def _count_others(self, frames: MtFrames) -> None:
        """Count messages that are no measurements, and MTData of a wrong length."""
        mid = frames.mid
        self._bad_length += int(np.sum((mid == MTDATA) & (frames.length != self._output.length)))
        self._other += int(np.sum((mid != MTDATA) & (mid != MTDATA2)))
        self._wake_ups += int(np.sum(mid == WAKE_UP))
        self._errors += int(np.sum(mid == ERROR))


def _fill(decoded: Decoded, rows: Ints, part: Decoded) -> None:
    """Write `part` (k,) into these rows (k,)."""
    for into, values in zip(decoded, part, strict=True):
        into[rows] = values


@kernel
def _apply_gates(values: Floats, counter: Ints, sent: Bools, limits: Floats, last: Ints, tally: Ints) -> Bools:
    """Whether each sample (n,) passes every gate; updates the counters `last`, and `tally` by the results.

    The gates are needed because the checksum has 8 bits: one damaged frame in 256 passes it.
    """
    kept = np.zeros(len(values), np.bool_)
    for k in range(len(values)):
        complete = counter[k] >= 0 and sent[k, _ACCEL] and sent[k, _GYRO]
        result = _value_gate(values[k], sent[k], limits) if complete else INCOMPLETE
        if result == GOOD and last[ACCEPTED] >= 0:
            result = _counter_gate(counter[k], last, tally)
        tally[result] += 1
        if result == GOOD:
            kept[k], last[ACCEPTED], last[JUMPED] = True, counter[k], -1
    return kept


@kernel
def _counter_gate(counter: int, last: Ints, tally: Ints) -> int:
    """Whether a counter follows the last accepted one; the samples missing between them are counted as lost."""
    gap = (counter - last[ACCEPTED]) & 0xFFFF
    if gap == 0:
        return REPEATED
    confirmed = last[JUMPED] >= 0 and 0 < ((counter - last[JUMPED]) & 0xFFFF) <= MAX_GAP
    if gap > MAX_GAP and not confirmed:
        last[JUMPED] = counter
        return BAD_COUNTER
    if gap < 0x8000:  # else a jump back
        tally[LOST] += gap - 1
    return GOOD


@kernel
def _value_gate(row: Floats, sent: Bools, limits: Floats) -> int:
    """The first gate that a sample fails, for the quantities that were sent: finite, |q| = 1, within the sensor's range."""
    for group in range(_GROUPS):
        for column in range(_BEGIN[group], _BEGIN[group + 1]):
            if sent[group] and not np.isfinite(row[column]):
                return NOT_FINITE
    if sent[_ATTITUDE]:
        square = row[_Q] ** 2 + row[_Q + 1] ** 2 + row[_Q + 2] ** 2 + row[_Q + 3] ** 2
        if abs(np.sqrt(square) - 1.0) > limits[_ATTITUDE]:
            return BAD_QUATERNION
    for group in range(_ATTITUDE):
        for column in range(_BEGIN[group], _BEGIN[group + 1]):
            if sent[group] and abs(row[column]) > limits[group]:
                return OUT_OF_RANGE
    return GOOD


def warm_up() -> None:
    """Compile the kernels (seconds, the first time on a machine), so that no measurement waits for it later."""
    still = MtSample(0, (0.0, 0.0, 9.81), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    MtxReader().feed_batch(encode_frame(MTDATA, pack_mtdata(still)) + encode_frame(MTDATA2, b"\x10\x20\x02\x00\x00"))
