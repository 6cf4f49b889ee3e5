# SPDX-License-Identifier: MIT
"""Crews: entry, accountability check, planned air; one state for all commanders; the table at the end; on the commander's page in Chromium."""

from __future__ import annotations

import csv
import math
from collections import deque
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from echostep_app.operation import requests
from echostep_app.operation.crews import HEAD, CrewLog
from echostep_app.team.messages.crews import MOST_CREWS, Crew
from echostep_app.team.messages.marks import MarkBoard
from echostep_app.team.messages.report import BadReportError
from operation.teams import TOWER, ServedTeam, Team, place, whole_team
from operation.test_table_page import LOOKS, shot, table
from page.browser import TABLE_READY, loaded_page, overflow, violations, wait_for
from page.web.test_page_sizes import SIZES, UNREACHED

CREW = Crew(1, "0123abcd", "Attack 1", ("Anna", "Bo"), 30.0, "Ann", 1.8e9)
BUTTON = "document.querySelector('#crews-button').textContent"
LIST = "document.querySelector('#crew-list').innerText"
DUE = "document.querySelector('#crew-due').textContent"


def crew_of(team: Team) -> Crew:
    (crew,) = team.scene().crews
    return crew


def test_a_crew_enters_answers_and_leaves() -> None:
    team = Team()
    team.hear("Anna", place(TOWER, 7.0, 2.0, 1))
    assert not team.ask(requests.SetCrew("Attack 1", ("Anna", "Bo"), 30.0, "Ann"))
    identity = crew_of(team).id
    assert team.ask(requests.CrewDoes(identity, "check", "Ann")) == "The crew has done that already."
    for does in ("enter", "check", "leave"):
        team.pass_time(300.0)
        assert not team.ask(requests.CrewDoes(identity, does, "Ben"))
        assert crew_of(team).is_inside == (does != "leave")
    crew = crew_of(team)
    assert crew.entered_s is not None
    assert (crew.checked_s, crew.left_s, crew.by) == (crew.entered_s + 300.0, crew.entered_s + 600.0, "Ben")
    assert "There is no such crew" in team.ask(requests.CrewDoes("f" * 8, "check", "Ann"))
    assert "crew Attack 1" in team.scene().rows[0].notes
    assert team.scene().crews is team.scene().crews  # a page gets them when they change


def test_the_table_at_the_end_is_the_protocol_and_runs_nothing(tmp_path: Path) -> None:
    team = Team()
    team.ask(requests.SetCrew("=1+2", ("Anna", "Bo"), 30.0, "Ann"))
    for does in ("enter", "check", "leave", "enter"):
        team.pass_time(90.0)
        team.ask(requests.CrewDoes(crew_of(team).id, does, "Ann"))
    team.put_bytes(*crew_of(team).message)  # the broker repeats it
    path = tmp_path / "crews.csv"
    team.operation.crew_log.write(path)
    rows = list(csv.reader(path.read_text().splitlines()))
    assert tuple(rows[0]) == HEAD
    assert [row[3] for row in rows[1:]] == ["made", "entered", "checked", "left", "entered"]
    assert rows[4] == ["2027-01-15T08:04:30+00:00", "'=1+2", "Anna, Bo", "left", "30", "3.0", "1.5", "Ann"]


def test_commanders_come_to_one_state_in_any_order() -> None:
    entered = CREW.after("enter", "Ann", 1.8e9 + 10.0)
    assert entered is not None
    checked = entered.after("check", "Ben", 1.8e9 + 20.0)
    assert checked is not None
    for order in ((CREW, entered, checked), (checked, CREW, entered), (entered, checked, CREW)):
        crews, answers = MarkBoard().crews, deque[tuple[str, bytes]]()
        for crew in order:
            crews.receive(crew.id, crew.message, answers)
        assert crews == {CREW.id: checked}
        assert len(answers) == sum(crew.unix_s < max(c.unix_s for c in order[: k + 1]) for k, crew in enumerate(order))
    crews.receive(CREW.id, ("", b""), answers)
    assert not crews


