# SPDX-License-Identifier: MIT
"""The study of manners of moving, once: the foot in all of them, the legs where one leg shows something and where it does not."""

from __future__ import annotations

from pathlib import Path

import pytest

from echostep_simulation.people.rolling_foot import MANNERS
from echostep_studies.frame.study import StudyRequest
from echostep_studies.gaits.foot import STEPS, FootRun, foot_row, foot_rows
from echostep_studies.gaits.legs import LegRun, leg_rows
from echostep_studies.gaits.study import STUDY, summarize

ROUGH = {"foot/running": 2.0, "foot/crawling": 2.0}  # percent of the way; else 0.5
STAIRS = ("legs/upstairs", "legs/downstairs")


@pytest.fixture(scope="module")
def feet() -> list[FootRun]:
    return foot_rows(1)


@pytest.fixture(scope="module")
def legs() -> list[LegRun]:
    return [row for seed in range(1, 4) for row in leg_rows(seed)]


def test_the_foot_follows_every_manner(feet: list[FootRun]) -> None:
    assert {"foot/hurried", "foot/crawling", "foot/up a ladder", "foot/sideways", "foot/downstairs"} < {
        r.name for r in feet
    }
    for row in feet:
        assert abs(row.way_percent) < ROUGH.get(row.name, 0.5), row
        assert row.ending_m < 0.03 * row.way_m, row
        assert row.steps_percent == pytest.approx(100.0, abs=100.0 / STEPS), row


@pytest.mark.parametrize("seed", [2, 3, 4])
def test_smooth_steps_are_no_rest(seed: int) -> None:
    """A shuffling foot accelerates smoothly; taken for a rest in mid swing, it was lost by kilometres."""
    row = foot_row("shuffling", MANNERS["shuffling"], seed)
    assert row.ending_m < 0.3
    assert row.height_m < 0.05


def test_stairs_are_counted_by_one_leg(legs: list[LegRun]) -> None:
    for row in (r for r in legs if r.name in STAIRS):
        assert row.stairs_percent > 80.0, row
        assert row.rise_m == pytest.approx(row.up_m, rel=0.1), row
        assert abs(row.error_over_sd) < 2.0, row


def test_what_one_leg_does_not_show_is_not_counted_and_said_to_be_unknown(legs: list[LegRun]) -> None:
    for row in (r for r in legs if r.name not in STAIRS):
        assert row.found_m < 1.0, row
        assert row.blind_percent > 80.0, row
        assert row.sd_m > 3.0, row
        assert abs(row.error_over_sd) < 2.0, row


def test_tables(feet: list[FootRun], legs: list[LegRun], capsys: pytest.CaptureFixture[str]) -> None:
    for table in STUDY.tables(summarize([*feet, *legs]), StudyRequest(1, 1, None, Path())):
        table.print()
    shown = capsys.readouterr().out
    assert "foot/hurried" in shown
    assert "legs/crawling" in shown
