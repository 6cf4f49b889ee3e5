# SPDX-License-Identifier: MIT
"""The study of the wearer's alarm, small."""

from __future__ import annotations

import pytest

from echostep_studies.frame.recordings import DATA
from echostep_studies.incapacity import study as incapacity
from echostep_studies.incapacity.columns import TOLD_S, LyingRun, summarize
from echostep_studies.incapacity.falls import FallRun, NoFallRun
from echostep_studies.incapacity.study import incapacitated, one_run, recorded, work_day
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
