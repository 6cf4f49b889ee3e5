# SPDX-License-Identifier: MIT
"""The study `simple`: its faults on a made walk, and a small run that every later change has to pass."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from command_line import echostep
from echostep.path import MeasuredSegment, PathSegment
from echostep_studies.bench.walks import SimulatedWalk
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
        "flat",
        *(
            pytest.param(name, marks=pytest.mark.long)
            for name in ("corridor-8", "corridor-30", "corridor-open", "L", "room-5x4", "room-8x6")
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
    [("corridor-20", "/foot-alone"), ("flat", "/foot-alone"), ("hall", "/foot-alone"), ("flat", "/off-foot")],
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
