# SPDX-License-Identifier: MIT
"""`evaluate echoes --sweeps DIR`: sweeps from files, their shares by angle, and the place that one sweep tells."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from echostep.echoes.likelihood import echo_model
from echostep.errors import EchostepError
from echostep_studies.echoes.placing import grid_table, place
from echostep_studies.echoes.sweep_rows import LIMITS_KNOWN, REAL_SHARES, share_rows
from echostep_studies.echoes.sweeps import ROOM, Sweep, read_sweeps, simulated_sweeps

WALLS = "x0,y0,x1,y1\n" + "\n".join(",".join(map(str, row)) for row in ROOM.tolist())
HEADER = "x_m,y_m,heading_deg,bearing_deg,range_m\n"


def folder_of(tmp_path: Path, sweep: str, walls: str = WALLS) -> Path:
    (tmp_path / "walls.csv").write_text(walls)
    (tmp_path / "a.csv").write_text(sweep)
    return tmp_path


def as_csv(sweep: Sweep) -> str:
    rows = zip(np.degrees(sweep.bearing_rad).tolist(), sweep.range_m.tolist(), strict=True)
    heading = math.degrees(sweep.heading_rad)
    return "".join(f"{sweep.x_m},{sweep.y_m},{heading},{bearing},{'' if math.isnan(z) else z}\n" for bearing, z in rows)


def test_sweeps_are_cut_where_the_place_changes(tmp_path: Path) -> None:
    made = simulated_sweeps(1).sweeps[:3]
    found = read_sweeps(folder_of(tmp_path, HEADER + "".join(map(as_csv, made))))
    assert found.walls == pytest.approx(ROOM)
    assert len(found.sweeps) == 3
    for a, b in zip(found.sweeps, made, strict=True):
        assert (a.x_m, a.y_m, a.heading_rad) == pytest.approx((b.x_m, b.y_m, b.heading_rad))
        assert a.bearing_rad == pytest.approx(b.bearing_rad)
        assert a.range_m == pytest.approx(b.range_m, nan_ok=True)


@pytest.mark.parametrize(
    ("sweep", "walls", "says"),
    [
        ("x_m,y_m\n1,2\n1,2\n", WALLS, "a.csv: no column heading_deg"),
        (HEADER, WALLS, "a.csv: no samples"),
        ("", WALLS, "a.csv: no column x_m"),
        ("\0\xff" * 50, WALLS, "a.csv: binary, not a table"),
        (HEADER + "1,1,0,0,1\n1,1,0,5,1\n", "a,b,c,d\n0,0,1,0\n0,0,1\n", "walls.csv: a wall lacks a number"),
        (HEADER + "1,1,0,0,1\n1,1,0,5,1\n", "", "walls.csv"),
    ],
)
def test_files_that_are_none_end_with_one_line(tmp_path: Path, sweep: str, walls: str, says: str) -> None:
    with pytest.raises(EchostepError, match=says) as error:
        read_sweeps(folder_of(tmp_path, sweep, walls))
    assert "\n" not in str(error.value)


def test_a_folder_without_walls_or_sweeps_says_what_is_needed(tmp_path: Path) -> None:
    with pytest.raises(EchostepError, match=r"walls\.csv: not there"):
        read_sweeps(tmp_path)
    (tmp_path / "walls.csv").write_text(WALLS)
    with pytest.raises(EchostepError, match="no sweep"):
        read_sweeps(tmp_path)


def test_simulated_shares_go_with_the_angle_like_the_real_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    """Right echoes give way to none and to too long ones."""
    monkeypatch.setattr("echostep_studies.echoes.sweeps.SWEEPS", 48)
    for row, (right, none, long) in zip(share_rows(simulated_sweeps(1)), REAL_SHARES.values(), strict=True):
        assert abs(row.right - right) < 25.0
        assert abs(row.none - none) < 25.0
        assert abs(row.long - long) < 20.0
        if right > 80:
            assert abs(row.right - right) < 10.0
            assert abs(row.none - none) < 10.0
            assert 0.25 * long < row.long < 2.0 * long


def test_a_sweep_tells_its_place() -> None:
    table, model = grid_table(ROOM), echo_model(LIMITS_KNOWN)
    sweep = simulated_sweeps(1).sweeps[0]
    assert place(sweep, table, 0.0, 0.0, model).known
    deaf = Sweep(sweep.x_m, sweep.y_m, sweep.heading_rad, sweep.bearing_rad, np.full(len(sweep.range_m), math.nan))
    assert not place(deaf, table, 0.0, 0.0, model).all
