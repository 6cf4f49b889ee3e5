# SPDX-License-Identifier: MIT
"""Numbers in CSV files that no sensor and no clock gives."""

from __future__ import annotations

import math

import pytest

from echostep.offline.csv_table import number_of


@pytest.mark.parametrize("cell", ["inf", "-inf", "Infinity", "1e308", "1e400", "nan", "", "x", "1e20"])
def test_impossible_numbers_are_none(cell: str) -> None:
    assert math.isnan(number_of(cell))


@pytest.mark.parametrize("cell", ["0", "-1.5", "1.7e18", " 3 "])
def test_possible_numbers_are_read(cell: str) -> None:
    assert number_of(cell) == float(cell)
