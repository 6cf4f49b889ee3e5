# SPDX-License-Identifier: MIT
"""The studies of the wearer's alarm and of falls, small; and the recordings, which hold no fall."""

from __future__ import annotations

import pytest
from msgspec import UNSET, UnsetType

from echostep_studies.frame.recordings import DATA
from echostep_studies.incapacity import study as incapacity
from echostep_studies.incapacity.columns import TOLD_S, LyingRun, summarize
from echostep_studies.incapacity.fall_recordings import recorded as recorded_falls
from echostep_studies.incapacity.falls import KITS, FallRun, NoFallRun, fallen, not_fallen, tables
from echostep_studies.incapacity.study import incapacitated, one_run, recorded, work_day
from echostep_studies.simulation.falling import FALLS, NO_FALLS
from needs_data import data_or_skip


def test_every_wearer_who_cannot_move_is_told_within_35_s() -> None:
    rows = [incapacitated(seed) for seed in range(1, 41)]
    assert all(30.0 <= row.told_s <= TOLD_S for row in rows)
    (row,) = summarize(rows)
    assert (row["runs"], row["told"]) == (40, 40.0)


def test_a_wearer_who_answers_is_seldom_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(incapacity, "DAY_S", 3600.0)
    row = work_day(1.0, 1.0, True, "day", 1)
    assert row.asked > 0
    assert row.maydays == 0
    deaf = work_day(1.0, 0.0, False, "deaf", 1)
    assert deaf.maydays > 0  # the figure of the table means something


def test_the_recordings_are_counted_and_cause_no_mayday() -> None:
    rows = summarize(recorded(data_or_skip("vicon_pyshoe").parent))
    assert {row["name"] for row in rows} == {"recorded feet", "recorded legs"}
    assert all(row["maydays"] == 0 for row in rows)


def test_days_and_recordings_belong_to_the_first_seeds() -> None:
    rows = one_run(0, DATA / "missing", 1, 1)
    assert [type(row) for row in rows] == [LyingRun, FallRun, NoFallRun]


def stated(value: float | UnsetType) -> float:
    """A column that is there."""
    assert value is not UNSET
    return value


def test_falls_are_counted_by_kit_and_manner_and_the_belt_tells_them_all() -> None:
    rows = summarize([fallen(seed) for seed in range(3 * len(FALLS))])
    assert [row["name"] for row in rows[:4]] == [f"belt: {manner}" for manner in FALLS]
    assert len(rows) == len(KITS) * len(FALLS)
    assert all(row["told"] == row["runs"] and stated(row["longest_s"]) < 7.0 for row in rows[:4])
    assert all(13.0 < stated(row["mayday_s"]) < 17.0 for row in rows[:4])
    assert not any(row["early"] for row in rows)
    assert len(tables(rows)[0].rows) == len(rows)


def test_what_is_no_fall_is_counted_apart() -> None:
    rows = summarize([not_fallen(seed) for seed in range(0, 3 * len(NO_FALLS), 3)])
    assert all(row["claimed"] == 0 for row in rows)
    assert [row["name"] for row in rows] == [f"belt: {manner}" for manner in NO_FALLS]


def test_no_recording_of_feet_or_trunks_has_a_fall() -> None:
    rows = summarize(recorded_falls(data_or_skip("vicon_pyshoe").parent))
    assert [row["name"] for row in rows] == ["recorded: feet", "recorded: trunks"]
    assert all(row["claimed"] == 0 and stated(row["watched_h"]) > 0.05 for row in rows)
