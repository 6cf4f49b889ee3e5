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
from echostep.offline.imu_csv import COLUMNS
from echostep.ports.chunks import Chunk
from echostep_app.offline.foreign_columns import read_header
from echostep_app.offline.importing import ImuChunks

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
        return values if (np.abs(values) < MOST).all() else None

    def _name_columns(self, line: str) -> bool:
        """Take the names of the columns from a line; False if it has not all of them."""
        if line == self.header:
            return True
        try:
            head = read_header(iter([line]))
            lacks = min(column_of(head.names, name) for name in COLUMNS) < 0
        except ValueError:
            return False
        if lacks or head.counts_hz is not None:
            return False
        self.header, self._columns = line, head
        return True


_LINE_ENDS = bytes.maketrans(b"\0\r", b"\n\n")


class LineChunks:
    """Samples as chunks that arrive when their bytes did. `jumps`: how often the device's clock was set. `left_out`: as of `ImuChunks`."""

    def __init__(self, rate_hz: float) -> None:
        self.jumps = 0
        self._chunks = ImuChunks(rate_hz)
        # Added to the device's times; of the newest sample
        self._set_s, self._newest_s, self._arrival_ns = (0.0, math.nan, 0)

    @property
    def left_out(self) -> int:
        """Samples within the same period as the one before, or before it."""
        return self._chunks.left_out

    def of(self, samples: Floats, arrival_ns: int) -> Iterator[Chunk]:
        """Chunks of samples (n, 7)."""
        samples = samples.copy()
        for row in samples:
            passed_s = (arrival_ns - self._arrival_ns) * 1e-9
            if abs(row[0] + self._set_s - self._newest_s - passed_s) > JUMP_S:
                self.jumps += 1
                self._set_s = self._newest_s + passed_s - row[0]
            row[0] += self._set_s
            if not row[0] <= self._newest_s:
                self._newest_s, self._arrival_ns = float(row[0]), arrival_ns
        for chunk in self._chunks.of(samples[:, 0], samples[:, 1:4], samples[:, 4:7]):
            yield replace(chunk, t_arrival_ns=arrival_ns)
