# SPDX-License-Identifier: MIT
"""The study of teams on a short one: who meets whom, and what the rows say."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from board_runs import ROOT
from echostep.arrays import Floats
from echostep.evaluate.study import StudyRequest, run_study
from echostep.evaluate.team import study, walks
from echostep.evaluate.team.walks import AGAIN_S, encounters
from echostep.plan.model import load_plan

PLAN = load_plan(ROOT / "host/echostep/plans/demo.json")
T_S = np.arange(0.0, 100.0, 0.02)


def walked(x_m: Floats | float, y_m: float, z_m: float = 0.0) -> Floats:
    """A truth along x."""
    zero = np.zeros_like(T_S)
    return np.column_stack([T_S, zero + x_m, zero + y_m, zero, zero + z_m])


def test_two_who_pass_in_a_corridor_meet_at_their_nearest() -> None:
    """In the corridor of the demo office (y from 6.5 to 8.5 m), at 1 m/s each, once; not through a wall and not on another floor."""
    going, coming = walked(4.0 + 0.15 * T_S, 7.2), walked(20.0 - 0.15 * T_S, 7.8)
    (met,) = encounters(PLAN, [going, coming])
    assert met.who == (0, 1)
    assert met.t_s == pytest.approx(16.0 / 0.3, abs=0.02)
    assert met.distance_m == pytest.approx(0.6, abs=0.01)
    assert not encounters(PLAN, [walked(4.5 + 0.05 * T_S, 8.2), walked(7.5, 8.8)])  # an office's wall between
    assert not encounters(PLAN, [going, walked(20.0 - 0.15 * T_S, 7.8, 3.0)])


def test_two_who_stay_together_meet_once_and_again_after_a_while() -> None:
    swinging = walked(10.0 + 3.0 * np.sin(2.0 * np.pi * T_S / 10.0), 7.2)
    met = encounters(PLAN, [swinging, walked(10.0, 7.8)])
    assert len(met) == 100.0 // AGAIN_S or len(met) == 100.0 // AGAIN_S + 1
    assert min(np.diff([e.t_s for e in met])) >= AGAIN_S
    assert len(encounters(PLAN, [walked(10.0, 7.2), walked(10.0, 7.8)])) == 1


def test_the_columns_are_those_of_all_wearers() -> None:
    row = {"name": "office/tap", "seed": 1, "meetings": 2, "false_alone": 0.0, "false_together": 0.0}
    rows = [
        row | {"wearer": k, "alone_m": a, "together_m": b, "again_m": a}
        for k, a, b in ((0, 4.0, 1.0), (1, 0.5, 0.5), (2, 0.5, 0.55))
    ]
    found = study._summary(rows)
    assert (found["ratio"], found["worst"], found["by_chance"]) == (0.41, 1.1, 1.0)
    assert (found["first_alone_m"], found["others_together_m"]) == (4.0, 0.525)


def test_a_short_team(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two wearers; the first one's start is wrong. Both are told of an encounter that is put at 12 s, and it changes the first one's track alone."""
    for module in (walks, study):
        monkeypatch.setattr(module, "WEARERS", 2)
    made = walks.team_walks

    def with_encounter(*args: Any, **more: Any) -> walks.TeamWalks:
        team = made(*args, **more)
        same = replace(team, chunks=(team.chunks[0],) * 2, truth=(team.truth[0],) * 2, starts=(team.starts[0],) * 2)
        return replace(same, encounters=(walks.Encounter(12.0, (0, 1), 0.0),))

    monkeypatch.setattr(study, "team_walks", with_encounter)
    short = replace(study.team_study("office/tap", 12.0), journal=False)
    run_study(short, StudyRequest(1, 3, tmp_path / "rows.json", tmp_path))
    (row,) = json.loads((tmp_path / "rows.json").read_text())["rows"]
    assert set(study.COLUMNS) <= set(row)
    assert row["first_alone_m"] > 3.0
    assert row["first_together_m"] < row["first_alone_m"]
    assert row["worst"] == pytest.approx(1.0, abs=0.05)
