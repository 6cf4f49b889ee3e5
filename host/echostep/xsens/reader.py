"""Measurements of an MT that have passed every gate, in batches of arrays.

In: bytes from the MT's port, in any split. Out: `MtBatch`es. Owns the unfinished frame, the last counter and the counts.
Values are as the device sends them: sensor frame, and for the orientation the MT world (magnetic north, west, up).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Floats, Ints
from echostep.jit import kernel
from echostep.xsens.frames import ERROR, MTDATA, MTDATA2, WAKE_UP, FrameReader, MtFrames, encode_frame, payloads_at
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

# Verdicts, in the order of the gates; also rows of the reader's tally.
GOOD, INCOMPLETE, NOT_FINITE, BAD_QUATERNION, OUT_OF_RANGE, REPEATED, BAD_COUNTER, LOST = range(8)

MAX_GAP = 500  # a counter that is further ahead, or behind, is believed when the next one follows it


class MtBatch(NamedTuple):
    """Measurements in order: counter (n,) u16; accel m/s2, gyro rad/s, mag in units of the earth's field (n, 3); quaternion w x y z,
    sensor -> MT world (n, 4); temperature degC (n,); `end` (n,): after which of the bytes just fed each one was complete. Mag, quaternion and
    temperature are NaN when the device does not send them.
    """

    counter: Ints
    accel: Floats
    gyro: Floats
    mag: Floats
    quaternion: Floats
    celsius: Floats
    end: Ints

    def samples(self) -> list[MtSample]:
        """The same, one by one."""
        rows = zip(
            self.counter.tolist(), self.accel.tolist(), self.gyro.tolist(), self.mag.tolist(), self.quaternion.tolist(),
            strict=True,
        )  # fmt: skip
        return [MtSample(n, tuple(a), tuple(g), tuple(m), tuple(q)) for n, a, g, m, q in rows]


@dataclass(slots=True)
class MtxCounts:
    """What an `MtxReader` has seen; `lost` counts sample numbers that never came, `incomplete` samples without counter, accel or gyro;
    `bad_counter` those whose counter jumps, which are dropped until the next one confirms the jump.
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
    """Beyond these a value cannot be a measurement [MTx data sheet: 18 g and 1200 deg/s versions, with a tenth to spare]."""

    accel_m_s2: float = 200.0
    gyro_rad_s: float = 24.0
    mag: float = 20.0
    quaternion_error: float = 0.01


class MtxReader:
    """Measurements out of a byte stream; what fails a gate is counted by reason, nothing raises.

    `output`: how the device was set, for MTData; MTData2 says it itself.
    """

    def __init__(self, limits: MtxLimits | None = None, output: OutputFormat = PROJECT) -> None:
        limits = limits or MtxLimits()
        self._frames = FrameReader()
        self._output = output
        self._limits = np.array([limits.accel_m_s2, limits.gyro_rad_s, limits.mag, limits.quaternion_error])
        self._tally = np.zeros(LOST + 1, np.int64)
        self._last = np.full(2, -1, np.int64)  # the last counter that was believed, and one that jumped since
        self._bad_length = self._other = self._wake_ups = self._errors = 0

    @property
    def counts(self) -> MtxCounts:
        """What was seen so far."""
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
        (values, counter, sent), end = self._decoded(frames)
        kept = _judge(values, counter, sent, self._limits, self._last, self._tally)
        if not kept.all():
            values, counter, end = values[kept], counter[kept], end[kept]
        return MtBatch(
            counter, values[:, ACCEL], values[:, GYRO], values[:, MAG], values[:, ATTITUDE], values[:, CELSIUS], end
        )

    def _decoded(self, frames: MtFrames) -> tuple[Decoded, Ints]:
        """All measurement messages in order, and their ends (n,); the other messages are counted."""
        legacy = (frames.mid == MTDATA) & (frames.length == self._output.length)
        if legacy.all():
            return decode_mtdata(payloads_at(frames.stream, frames.body, self._output.length), self._output), frames.end
        self._count_others(frames)
        count = len(frames.mid)
        found = Decoded(np.empty((count, COLUMNS)), np.empty(count, np.int64), np.empty((count, 4), np.bool_))
        taken = legacy.copy()
        first, second = np.flatnonzero(legacy), np.flatnonzero(frames.mid == MTDATA2)
        if len(first):
            rows = payloads_at(frames.stream, frames.body[first], self._output.length)
            _fill(found, first, decode_mtdata(rows, self._output))
        if len(second):
            places = find_packets(frames.stream, frames.body[second], frames.length[second])
            _fill(found, second, decode_mtdata2(frames.stream, places))
            taken[second] = places.whole
            self._bad_length += int(np.sum(~places.whole))
        return Decoded(*(part[taken] for part in found)), frames.end[taken]

    def _count_others(self, frames: MtFrames) -> None:
        mid = frames.mid
        self._bad_length += int(np.sum((mid == MTDATA) & (frames.length != self._output.length)))
        self._other += int(np.sum((mid != MTDATA) & (mid != MTDATA2)))
        self._wake_ups += int(np.sum(mid == WAKE_UP))
        self._errors += int(np.sum(mid == ERROR))


