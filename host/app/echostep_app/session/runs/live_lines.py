# SPDX-License-Identifier: MIT
"""A foot IMU that prints lines: text in, samples out.

In: bytes of any origin, in any split: a line that names the columns, as a file's first line does, then a sample a line. Out: samples in SI, and
chunks of MTData2 messages for the tracker. Owns the unfinished line, the columns, the times, and the counts; no bytes raise an error.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from echostep.arrays import Floats
from echostep.offline.csv_table import CsvLimits, column_of, number_of
from echostep.offline.header import Header
from echostep.offline.imu_checks import ROOM, is_filled, out_of_line, unwrapped
from echostep.offline.imu_csv import COLUMNS
from echostep.ports.chunks import Chunk
from echostep_app.offline.foreign_columns import read_header
from echostep_app.offline.imu_chunks import ImuChunks

LONGEST_LINE = 1000  # bytes; a longer one is dropped
MOST = 1e10  # of any number in SI: seconds since 1970 are below it for three centuries; assumed
JUMP_S = 3.0  # more than a network holds lines back; the device's clock was set where it differs so much from the host's since the last line


class LineReader:
    """`header`: the line that named the columns; empty before. `unreadable`: lines that were neither names nor a sample."""

    def __init__(self) -> None:
        self.header = ""
        self.unreadable = 0
        self._columns: Header | None = None
        self._rest, self._too_long = b"", False

    def feed(self, received: bytes) -> Floats:
        """Samples (n, 7) of the lines that these bytes end: t s, accel m/s2, gyro rad/s. A zero, as around datagrams, ends a line, too."""
        *lines, self._rest = (self._rest + received).translate(_LINE_ENDS).split(b"\n")
        if self._too_long and lines:
            lines[0], self._too_long = b"", False
        if len(self._rest) > LONGEST_LINE or self._too_long:
            self.unreadable += not self._too_long
            self._rest, self._too_long = b"", True
        rows = [self._row(line.decode("ascii", "replace")) for line in lines if line.strip()]
        self.unreadable += sum(row is None for row in rows)
        samples = [row for row in rows if row is not None and len(row)]
        return np.concatenate(samples) if samples else np.empty((0, len(COLUMNS)))

    def _row(self, line: str) -> Floats | None:
        """The sample (1, 7) of a line; (0, 7) of one that names the columns; None for another one."""
        if len(line) > LONGEST_LINE:
            return None
        if math.isnan(number_of(line.replace(";", ",").replace("\t", ",").split(",")[0])):
            return np.empty((0, len(COLUMNS))) if self._name_columns(line) else None
        if self._columns is None:
            return None
        values = self._columns.table(iter([line]), COLUMNS, 0, CsvLimits(early_rows=None)).values
        return values if (np.abs(values) < MOST).all() and not is_filled(values).any() else None

    def _name_columns(self, line: str) -> bool:
        """Take the names of the columns from a line; False if it has not all of them."""
        if line == self.header:
            return True
        try:
            head = read_header(iter([line]))
            lacks = min(column_of(head.names, name) for name in COLUMNS) < 0
        except ValueError:
            return False
        if lacks:
            return False
        if head.counts_hz:
            head = replace(head, factors={**head.factors, "t_s": 1.0 / head.counts_hz}, counts_hz=None)
        self.header, self._columns = line, head
        return True


_LINE_ENDS = bytes.maketrans(b"\0\r", b"\n\n")


class LineChunks:
    """Samples as chunks that arrive when their bytes did. `jumps`: how often the device's clock was set. `left_out`: as of `ImuChunks`.

    `off`: times out of line with their neighbours'. A sample that does not follow the one before by a period waits for the next one.
    """

    def __init__(self, rate_hz: float) -> None:
        self.jumps = self.off = 0
        self._chunks, self._period_s = ImuChunks(rate_hz), 1.0 / rate_hz
        # The newest sample in line, and one that waits: time of arrival (s), sample
        self._given, self._waiting = np.empty((2, 0, 1 + len(COLUMNS)))
        self._wrapped_s = 0.0  # by which the device's counter has wrapped
        # Added to the device's times; of the newest sample
        self._set_s, self._newest_s, self._arrival_s = 0.0, math.nan, 0.0

    @property
    def left_out(self) -> int:
        """Samples within the same period as the one before, or before it."""
        return self._chunks.left_out

    def of(self, samples: Floats, arrival_ns: int) -> Iterator[Chunk]:
        """Chunks of samples (n, 7)."""
        rows = self._in_line(np.insert(samples, 0, 1e-9 * arrival_ns, axis=1))
        t_s = rows[:, 1].copy()
        for k, came_s in enumerate(rows[:, 0].tolist()):
            passed_s = came_s - self._arrival_s
            if abs(t_s[k] + self._set_s - self._newest_s - passed_s) > JUMP_S:
                self.jumps += 1
                self._set_s = self._newest_s + passed_s - t_s[k]
            t_s[k] += self._set_s
            if not t_s[k] <= self._newest_s:
                self._newest_s, self._arrival_s = float(t_s[k]), came_s
        for chunk in self._chunks.of(t_s, rows[:, 2:5], rows[:, 5:8]):
            yield replace(chunk, t_arrival_ns=arrival_ns)

    def _in_line(self, rows: Floats) -> Floats:
        """These samples and the one that waited (n, 8), without those out of line and one that has to wait."""
        rows[:, 1] += self._wrapped_s
        known = np.concatenate([self._given, self._waiting, rows])
        t_s = unwrapped(known[:, 1], self._period_s)
        self._wrapped_s += float((t_s - known[:, 1])[-1:].sum())
        known[:, 1] = t_s
        off = out_of_line(t_s, self._period_s)
        self.off += int(off.sum())
        known = known[~off]
        follows = 0.0 < np.diff(known[-2:, 1]).sum() < ROOM * self._period_s or len(known) < 2
        done = len(known) if follows else len(known) - 1
        begin, self._given, self._waiting = len(self._given), known[:done][-1:], known[done:]
        return known[begin:done]
