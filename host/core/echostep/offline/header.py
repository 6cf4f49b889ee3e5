# SPDX-License-Identifier: MIT
"""The first line of a CSV file: which column is which, and its unit.

In: lines. Out: `Header`. Owns nothing. A reader of other programs' files makes a `Header` with their names, units and counters.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain

import numpy as np

from echostep.arrays import Floats
from echostep.offline.csv_table import CsvLimits, CsvTable, column_of, header_of, read_rows


@dataclass(frozen=True, slots=True)
class Header:
    """`names` of the columns, this project's where they are known; `line`: of the file, above the first row; `factors` to SI by name.

    `counts_hz`: counts a second, if `t_s` is a counter, which wraps after `counts_period`. `notes`: which logger was recognised.
    `advice`: for a file that lacks a column. `begin`: the first lines of numbers, which were read to know the units.
    """

    names: list[str]
    separator: str
    line: int
    factors: Mapping[str, float] = field(default_factory=dict)
    counts_hz: float | None = None
    counts_period: int = 1
    notes: tuple[str, ...] = ()
    advice: str = ""
    begin: tuple[str, ...] = ()

    def table(self, lines: Iterator[str], names: Sequence[str], required: int, limits: CsvLimits) -> CsvTable:
        """Columns of these names in SI units, of `begin` and of the lines after it, as `read_rows` has them; NaN for a column that is not there."""
        head, columns = (self.names, self.separator), [column_of(self.names, name) for name in names]
        rows = read_rows(chain(self.begin, lines), head, columns, required, limits, self.line + 1)
        scaled: Floats = rows.values * [self.factors.get(name, 1.0) for name in names]
        if self.counts_hz is not None:
            time = list(names).index("t_s")
            whole = np.isfinite(rows.values[:, time])
            counts = np.unwrap(rows.values[whole, time], period=self.counts_period)
            scaled[whole, time] = (counts - counts[:1]) / self.counts_hz
        return CsvTable(scaled, rows.line)


HeaderReader = Callable[[Iterator[str]], Header]  # takes the lines up to the names of the columns


def own_header(lines: Iterator[str]) -> Header:
    """The names in the first line, as they are, in SI units."""
    names, separator = header_of(next(lines, ""))
    return Header(names, separator, 1)
