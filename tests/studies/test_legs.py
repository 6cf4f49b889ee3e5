# SPDX-License-Identifier: MIT
"""The study of legs, once: the foot in all manners of moving, one leg where it shows something and where it does not, the paper's lap."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from echostep.errors import EchostepError
from echostep.legs.kinematics import LegLengths
from echostep.legs.stride import Flag
from echostep_studies.frame.study import StudyRequest
from echostep_studies.legs import feet as feet_part
from echostep_studies.legs import manners as manners_part
from echostep_studies.legs.feet import STEPS, FootRun, foot_rows
from echostep_studies.legs.manners import MannerRun, manner_rows
from echostep_studies.legs.study import legs_study
from echostep_studies.simulation.joint_gait import FAST, NATURAL, SLOW, WalkingPace, draw_person, simulate_gait
from legs.leg_walks import strides_of, total_m

ROUGH = {"foot/running": 2.0, "foot/crawling": 2.0}  # percent of the way; else 0.5
STAIRS = ("legs/upstairs", "legs/downstairs")


@pytest.fixture(scope="module")
def feet() -> list[FootRun]:
    return foot_rows(feet_part.PART.names, 1)


@pytest.fixture(scope="module")
def legs() -> list[MannerRun]:
    return [row for seed in range(1, 4) for row in manner_rows(manners_part.PART.names, seed)]


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
    (row,) = foot_rows(["foot/shuffling"], seed)
    assert row.ending_m < 0.3
    assert row.height_m < 0.05


def test_stairs_are_counted_by_one_leg(legs: list[MannerRun]) -> None:
    for row in (r for r in legs if r.name in STAIRS):
        assert row.stairs_percent > 80.0, row
        assert row.rise_m == pytest.approx(row.up_m, rel=0.1), row
        assert abs(row.error_over_sd) < 2.0, row


def test_what_one_leg_does_not_show_is_not_counted_and_said_to_be_unknown(legs: list[MannerRun]) -> None:
    for row in (r for r in legs if r.name not in STAIRS):
        assert row.found_m < 1.0, row
        assert row.blind_percent > 80.0, row
        assert row.sd_m > 3.0, row
        assert abs(row.error_over_sd) < 2.0, row


def test_tables(feet: list[FootRun], legs: list[MannerRun], capsys: pytest.CaptureFixture[str]) -> None:
    study = legs_study()
    for table in study.tables(study.summarize([*feet, *legs]), StudyRequest(1, 1, None, Path())):
        table.print()
    shown = capsys.readouterr().out
    assert "foot/hurried" in shown
    assert "legs/crawling" in shown


def test_rows_are_chosen_by_name() -> None:
    assert [row.name for row in legs_study("foot/shuf*").run(1)] == ["foot/shuffling"]
    with pytest.raises(EchostepError, match="no row is named so; there are: legs/slow"):
        legs_study("lap/none")


@pytest.mark.slow
def test_the_lap_of_the_paper_by_its_method_and_by_ours() -> None:
    """The paper's one real lap ended 8 m off; by legs, belt and compass alone ours ends nearer, and nearest on the plan."""
    rows = {row.name: row for row in legs_study("lap/*").run(1)}
    assert list(rows) == ["lap/lee2010", "lap/default", "lap/default+plan"]
    assert 8.0 > rows["lap/lee2010"].ending_m > rows["lap/default"].ending_m > rows["lap/default+plan"].ending_m
    assert abs(rows["lap/lee2010"].distance_error_percent) < 2.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("manner", "seconds", "mean", "flag"),
    [(SLOW, 6.0, 0.04, Flag.SLOW), (NATURAL, 4.0, 0.04, Flag.NONE), (FAST, 3.0, 0.04, Flag.FAST)],
)
def test_people_by_their_joint_curves(manner: WalkingPace, seconds: float, mean: float, flag: Flag) -> None:
    errors, flags = [], []
    for seed in range(16):
        rng = np.random.default_rng(seed)
        person = draw_person(rng)
        gait = simulate_gait(person, manner, seconds, rng)
        strides = strides_of(
            gait.t_s, gait.thigh_rad_s, -gait.shank_rad_s, LegLengths(person.leg.thigh_m, person.leg.shank_m)
        )
        errors.append(total_m(strides) / float(gait.way_m[-1]) - 1.0)
        flags += [s.flags for s in strides if s.length_m > 0.5 and Flag.EDGE not in s.flags]
    assert np.abs(errors).mean() < mean
    assert sum(flag in f if flag else not f for f in flags) > 0.5 * len(flags)
