# SPDX-License-Identifier: MIT
"""Numbers in CSV files that no sensor and no clock gives."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest

from echostep.offline.csv_table import EARLY_ROWS, CsvLimits, number_of, read_rows


@pytest.mark.parametrize("cell", ["inf", "-inf", "Infinity", "1e308", "1e400", "nan", "", "x", "1e20"])
def test_impossible_numbers_are_none(cell: str) -> None:
    assert math.isnan(number_of(cell))


@pytest.mark.parametrize("cell", ["0", "-1.5", "1.7e18", " 3 "])
def test_possible_numbers_are_read(cell: str) -> None:
    assert number_of(cell) == float(cell)


def test_a_file_of_garbage_is_given_up_early() -> None:
    read = list[int]()

    def lines() -> Iterator[str]:
        for k in range(10 * EARLY_ROWS):
            read.append(k)
            yield "x\n" if k % 3 else "1\n"

    with pytest.raises(ValueError, match="67 % of the first 2000 rows have no number"):
        read_rows(lines(), (["a"], ","), [0], 1, CsvLimits())
    assert len(read) == EARLY_ROWS
