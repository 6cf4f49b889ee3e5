# SPDX-License-Identifier: MIT
"""Small runs of the study `simple`, which every later change has to pass, and sweeps of `evaluate echoes` from files."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from command_line import echostep
from echostep.echoes.likelihood import echo_model
from echostep.errors import EchostepError
from echostep.path import MeasuredSegment, PathSegment
from echostep_studies.bench.walks import SimulatedWalk
from echostep_studies.echoes.placing import grid_table, place
from echostep_studies.echoes.sweep_rows import LIMITS_KNOWN, REAL_SHARES, share_rows
from echostep_studies.echoes.sweeps import ROOM, Sweep, read_sweeps, simulated_sweeps
from echostep_studies.simple.buildings import BUILDINGS
from echostep_studies.simple.faults import FAULTS, PASSER_M
from echostep_studies.simple.study import NAMES, SimpleRow, simple_run

# Mean error of one walk with a ranger; of 20 walks it is below 0.2 m in every row but a corridor of 60 m
WORST_M = 0.35


def made_walk() -> SimulatedWalk:
    """Ten segments of half a second, six pings each, all of them 1 m."""
    segments = []
    for k in range(10):
        path = PathSegment(0.5 * k, 0.5 * k + 0.5, 0.0, 0.0, 0.0, 0.0, 0.01, 0.001, 0)
        t_s = path.t0_s + np.linspace(0.05, 0.45, 6)
        segments.append(MeasuredSegment(path, t_s, np.arange(6) % 2, np.ones(6)))
    truth = np.column_stack([np.linspace(0.0, 5.0, 11), np.zeros((11, 4))])
    return SimulatedWalk(BUILDINGS["room-5x4"](1).built, tuple(segments), truth)


def ranges_after(fault: str) -> list[float]:
    """All ranges of the made walk after a fault."""
    return [value for segment in FAULTS[fault](made_walk()).segments for value in segment.range_m.tolist()]


@pytest.mark.parametrize(
    ("fault", "first", "silent"), [("/silent-3", 0, 3), ("/silent-20", 0, 20), ("/silent-middle", 30, 10)]
)
def test_so_many_pings_are_silent(fault: str, first: int, silent: int) -> None:
    missing = np.flatnonzero(np.isnan(ranges_after(fault)))
    assert missing.tolist() == list(range(first, first + silent))


def test_the_other_faults() -> None:
    assert ranges_after("") == [1.0] * 60
    assert np.isnan(ranges_after("/dead-ranger")).sum() == 30
    assert ranges_after("/one-ranger") == [1.0] * 30
    assert ranges_after("/foot-alone") == []
    beside = np.array(ranges_after("/passer-by"))
    assert (beside[:36:2] == PASSER_M).all()
    assert (beside[1::2] == 1.0).all()
    assert (beside[36:] == 1.0).all()


def small_run(building: str, *faults: str) -> dict[str, SimpleRow]:
    """One walk in a building with these faults, by fault."""
    return {row.name.removeprefix(building): row for row in simple_run([f"{building}{fault}" for fault in faults], 1)}


@pytest.mark.study
@pytest.mark.parametrize(
    "building",
    [
        "corridor-20",
        *(
            pytest.param(name, marks=pytest.mark.long)
            for name in ("flat", "corridor-8", "corridor-30", "corridor-open", "L", "room-5x4", "room-8x6")
        ),
    ],
)
def test_a_known_start_is_tracked_whatever_the_rangers_do_at_first(building: str) -> None:
    for row in small_run(building, "", "/silent-3", "/silent-20", "/passer-by", "/dead-ranger").values():
        assert row.tracking >= 0.97, row
        assert row.lost == 0.0, row
        assert row.mean_m < WORST_M, row


@pytest.mark.study
@pytest.mark.parametrize("building", ["corridor-20", "room-8x6"])
def test_a_heading_that_was_stated_wrong_is_found(building: str) -> None:
    """Both buildings are their own mirror images: only the start tells which end is which."""
    (row,) = simple_run([f"{building}/turned"], 6001)
    assert row.mean_m < WORST_M
    assert row.false_tracking == 0.0


@pytest.mark.study
@pytest.mark.parametrize(
    ("building", "fault"),
    [
        ("corridor-20", "/foot-alone"),
        ("flat", "/off-foot"),
        pytest.param("flat", "/foot-alone", marks=pytest.mark.long),
        pytest.param("hall", "/foot-alone", marks=pytest.mark.long),
    ],
)
def test_a_foot_alone_is_led_by_the_plan(building: str, fault: str) -> None:
    """It is closer than the foot laid on the plan, and never lost or falsely sure; the last from a start that is off."""
    row = small_run(building, fault)[fault]
    assert row.rmse_m < row.laid_m
    assert row.lost == 0.0
    assert row.false_tracking == 0.0


@pytest.mark.process
def test_the_command_names_its_rows(tmp_path: Path) -> None:
    assert len(NAMES) == len(set(NAMES)) == len(BUILDINGS) * (len(FAULTS) + 4)
    wrong = echostep("evaluate", "simple", "--rows", "corridor-7", "--out", tmp_path)
    assert wrong.returncode != 0
    assert "corridor-20/silent-3" in wrong.stderr


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


def test_a_sweep_tells_its_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a coarser grid, still finer than what counts as found."""
    monkeypatch.setattr("echostep_studies.echoes.placing.GRID_M", 0.08)
    table, model = grid_table(ROOM), echo_model(LIMITS_KNOWN)
    sweep = simulated_sweeps(1).sweeps[0]
    assert place(sweep, table, model).known
    deaf = Sweep(sweep.x_m, sweep.y_m, sweep.heading_rad, sweep.bearing_rad, np.full(len(sweep.range_m), math.nan))
    assert not place(deaf, table, model).all
