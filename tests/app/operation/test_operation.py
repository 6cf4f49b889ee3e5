# SPDX-License-Identifier: MIT
"""The operation: order, words, trails, histories, and bounds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from echostep_app.operation import trails
from echostep_app.operation.operation import MOST_EVENTS
from echostep_app.operation.words import tilt_words
from echostep_app.team.messages.marks import Mark
from echostep_app.team.messages.report import ReportedAlarm
from operation.teams import TOWER, Team, place, whole_team
from page.elements.test_page_way_out import HOUSE
from waiting import until


def columns(raw: bytes, width: int) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    return np.frombuffer(raw, "<f4").reshape(-1, width)


def test_the_fallen_the_lost_and_the_silent_come_first_each_in_words() -> None:
    rows = whole_team().scene().rows
    assert [(row.name, row.state) for row in rows[:5]] == [
        ("Finn", "mayday"), ("Kim", "lost"), ("Bo", "stale"), ("Dana", "uncertain"), ("Chris", "waiting"),
    ]  # fmt: skip
    assert rows[0].words.startswith("mayday, Ground floor, ")
    assert "mayday: no motion for 40 s" in rows[0].notes
    kim, anna = rows[1], next(row for row in rows if row.name == "Anna")
    assert kim.words.startswith("lost, ")
    assert kim.words == "lost, last known 2 s ago, Ground floor, in corridor, heard 2 s ago"  # no claim of a place
    assert anna.words.endswith("within 0.4 m, heard 2 s ago")
    assert anna.words.startswith(f"{TOWER.levels[1].name}, ")
    assert rows[2].words.startswith("silent, ")


def test_the_safe_radius_grows_while_nothing_is_heard() -> None:
    team = Team(now_s=0.0)
    team.hear("Kim", place(TOWER, 1.0, 1.0, 0))
    team.pass_time(2.5)
    ((_, _, _, _, _, radius, protection),) = columns(team.scene().places, 7).tolist()
    assert (radius, protection) == pytest.approx((0.75 + 3.75, 0.4 + 3.75))  # at 1.5 m/s
    (row,) = team.scene().rows
    assert row.words == "uncertain, late 2 s, Ground floor, in corridor, within 4.2 m, heard 2 s ago"
    team.pass_time(1.0)  # more than 5 m: nothing is claimed
    ((_, _, _, _, _, radius, protection),) = columns(team.scene().places, 7).tolist()
    assert np.isnan([radius, protection]).all()


def test_places_are_those_of_the_reports() -> None:
    team = Team(now_s=0.0)
    team.hear("Kim", place(TOWER, 1.0, 2.0, 1, heading_rad=None, protection_m=None))
    team.hear("Anna", place(TOWER, 3.0, 4.0, 0))
    team.hear("Bo", None)
    rows = {row[0]: row[1:] for row in columns(team.scene().places, 7).tolist()}
    numbers = {row.name: row.id for row in team.scene().rows}
    assert rows[numbers["Kim"]][:3] == [1.0, 2.0, 1.0]
    assert np.isnan(rows[numbers["Kim"]][3])
    assert np.isnan(rows[numbers["Kim"]][5])
    assert numbers["Bo"] not in rows


def test_how_far_the_exit_is_from_each_wearer() -> None:
    plan = replace(HOUSE, digest="7" * 64)
    team = Team(plan)
    for floor, name in enumerate(("Kim", "Bo")):
        team.hear(name, place(plan, 12.0, 5.0, floor))
    team.hear("Eve", None)

    def says(length: str, name: str) -> bool:
        team.pass_time(1.0)
        return any(f"{length} m to the exit" in row.words for row in team.scene().rows if row.name == name)

    assert until(lambda: says(" 9", "Kim") and says("", "Bo"))  # the grids are laid in a thread
    assert not says("", "Eve")
    team.put_bytes(*Mark(1, "0123abcd", "blocked", 20.0, 5.0, 0, "Ann", team.unix_s, plan.digest).message)
    assert until(lambda: says(" 10", "Kim"))  # by the other door


def test_a_wearer_on_another_plan_has_no_place_on_this_one_and_it_is_said() -> None:
    team = Team(now_s=0.0)
    team.hear("Kim", place(TOWER, 1.0, 2.0, 1), plan_sha256="f" * 64)
    (row,) = team.scene().rows
    assert row.level is None
    assert "tracked on another plan" in row.notes[0]
    assert not team.scene().places


def test_trails_hold_the_last_minutes_and_are_sent_once(monkeypatch: pytest.MonkeyPatch) -> None:
    team = Team(now_s=0.0)
    for k in range(40):
        team.hear("Kim", place(TOWER, 0.1 * k, 2.0, 0))
        team.pass_time(1.0)
    raw, end = team.operation.trail(0, team.now_s)
    x_m = columns(raw, 5)[:, 1]
    assert np.all(np.diff(x_m) >= trails.POINT_M - 1e-6)
    assert team.operation.trail(end, team.now_s) == (b"", end)
    monkeypatch.setattr(trails, "MOST_POINTS", 3)
    team.hear("Kim", place(TOWER, 9.0, 2.0, 0))
    raw, end = team.operation.trail(0, team.now_s)
    assert len(columns(raw, 5)) == 3
    team.pass_time(trails.TRAIL_S + 1.0)
    team.hear("Kim", place(TOWER, 11.0, 2.0, 0))
    assert len(columns(team.operation.trail(0, team.now_s)[0], 5)) == 1


def test_a_history_says_when_a_state_changed_and_is_bounded() -> None:
    team = Team(now_s=0.0)
    team.hear("Kim", place(TOWER, 1.0, 2.0, 1))
    number = team.scene().rows[0].id
    for k in range(2 * MOST_EVENTS):
        team.pass_time(1.0)
        team.hear("Kim", place(TOWER, 1.0, 2.0, 1), status="lost" if k % 2 else "tracking")
    facts, history = team.details(number)
    assert len(history) == MOST_EVENTS
    assert history[0].text.startswith("lost: ")
    assert history[0].unix_s == team.unix_s
    assert facts["place"] == "not known"
    assert facts["last known"].startswith("last known 0 s ago, ")
    assert not {"floor", "heading", "safe radius"} & set(facts)
    assert team.operation.details(number + 1, team.now_s) is None


def test_a_fall_and_the_trunks_tilt_are_said_in_words() -> None:
    team = Team(now_s=0.0)
    fall = ReportedAlarm("mayday", "fall", 1, 14.0)
    team.hear("Kim", place(TOWER, 1.0, 2.0, 1), alarm=fall, trunk_tilt_deg=86.0)
    (row,) = team.scene().rows
    assert row.state == "mayday"
    assert "mayday: fall 14 s ago" in row.notes
    facts, _ = team.details(row.id)
    assert (facts["alarm"], facts["trunk"]) == ("mayday: fall 14 s ago", "lying (86°)")
    assert [tilt_words(deg) for deg in (4.0, 40.0)] == ["upright (4°)", "bent (40°)"]
