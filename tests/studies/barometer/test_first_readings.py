# SPDX-License-Identifier: MIT
"""The first readings of a barometer may be its reset value: they make no rise, in a filter and in a file, and a file says that they were left out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from echostep_studies.barometer.altitude import Pressures, heights_above_start
from echostep_studies.barometer.pressure_csv import load_pressures

RNG = np.random.default_rng(1)
T_S = np.arange(0, 150, 0.1)
CLIMB_PA = 100_944.0 * np.exp(-np.interp(T_S, [0, 60, 75, 150], [0, 0, 3.5, 3.5]) / 8434) + RNG.normal(0, 1.5, 1500)


@pytest.mark.parametrize("first_pa", [None, 81_732.34, 60_982.0, 100_884.0, 100_794.0, 100_994.0])
def test_a_wrong_first_sample_makes_no_rise_and_hides_none(first_pa: float | None) -> None:
    pressure_pa = CLIMB_PA.copy()
    if first_pa:
        pressure_pa[0] = first_pa
    height_m = heights_above_start(Pressures(T_S, pressure_pa), 1.5).height_m
    assert height_m[1400] - height_m[500] == pytest.approx(3.5, abs=0.3)
    assert height_m[-1] == pytest.approx(3.5, abs=0.3)


def test_a_lift_from_the_first_sample_on_is_a_rise() -> None:
    pressure_pa = 101_325.0 * np.exp(-np.minimum(5.0 * T_S, 60.0) / 8434)
    assert heights_above_start(Pressures(T_S, pressure_pa), 3.0).height_m[-1] == pytest.approx(60.0, abs=2.0)


@pytest.mark.parametrize(("wrong", "pa"), [(0, 0.0), (1, 68_500.0), (5, 118_000.0)])
def test_a_file_says_how_many_first_readings_were_left_out(tmp_path: Path, wrong: int, pa: float) -> None:
    pressure_pa = CLIMB_PA.copy()
    pressure_pa[:wrong] = pa
    rows = "\n".join(f"{t:.2f},{p:.2f}" for t, p in zip(T_S.tolist(), pressure_pa.tolist(), strict=True))
    (tmp_path / "p.csv").write_text(f"t_s,pressure_pa\n{rows}\n")
    record = load_pressures(tmp_path / "p.csv")
    assert len(record.samples.t_s) == len(T_S) - wrong
    expected = f"{wrong} rows before the barometer had settled, as its reset value: skipped (first: line 2)"
    assert record.notes == ((expected,) if wrong else ())


def test_a_spike_or_a_slammed_door_in_the_middle_leaves_nothing_out(tmp_path: Path) -> None:
    pressure_pa = CLIMB_PA.copy()
    pressure_pa[300] = 99_000.0
    pressure_pa[500:503] -= 60.0
    rows = "\n".join(f"{t:.2f},{p:.2f}" for t, p in zip(T_S.tolist(), pressure_pa.tolist(), strict=True))
    (tmp_path / "p.csv").write_text(f"t_s,pressure_pa\n{rows}\n")
    assert load_pressures(tmp_path / "p.csv").notes == ()
