# SPDX-License-Identifier: MIT
"""Lines of a CSV file from anybody, of bounded length.

In: an open text file. Out: its lines, one by one; names and separator of the first one; ValueError for a line that is too long. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TextIO

LONGEST_LINE = 10_000  # characters; by reason: no line of numbers is longer
EARLY_ROWS = 2000  # rows after which a file of garbage is given up
SEPARATORS = ",;\t"


@dataclass(frozen=True, slots=True)
class CsvLimits:
    """`line_chars`: a longer line is an error. `lines`: reading stops after so many. `early_rows`: rows after which garbage is given up, or None."""

    line_chars: int = LONGEST_LINE
    lines: int | None = None
    early_rows: int | None = EARLY_ROWS


def separator_of(first_line: str) -> str:
    """The most frequent of comma, semicolon and tab."""
    return max(SEPARATORS, key=first_line.count)


def header_of(first_line: str) -> tuple[list[str], str]:
    """Names of the columns in the first line, and the separator."""
    separator = separator_of(first_line)
    return [name.strip().strip('"') for name in first_line.split(separator)], separator


def lines_of(file: TextIO, limits: CsvLimits, first: int = 1) -> Iterator[str]:
    """Lines of bounded length, the next one being number `first`; raises ValueError for a longer one."""
    number = first - 1
    while (limits.lines is None or number < limits.lines) and (line := file.readline(limits.line_chars)):
        number += 1
        if len(line) == limits.line_chars:
            raise ValueError(f"line {number} is longer than {limits.line_chars} characters: is this a CSV file?")
        yield line