def _fill(found: Decoded, which: Ints, part: Decoded) -> None:
    for into, values in zip(found, part, strict=True):
        into[which] = values


@kernel
def _judge(values: Floats, counter: Ints, sent: Bools, limits: Floats, last: Ints, tally: Ints) -> Bools:
    """Which samples pass every gate after the checksum; `last` is carried on, `tally` gets the verdicts and the lost samples.

    The checksum is 8 bits wide and lets one damaged frame in 256 through.
    """
    kept = np.zeros(len(values), np.bool_)
    for k in range(len(values)):
        complete = counter[k] >= 0 and sent[k, 0] and sent[k, 1]
        verdict = _verdict(values[k], sent[k], limits) if complete else INCOMPLETE
        if verdict == GOOD and last[0] >= 0:
            verdict = _continuity(counter[k], last, tally)
        tally[verdict] += 1
        if verdict == GOOD:
            kept[k], last[0], last[1] = True, counter[k], -1
    return kept


@kernel
def _continuity(counter: int, last: Ints, tally: Ints) -> int:
    """Whether a counter follows the last one; what is missing between them is counted as lost."""
    gap = (counter - last[0]) & 0xFFFF
    if gap == 0:
        return REPEATED
    confirmed = last[1] >= 0 and 0 < ((counter - last[1]) & 0xFFFF) <= MAX_GAP
    if gap > MAX_GAP and not confirmed:
        last[1] = counter
        return BAD_COUNTER
    if gap < 0x8000:
        tally[LOST] += gap - 1
    return GOOD


@kernel
def _verdict(row: Floats, sent: Bools, limits: Floats) -> int:
    """The first gate that a sample fails, of what was sent: finite, |q| = 1, within the sensor's range."""
    for group in range(4):
        for j in range(3 * group, 3 * group + (4 if group == 3 else 3)):
            if sent[group] and not np.isfinite(row[j]):
                return NOT_FINITE
    if sent[3]:
        square = row[9] ** 2 + row[10] ** 2 + row[11] ** 2 + row[12] ** 2
        if abs(np.sqrt(square) - 1.0) > limits[3]:
            return BAD_QUATERNION
    for j in range(9):
        if sent[j // 3] and abs(row[j]) > limits[j // 3]:
            return OUT_OF_RANGE
    return GOOD


EMPTY = MtBatch(
    np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 4)), np.zeros(0), np.zeros(0, np.int64)
)  # fmt: skip


def warm_up() -> None:
    """Compile the kernels (seconds, the first time on a machine), so that nothing waits for it later."""
    still = MtSample(0, (0.0, 0.0, 9.81), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    MtxReader().feed_batch(encode_frame(MTDATA, pack_mtdata(still)) + encode_frame(MTDATA2, b"\x10\x20\x02\x00\x00"))
