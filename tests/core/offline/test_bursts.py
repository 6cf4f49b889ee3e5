# SPDX-License-Identifier: MIT
"""Times that come in bursts are spread evenly and told; numbers that no sensor and no clock gives are none."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.offline.bursts import spread
from echostep.offline.csv_table import EARLY_ROWS, CsvLimits, number_of, read_rows
from echostep.offline.imu_csv import load_imu

EVEN_S: Floats = np.arange(0.0, 24.865, 0.01)


def stamped(burst: int, apart_s: float, t_s: Floats = EVEN_S) -> Floats:
    """A queue of `burst` samples emptied when the last one has come, each stamped `apart_s` after the one before."""
    k = np.arange(len(t_s))
    last = t_s[np.minimum(k // burst * burst + burst - 1, len(t_s) - 1)]
    return np.asarray(last + apart_s * (k % burst))


@pytest.mark.parametrize("burst", [2, 3, 4, 8])
@pytest.mark.parametrize("apart_s", [0.0, 0.0002])
def test_bursts_are_spread_over_the_time_since_the_burst_before(burst: int, apart_s: float) -> None:
    t_s, notes = spread(stamped(burst, apart_s))
    assert np.abs(t_s - EVEN_S).max() < 0.01  # the last burst may be short: its stamp is that of its own last sample
    assert np.abs(t_s - EVEN_S)[:-burst].max() < 1e-9
    assert notes == (f"times come in bursts of {burst}: spread evenly, 100 samples a second",)


def test_a_pause_stays_a_pause() -> None:
    true_s = EVEN_S + 3.0 * (np.arange(len(EVEN_S)) >= 1000)
    t_s, _ = spread(stamped(2, 0.0, true_s))
    assert np.abs(t_s - true_s)[:-2].max() < 1e-9


def test_even_and_jittered_times_are_left_alone() -> None:
    jitter = np.abs(np.random.default_rng(5).normal(0, 0.003, len(EVEN_S)))
    late: Floats = np.maximum.accumulate(EVEN_S / 2 + jitter)
    others: list[Floats] = [EVEN_S, EVEN_S[:4], np.round(EVEN_S / 2, 3), late, EVEN_S[::-1]]
    for t_s in others:
        same, notes = spread(t_s)
        assert same is t_s
        assert notes == ()


@pytest.mark.parametrize("apart_s", [0.0, 0.0002])
def test_a_file_with_bursts_is_used_whole_and_says_so(tmp_path: Path, apart_s: float) -> None:
    rng = np.random.default_rng(1)
    accel, gyro = rng.normal([0.0, 0.0, 9.81], 0.05, (2487, 3)), rng.normal(0.0, 0.02, (2487, 3))
    table = np.column_stack([stamped(3, apart_s), accel, gyro])
    np.savetxt(tmp_path / "f.csv", table, delimiter=",", header="t_s,ax,ay,az,gx,gy,gz", comments="", fmt="%.6f")
    imu = load_imu(tmp_path / "f.csv")
    assert len(imu.t_s) == 2487
    assert imu.notes == ("times come in bursts of 3: spread evenly, 100 samples a second",)


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
