# SPDX-License-Identifier: MIT
"""Measurements of an MT that have passed every gate, in batches of arrays.

In: bytes from the MT's port, in any split. Out: `MtBatch`es. Owns the unfinished frame, the last counter, a sample that waits for the next one,
and the counts. Of several devices behind a master, the device of the first whole sample is followed.
Vectors are in the sensor frame. Orientations are sensor -> MT world (magnetic north, west, up).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Floats, Ints
from echostep.xsens import gates
from echostep.xsens import mtdata as mt
from echostep.xsens.frames import (
    BUS_ID,
    ERROR,
    MTDATA,
    MTDATA2,
    WAKE_UP,
    FrameReader,
    MtFrames,
    copy_payloads,
    encode_frame,
)
from echostep.xsens.gates import Messages, apply_gates, joined
from echostep.xsens.mtdata import Decoded, MtSample, OutputFormat, decode_mtdata, pack_mtdata
from echostep.xsens.mtdata2 import decode_mtdata2, find_packets

HELD = 10  # equal samples in a row, which coarse digits may give at rest; assumed


class MtBatch(NamedTuple):
    """Measurements in order, the fields as in `MtSample`, and the temperature in degC; NaN for mag, quaternion and temperature that are not sent.

    `end` (n,): index, in the bytes just fed, after the byte that completed the measurement.
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
    """Counts of an `MtxReader`.

    `lost`: counters between samples that never came, with a sample or with another message. `incomplete`: messages without counter, accel or gyro.
    `bad_counter`: samples whose counter jumped while the next one did not follow it. `other_device`: samples of devices that are not followed.
    """

    good: int = 0
    other_device: int = 0
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
    """Largest magnitude of a measurement, a tenth beyond the range; largest error of |q| = 1.

    Ranges: 18 g [MTx data sheet], 2000 deg/s of the MTx's successors (1200 of the MTx itself) [MTi 1-series data sheet, as remembered].
    """

    accel_m_s2: float = 200.0
    gyro_rad_s: float = 38.4
    mag: float = 20.0
    quaternion_error: float = 0.01


class MtxReader:
    """Measurements of a byte stream. Samples that fail a gate are dropped and counted by reason; no bytes raise an error.

    `output`: format of MTData as set on the device; MTData2 contains its format.
    """

    def __init__(self, limits: MtxLimits | None = None, output: OutputFormat = mt.PROJECT) -> None:
        limits = limits or MtxLimits()
        self._frames = FrameReader()
        self._output = output
        self._limits = np.array([limits.accel_m_s2, limits.gyro_rad_s, limits.mag, limits.quaternion_error])
        self._tally = np.zeros(gates.LOST + 1, np.int64)
        self._state = np.array([-1, -1, -1, 0])
        self._waiting = gates.NO_MESSAGES  # a sample whose counter jumped; one at most
        self._last, self._alike = np.full((1, 6), np.nan), 0  # the newest sample, and how many before it were equal
        self._bad_length = self._other = self._wake_ups = self._errors = 0

    @property
    def counts(self) -> MtxCounts:
        """Counts since the start."""
        return MtxCounts(
            skipped_bytes=self._frames.counts.skipped_bytes,
            bad_checksum=self._frames.counts.bad_checksum,
            bad_length=self._bad_length,
            other_messages=self._other,
            wake_ups=self._wake_ups,
            device_errors=self._errors,
            **dict(zip(gates.TALLIED, self._tally.tolist(), strict=True)),
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
        return self._gated(self._decode(frames)) if len(frames.mid) else EMPTY

    def take(self, counter: Ints, accel: Floats, gyro: Floats) -> MtBatch:
        """Measurements (n,) of which no bytes are known, through the same gates; `end` is the index of each."""
        count = len(counter)
        values, sent = np.full((count, mt.COLUMNS), np.nan), np.zeros((count, 4), np.bool_)
        values[:, mt.ACCEL], values[:, mt.GYRO], sent[:, :2] = accel, gyro, True
        return self._gated(Messages(values, counter, sent, np.full(count, BUS_ID), np.arange(count)))

    def _gated(self, newer: Messages) -> MtBatch:
        """The measurements among these messages and the one that waited."""
        messages = joined(self._waiting, newer)
        passed, waits = apply_gates(messages, self._limits, self._state, self._tally)
        self._waiting = messages.at(np.arange(waits, waits + 1)) if waits >= 0 else gates.NO_MESSAGES
        values, counter, _, _, end = messages if passed.all() else messages.at(np.flatnonzero(passed))
        fresh = self._fresh(values)
        values, counter, end = (values, counter, end) if fresh.all() else (values[fresh], counter[fresh], end[fresh])
        groups = (mt.ACCEL, mt.GYRO, mt.MAG, mt.ATTITUDE, mt.CELSIUS)
        accel, gyro, mag, attitude, celsius = (values[:, group] for group in groups)
        return MtBatch(counter, accel, gyro, mag, attitude, celsius, end)

    def _fresh(self, values: Floats) -> Bools:
        """Whether each sample (n,) is one: a sensor has noise, so one that gives equal values for longer than HELD samples has stopped."""
        measured = np.vstack([self._last, values[:, mt.ACCEL.start : mt.GYRO.stop]])
        changed = (measured[1:] != measured[:-1]).any(1)
        index = np.arange(len(changed))
        alike = index - np.maximum.accumulate(np.where(changed, index, -1 - self._alike))
        if len(index):
            self._last, self._alike = measured[-1:], int(alike[-1])
        fresh = alike < HELD
        held = int((~fresh).sum())
        self._tally[[gates.GOOD, gates.REPEATED]] += (-held, held)
        return fresh

    def _decode(self, frames: MtFrames) -> Messages:
        """Values of all measurement messages in order; other messages are counted."""
        legacy = (frames.mid == MTDATA) & (frames.length == self._output.length)
        if legacy.all():
            rows = copy_payloads(frames.stream, frames.body, self._output.length)
            return Messages(*decode_mtdata(rows, self._output), frames.bus, frames.end)
        self._count_others(frames)
        count = len(frames.mid)
        decoded = Decoded(np.empty((count, mt.COLUMNS)), np.empty(count, np.int64), np.empty((count, 4), np.bool_))
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
        return Messages(*decoded, frames.bus, frames.end).at(np.flatnonzero(usable))

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


def warm_up() -> None:
    """Compile the kernels (seconds, the first time on a machine), so that no measurement waits for it later."""
    still = MtSample(0, (0.0, 0.0, 9.81), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    MtxReader().feed_batch(encode_frame(MTDATA, pack_mtdata(still)) + encode_frame(MTDATA2, b"\x10\x20\x02\x00\x00"))
