# SPDX-License-Identifier: MIT
"""One reader for CSV files of samples: named columns of numbers, in any of three dialects.

In: a text file of any origin, whose first line names the columns, separated by comma, or by semicolon or tab (then also with decimal commas).
Out: `CsvTable` with the wanted columns, NaN where there is no number; ValueError for a file that is not such a table, or a line that is too long.
Owns nothing.
"""

from __future__ import annotations

import csv
import math
import re
from array import array
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TextIO, TypeVar

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.errors import EchostepError, replaced

LONGEST_LINE = 10_000  # characters: no line of numbers is longer
EARLY_ROWS = 2000  # rows after which a file of garbage is given up
UTF_16 = (b"\xff\xfe", b"\xfe\xff")  # byte order marks [Unicode 2.13]: Excel's "Unicode text"
JSON = re.compile(rb"\s*[\[{]\s*[\[{\"]")  # begin of a file of objects
SEPARATORS = ",;\t"
MOST_BAD = 0.5  # share of rows without a number in a required column
GREATEST = 1e19  # of any number: nanoseconds since 1970 have 19 digits

Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class CsvLimits:
    """`line_chars`: a longer line is an error. `lines`: more are an error. `early_rows`: rows after which garbage is given up, or None."""

    line_chars: int = LONGEST_LINE
    lines: int | None = None
    early_rows: int | None = EARLY_ROWS


def header_of(first_line: str) -> tuple[list[str], str]:
    """Names of the columns in the first line, and the separator: the most frequent of comma, semicolon and tab."""
    separator = max(SEPARATORS, key=first_line.count)
    return [name.strip().strip('"') for name in next(csv.reader([first_line], delimiter=separator), [""])], separator


def is_comment(line: str) -> bool:
    """Whether a line above the names of the columns is words after a #, and not these names."""
    return line.lstrip().startswith("#") and (":" in line or not any(mark in line for mark in SEPARATORS))


def column_of(header: Sequence[str], name: str) -> int:
    """Index of the column of this name, -1 where the file lacks it; raises ValueError when it has two."""
    if header.count(name) > 1:
        raise ValueError(f"two columns are named {name}: which one is meant? rename the other one")
    return header.index(name) if name in header else -1


def lines_of(file: TextIO, limits: CsvLimits, first: int = 1) -> Iterator[str]:
    """Lines of bounded length, the next one being number `first`; raises ValueError for a longer one, and for more than `limits.lines`."""
    number = first - 1
    while line := file.readline(limits.line_chars):
        number += 1
        if limits.lines is not None and number > limits.lines:
            raise ValueError(f"more than {limits.lines} lines: cut the recording into parts")
        if len(line) == limits.line_chars:
            raise ValueError(f"line {number} is longer than {limits.line_chars} characters: is this a CSV file?")
        yield line


@dataclass(frozen=True, slots=True)
class CsvTable:
    """`values` (n, k) of the wanted columns, NaN where there is no number; `line` (n,): number of each row's line in the file."""

    values: Floats
    line: Ints


def open_samples(path: Path | str, read: Callable[[TextIO], Result]) -> Result:
    """Result of `read` on the file; OSError and ValueError become an EchostepError that names the file."""
    try:
        if Path(path).exists() and not Path(path).is_file():
            raise ValueError("no file, but a folder, pipe or device: write the samples to a file, and give that")
        with Path(path).open("rb") as begin:
            first = begin.read(32)
        kind = "JSON" if JSON.match(first) else "binary" if b"\0" in first and first[:2] not in UTF_16 else ""
        if what := replaced(first) or (kind and f"{kind}, not a table: export it as CSV"):
            raise ValueError(what)
        encoding = "utf-16" if first[:2] in UTF_16 else "utf-8-sig"
        with Path(path).open(newline=None, encoding=encoding, errors="replace") as file:
            return read(file)
    except OSError as error:
        raise EchostepError(f"{path}: cannot read the samples: {error.strerror}") from error
    except ValueError as error:
        raise EchostepError(f"{path}: {error}") from error


def read_rows(lines: Iterator[str], header: tuple[list[str], str], columns: Sequence[int], required: int,
              limits: CsvLimits, first: int = 2) -> CsvTable:  # fmt: skip
    """Rows of the lines after the header, from line `first` on; empty lines are skipped.

    `columns`: index of each wanted column, -1 if the file lacks it.

    A row with more cells than the header has names counts as a row without numbers: a decimal comma between commas moves all cells after it. With
    `limits.early_rows`, raises ValueError when fewer than two rows exist, or when most of them lack a number in one of the first `required` columns.
    """
    (names, separator), values, numbers, bad = header, array("d"), array("q"), 0
    for number, line in enumerate(lines, start=first):
        if not line.strip():
            continue
        cells = next(csv.reader([line], delimiter=separator)) if '"' in line else line.split(separator)
        fits = not any(map(str.strip, cells[len(names) :]))
        row = [number_of(cells[k].replace(",", ".")) if fits and 0 <= k < len(cells) else math.nan for k in columns]
        values.extend(row)
        numbers.append(number)
        bad += not all(map(math.isfinite, row[:required]))
        if len(numbers) == limits.early_rows and bad > MOST_BAD * len(numbers):
            break
    if limits.early_rows is not None and len(numbers) < 2:
        raise ValueError("no samples")
    if limits.early_rows is not None and bad > MOST_BAD * len(numbers):
        share = f"{100 * bad / len(numbers):.0f} % of the first {len(numbers)} rows"
        raise ValueError(
            f"{share} have no number in some column, or more cells than there are names: each row needs all"
        )
    return CsvTable(np.array(values).reshape(-1, len(columns)), np.array(numbers))


def number_of(text: str) -> float:
    """The number in a cell, or the seconds from 1970 to an ISO 8601 date and time (UTC without a zone), from midnight to a time; NaN if none."""
    if ":" in text:
        text = text.strip(' "\n')
        for date in (text, f"1970-01-01 {text}"):
            with suppress(ValueError):
                at = datetime.fromisoformat(date)
                return at.replace(tzinfo=at.tzinfo or UTC).timestamp()
    try:
        number = float(text)
    except ValueError:
        return math.nan
    return number if abs(number) <= GREATEST else math.nan
