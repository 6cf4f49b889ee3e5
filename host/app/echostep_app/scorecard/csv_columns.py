# SPDX-License-Identifier: MIT
"""A CSV file of any tracker: numbers by the names of its columns.

In: a file with a line of names, then numbers, with commas, semicolons or tabs in between; or a TUM trajectory, with spaces. Out:
`CsvColumns`. Owns nothing. Every error is one line that names the file, the line and the column.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TextIO

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.offline.csv_table import GREATEST, SEPARATORS, CsvLimits, header_of, is_comment, lines_of, open_samples

Table = tuple[tuple[str, ...], list[tuple[int, tuple[str, ...]]]]  # names; number of the line and cells of each row
MOST_ROWS = 1_000_000  # of a track: eight hours at 30 positions a second
# Format of the RGB-D SLAM benchmark of TUM, written by evo and others
TUM = "timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw"
SHOWN = 40  # characters of a wrong cell that an error repeats


@dataclass(frozen=True, slots=True)
class CsvColumns:
    """Cells of a file: `names` of its columns as written, `rows` of text, `lines`: number of the line of each row."""

    path: Path
    names: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]

    def find(self, names: Sequence[str]) -> str | None:
        """The first of these names that a column has, ignoring case; None when none has. Raises EchostepError when two have it."""
        written = {name.lower(): name for name in reversed(self.names)}
        found = next((written[name] for name in names if name in written), None)
        if found is not None and sum(name.lower() == found.lower() for name in self.names) > 1:
            raise EchostepError(
                f"{self.path}:1: two columns are named {found}: which one is meant? rename the other one"
            )
        return found

    def texts(self, name: str) -> list[str]:
        """Cells of a column."""
        k = self.names.index(name)
        return [row[k] for row in self.rows]

    def numbers(self, name: str, *, gaps: bool = False) -> Floats:
        """A column (n,) of numbers, finite unless `gaps`: then an empty cell is NaN, and infinity is allowed."""
        return np.array([self._number(row, name, cell, gaps) for row, cell in enumerate(self.texts(name))])

    def error(self, row: int, name: str, what: str) -> EchostepError:
        """An error about a cell."""
        return EchostepError(f"{self.path}:{self.lines[row]}: column {name}: {what}")

    def _number(self, row: int, name: str, cell: str, gaps: bool) -> float:
        if not cell:
            if gaps:
                return math.nan
            raise self.error(row, name, "the cell is empty, a number is expected")
        try:
            value = float(cell)
        except ValueError as error:
            raise self.error(row, name, f"{cell[:SHOWN]!r} is not a number") from error
        if not gaps and not math.isfinite(value):
            raise self.error(row, name, f"{cell[:SHOWN]!r} is not a finite number")
        if math.isfinite(value) and abs(value) > GREATEST:
            raise self.error(row, name, f"{cell[:SHOWN]!r} is greater than any number of a track, {GREATEST:g}")
        return value


def is_tum(first: str) -> bool:
    """Whether the first line belongs to a TUM trajectory: eight names or numbers with spaces in between."""
    return not any(mark in first for mark in SEPARATORS) and len(first.lstrip("# ").split()) == len(TUM)


def _read_tum(first: str, lines: Iterable[str], number: int) -> Table:
    """Names and rows of a TUM trajectory; lines that begin with # are comments."""
    rows = (
        (number, line)
        for number, line in enumerate((first, *lines), number)
        if line.strip() and not line.lstrip().startswith("#")
    )
    begin = first.split(maxsplit=1)[0][:1]
    named = begin != "#" and not begin.isdigit() and begin not in "+-."
    read = [(number, tuple(line.split())) for number, line in islice(rows, MOST_ROWS + 2)]
    return TUM, (read[1:] if named else read)[: MOST_ROWS + 1]


def _read_rows(file: TextIO) -> Table:
    """Names and rows of a file; raises ValueError."""
    lines, comments = lines_of(file, CsvLimits()), 0
    while is_comment(first := next(lines, "")) and not is_tum(first):
        comments += 1
    if is_tum(first):
        return _read_tum(first, lines, comments + 1)
    names, delimiter = header_of(first.lstrip("# "))
    reader = csv.reader(lines, delimiter=delimiter)
    rows = ((reader.line_num + 1 + comments, tuple(cell.strip() for cell in row)) for row in reader if any(row))
    try:
        return tuple(names), list(islice(rows, MOST_ROWS + 1))
    except csv.Error as error:
        raise ValueError(f"not a CSV file: {error}") from error


def read_csv(path: Path) -> CsvColumns:
    """Read a file; raises EchostepError. Empty lines are skipped, and comments (#) above the names; a # before the names is, too."""
    names, read = open_samples(path, _read_rows)
    if len(read) > MOST_ROWS:
        raise EchostepError(f"{path}: more than {MOST_ROWS} rows: cut it into parts")
    if not any(names):
        raise EchostepError(f"{path}:1: the names of the columns are expected in the first line")
    for line, row in read:
        if len(row) != len(names):
            raise EchostepError(
                f"{path}:{line}: {len(row)} cells, but {len(names)} columns have a name in line 1: is that the line of names?"
            )
    if not read:
        raise EchostepError(f"{path}: no line of numbers below the names of the columns")
    return CsvColumns(path, names, tuple(row for _, row in read), tuple(line for line, _ in read))