def test_of_two_changes_at_one_time_all_commanders_keep_the_same() -> None:
    anns, bens = (msgspec.structs.replace(CREW, by=by, air_min=air) for by, air in (("Ann", 30.0), ("Ben", 20.0)))
    for order in ((anns, bens), (bens, anns)):
        known, answers = MarkBoard().crews, deque[tuple[str, bytes]]()
        for crew in order:
            known.receive(CREW.id, crew.message, answers)
        assert known == {CREW.id: bens}
        assert list(answers) == ([] if order[1] is bens else [bens.message])


def hostile() -> list[bytes]:
    """Messages that are no crew of this id."""
    fields = msgspec.to_builtins(CREW)
    wrong: list[dict[str, Any]] = [
        {"air_min": 0.0}, {"air_min": 1e9}, {"members": ["x"] * 9}, {"members": [""]}, {"name": "a\nb"}, {"name": "x" * 33},
        {"id": "f" * 8}, {"unix_s": -1.0}, {"entered_s": 1e300}, {"echostep_crew": 2}, {"by": "\u202e"},
    ]  # fmt: skip
    made = [msgspec.json.encode(fields | change) for change in wrong]
    return [*made, b"{", b"[" * 5000, b"\xff", msgspec.json.encode(fields)[:-1], b'{"echostep_crew":1,"air_min":NaN}']


@pytest.mark.parametrize("payload", hostile())
def test_hostile_messages_are_counted(payload: bytes) -> None:
    with pytest.raises(BadReportError):
        MarkBoard().crews.receive(CREW.id, (CREW.message[0], payload), deque())
    team = Team()
    team.put_bytes(f"echostep-table/crew/{CREW.id}", payload)
    assert team.operation.roster.rejected.total() == 1
    assert not team.scene().crews


def test_the_number_of_crews_is_bounded() -> None:
    crews = MarkBoard().crews
    for k in range(MOST_CREWS):
        made = msgspec.structs.replace(CREW, id=f"{k:08x}")
        crews.receive(made.id, made.message, deque())
    with pytest.raises(BadReportError, match=f"more than {MOST_CREWS} crews"):
        crews.receive(CREW.id, CREW.message, deque())
    log = CrewLog()
    log.note(None, CREW)
    log.note(CREW, CREW)
    assert len(log.events) == 1


def test_a_lost_wearer_with_a_position_claims_none() -> None:
    team = Team()
    at = place(TOWER, 7.0, 2.0, 1, heading_rad=0.3, radius95_m=8.0)
    team.hear("Kim", at, status="lost")  # as another sender may report it
    (row,) = np.frombuffer(team.scene().places, "<f4").reshape(-1, 7)
    assert row[1:4].tolist() == [7.0, 2.0, 1.0]  # where the wearer was last
    assert all(map(math.isnan, row[4:]))  # no heading, no ring
    assert "last known" in team.scene().rows[0].words


def served_crew() -> tuple[Team, ServedTeam]:
    """A team on a page that sends back what it asks for, as a broker does."""
    team = whole_team()
    served = ServedTeam(team)

    def send(topic: str, payload: bytes) -> bool:
        team.put_bytes(topic, payload)
        served.show()
        return True

    served.page.feed.send = send
    return team, served


