"""MTx samples, many at once: bytes from the MTx's port -> columns.

In: bytes in any split. Out: `MtBatch`. Owns the unfinished frame, the last counter and the counts. Default message only (54 bytes of MTData).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from echostep.xsens import BUS_ID, EXTENDED, MAX_LENGTH, MTDATA, PREAMBLE, MtxCounts, MtxLimits

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Octets = NDArray[np.uint8]

BODY = 54
_ROW = np.dtype(
    [("accel", ">f4", 3), ("gyro", ">f4", 3), ("mag", ">f4", 3), ("quaternion", ">f4", 4), ("counter", ">u2")]
)
_SKIPPED, _BAD_CHECKSUM, _BAD_LENGTH, _OTHER, _TALLY = range(5)


@dataclass(frozen=True, slots=True)
class MtBatch:
    """Samples as columns: `counter` (n,), `accel` m/s2, `gyro` rad/s, `mag` (n, 3), `quaternion` (n, 4) w x y z, and `end` (n,).

    `end`: how many of the bytes fed had to come until the sample was known: up to the end of its frame, or of a damaged one that hid it.
    """

    counter: Ints
    accel: Floats
    gyro: Floats
    mag: Floats
    quaternion: Floats
    end: Ints


_NONE, _NO_VECTORS = np.empty(0, np.int64), np.empty((0, 3))
_NOTHING = MtBatch(_NONE, _NO_VECTORS, _NO_VECTORS, _NO_VECTORS, np.empty((0, 4)), _NONE)


class MtxReader:
    """Samples out of a byte stream; what fails a gate is counted by reason, nothing raises."""

    def __init__(self, limits: MtxLimits | None = None) -> None:
        self.counts = MtxCounts()
        self._limits = limits or MtxLimits()
        self._rest = b""
        self._tally = np.zeros(_TALLY, np.int64)
        self._counter = -1

    def feed_batch(self, received: bytes) -> MtBatch:
        """Samples completed by these bytes."""
        if not received:
            return _NOTHING
        stream = self._rest + received
        bodies = np.empty((len(stream) // (BODY + 5), BODY), np.uint8)
        ends = np.empty(len(bodies), np.int64)
        found, done = _scan(np.frombuffer(stream, np.uint8), self._tally, bodies, ends)
        ends = ends[:found] - len(self._rest)
        self._rest = stream[done:]
        skipped, checksum, length, other = self._tally.tolist()
        counts = self.counts
        counts.skipped_bytes, counts.bad_checksum, counts.bad_length, counts.other_messages = (
            skipped,
            checksum,
            length,
            other,
        )
        return self._gated(bodies[:found].view(_ROW)[:, 0], ends) if found else _NOTHING

    def _gated(self, rows: NDArray[np.void], ends: Ints) -> MtBatch:
        """Every gate after the checksum: it is 8 bits wide and lets one damaged frame in 256 through."""
        limits, counts = self._limits, self.counts
        counter = rows["counter"].astype(np.int64)
        with np.errstate(over="ignore", invalid="ignore"):  # a damaged float may be a signalling NaN
            accel, gyro, mag, q = (rows[name].astype(np.float64) for name in ("accel", "gyro", "mag", "quaternion"))
            finite = np.isfinite(np.hstack([accel, gyro, mag, q])).all(1)
            unit = np.abs(np.sqrt((q * q).sum(1)) - 1.0) <= limits.quaternion_error
        near = (np.abs(accel) <= limits.accel_m_s2).all(1) & (np.abs(gyro) <= limits.gyro_rad_s).all(1)
        near &= (np.abs(mag) <= limits.mag).all(1)
        counts.not_finite += int((~finite).sum())
        counts.bad_quaternion += int((finite & ~unit).sum())
        counts.out_of_range += int((finite & unit & ~near).sum())
        kept = np.flatnonzero(finite & unit & near)
        kept = kept[self._in_order(counter[kept])]
        return MtBatch(counter[kept], accel[kept], gyro[kept], mag[kept], q[kept], ends[kept])

    def _in_order(self, counter: Ints) -> NDArray[np.bool_]:
        """Which samples are no repetitions; counts gaps by the sample counter, which wraps after 65535."""
        if not len(counter):
            return np.empty(0, np.bool_)
        gap = np.diff(counter, prepend=self._counter) & 0xFFFF
        if self._counter < 0:
            gap[0] = 1
        self._counter = int(counter[-1])
        new = gap != 0
        self.counts.repeated += int((~new).sum())
        self.counts.good += int(new.sum())
        self.counts.lost += int((gap[new & (gap < 0x8000)] - 1).sum())
        return new


@njit(cache=True, error_model="numpy")
def _scan(stream: Octets, tally: Ints, bodies: Octets, ends: Ints) -> tuple[int, int]:
    """Fill the columns with MTData frames; returns how many there were and where the unfinished frame begins."""
    found, at, reached = 0, 0, 0
    while at < len(stream):
        if stream[at] != PREAMBLE:
            tally[_SKIPPED] += 1
            at += 1
            continue
        end = _end(stream, at)
        if end == 0:
            break
        if end < 0 or not _sums_to_zero(stream, at + 1, end):
            tally[_BAD_CHECKSUM] += end > 0
            tally[_SKIPPED] += 1
            reached = max(reached, end)
            at += 1
            continue
        reached = max(reached, end)
        if stream[at + 2] != MTDATA:
            tally[_OTHER] += 1
        elif stream[at + 3] != BODY:
            tally[_BAD_LENGTH] += 1
        else:
            bodies[found] = stream[at + 4 : end - 1]
            ends[found] = reached
            found += 1
        at = end
    return found, at


@njit(cache=True, error_model="numpy")
def _end(stream: Octets, start: int) -> int:
    """Index after the frame that begins at `start`; 0 while it is unfinished, -1 when no frame can begin there."""
    have = len(stream) - start
    if have >= 2 and stream[start + 1] != BUS_ID:
        return -1
    if have < 4:
        return 0
    length, head = (stream[start + 3] & 0xFF), 4
    if length == EXTENDED:
        if have < 6:
            return 0
        length, head = (stream[start + 4] & 0xFF) << 8 | (stream[start + 5] & 0xFF), 6
        if not EXTENDED <= length <= MAX_LENGTH:
            return -1
    return start + head + length + 1 if have >= head + length + 1 else 0


@njit(cache=True, error_model="numpy")
def _sums_to_zero(stream: Octets, start: int, end: int) -> bool:
    total = 0
    for k in range(start, end):
        total += stream[k]
    return total & 0xFF == 0