@pytest.mark.long
def test_a_commander_with_crews(browser: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A whole visit: two crews enter, one answers, the other is asked too late and leaves; the table says so."""
    team, table_of = served_crew()
    monkeypatch.setattr("echostep_app.operation.session.time.time", lambda: team.unix_s)

    def pass_time(minutes: float) -> None:
        team.pass_time(60.0 * minutes)
        table_of.show()

    with table_of, table(browser, table_of.page.url, "wide") as page:
        page.fill("#me", "Ann")
        for name, members, air in (("Attack 1", "Anna, Eve", "30"), ("Attack 2", "Gil", "12")):
            page.click("#crews-button")
            page.fill("#crew-name", name)
            page.fill("#crew-members", members)
            page.fill("#crew-air", air)
            page.click("#crew-new button")
            wait_for(page, f"{LIST}.includes('{name}')")
            page.click(f"#crew-list li:has-text('{name}') [data-does=enter]")
            wait_for(
                page,
                f"[...document.querySelectorAll('#crew-list li')].find((e) => e.innerText.includes('{name}')).dataset.state === 'inside'",
            )
            page.click("#crews form[method=dialog] button")
        page.locator("#list li:has-text('Anna') .note:text-is('crew Attack 1 inside')").wait_for()
        pass_time(4.5)
        wait_for(page, f"{BUTTON} === 'Crews 2 !' && {DUE} === 'Attack 2: check due'")
        page.focus("#map")
        page.keyboard.press("p")
        assert "inside 4:30, not asked yet, planned air 7:30 left: ask now" in page.inner_text(
            "#crew-list li:first-child"
        )
        wait_for(page, "document.querySelector('#hint').hidden")
        shot(page, "crews", tmp_path)
        page.click("#crew-list li:first-child [data-does=check]")
        wait_for(page, f"{BUTTON} === 'Crews 2' && {LIST}.includes('answered 0:00 ago')")
        pass_time(8.0)
        wait_for(page, f"{DUE}.includes('Attack 2: planned air is over')")
        page.click("#crew-list li:has-text('Attack 2') [data-does=leave]")
        wait_for(page, f"{LIST}.includes('out after 12:30')")
        page.click("#crew-list li:has-text('Attack 1') [data-does=check]")
        wait_for(page, f"{BUTTON} === 'Crews 1' && document.querySelector('#crew-due').hidden")
        assert not page.wrong
    path = tmp_path / "crews.csv"
    team.operation.crew_log.write(path)
    rows = list(csv.DictReader(path.read_text().splitlines()))
    assert [(row["crew"], row["event"], row["inside_min"]) for row in rows] == [
        ("Attack 1", "made", ""), ("Attack 1", "entered", ""), ("Attack 2", "made", ""), ("Attack 2", "entered", ""),
        ("Attack 2", "checked", "4.5"), ("Attack 2", "left", "12.5"), ("Attack 1", "checked", "12.5"),
    ]  # fmt: skip


@pytest.mark.parametrize("size", SIZES[1::2])
def test_the_crews_keep_nobody_out(browser: Any, size: tuple[int, int]) -> None:
    team, table_of = served_crew()
    begin_s = team.unix_s
    for k, minutes in enumerate((1.0, 12.0, 40.0)):
        entered = CREW.after("enter", "Ann", begin_s - 60.0 * minutes)
        assert entered is not None
        made = msgspec.structs.replace(entered, id=f"{k:08x}", name=f"Attack {k}")
        team.put_bytes(*made.message)
    with table_of:
        how = LOOKS["contrast"] if size == (360, 740) else {}
        page = loaded_page(
            browser, table_of.page.url, how | {"viewport": {"width": size[0], "height": size[1]}}, TABLE_READY
        )
        wait_for(page, f"{BUTTON} === 'Crews 3 !'")
        page.click("#invitation")
        assert page.evaluate(UNREACHED) == []
        found = violations(page)
        page.click("#crews-button")
        states = page.evaluate(
            "[...document.querySelectorAll('#crew-list li')].map((e) => [e.dataset.state, e.innerText[0]])"
        )
        assert states == [["over", "▲"], ["due", "△"], ["inside", "●"]]  # to be told apart without colours
        again = violations(page)
        assert overflow(page) == (0, 0)
        assert page.evaluate(
            "[...document.querySelectorAll('#crews *')].every((e) => e.getBoundingClientRect().right <= innerWidth)"
        )
        assert not page.wrong
    assert found == again == []
