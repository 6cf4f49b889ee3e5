# SPDX-License-Identifier: MIT
"""A recorded operation on the commander's page: over the socket, and in Chromium."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import ClientConnection

from echostep_app.operation.operation import Operation
from echostep_app.operation.page import TablePage
from echostep_app.operation.recorded.tape import OperationTape
from echostep_app.page.server import Address
from operation.teams import TOWER, Recording, Team, place, whole_team
from operation.test_table_page import shot, table
from page.browser import overflow, violations, wait_for
from page.frames import header, opened_url
from waiting import PATIENCE_S

CLOCK = "document.querySelector('#clock').textContent"


def two_moments(folder: Path) -> TablePage:
    """The page of a recorded team without a mayday, and 40 s later with it."""
    team = Team()
    made = Recording(folder, team)
    x_m, y_m = TOWER.levels[0].rooms[0].at_m
    for k in range(20):
        for n, name in enumerate(("Finn", "Kim")):
            team.hear(name, place(TOWER, x_m + 0.3 * k, y_m + n, 0))
        team.pass_time(2.0)
    whole_team(team)
    tape = OperationTape(made.close(), Operation(TOWER))
    assert list(tape.read())
    return TablePage(tape.operation, "Recorded", Address(port=0), tape)


def ask(page: ClientConnection, **request: Any) -> None:
    page.send(json.dumps(request))


def test_a_page_goes_back_and_on_and_cannot_act(tmp_path: Path) -> None:
    with two_moments(tmp_path) as served, opened_url(served.url) as page:
        assert json.loads(page.recv(PATIENCE_S))["replay"]

        def frames_until(holds: Any) -> dict[str, Any]:
            while True:
                received = page.recv(PATIENCE_S)
                if isinstance(received, str):
                    continue
                frame = header(received)
                ask(page, kind="drawn", seq=frame["seq"])
                if holds(frame):
                    return frame

        begin_s = frames_until(lambda frame: frame["play"]["playing"])["play"]["begin_s"]
        ask(page, kind="play", playing=False)
        ask(page, kind="seek", t_s=1e6)
        end = frames_until(lambda frame: frame["play"]["t_s"] == frame["play"]["end_s"])
        assert end["list"][0]["name"] == "Finn"
        assert len(end["list"]) == 8
        ask(page, kind="seek", t_s=begin_s + 20.0)
        past = frames_until(lambda frame: frame["play"]["t_s"] == pytest.approx(begin_s + 20.0))
        assert {row["state"] for row in past["list"]} == {"tracking"}
        assert past["trail_from"] == 0 < past["trail"]
        numbers = {row["name"]: row["id"] for row in end["list"]}
        assert all(numbers[row["name"]] == row["id"] for row in past["list"])
        ask(page, kind="choose", id=numbers["Kim"])
        assert frames_until(lambda frame: frame["details"])["details"]["history"]
        ask(page, kind="step", steps=1)
        frames_until(lambda frame: frame["play"]["t_s"] == pytest.approx(begin_s + 30.0))
        ask(page, kind="acknowledge", id=numbers["Finn"], by="Ann")
        while not isinstance(answer := page.recv(PATIENCE_S), str):
            pass
        assert "recorded operation" in json.loads(answer)["reason"]


@pytest.mark.parametrize("look", ["wide", "phone"])
def test_a_recorded_operation_is_played_in_a_browser(browser: Any, look: str, tmp_path: Path) -> None:
    with two_moments(tmp_path) as served, table(browser, served.url, look) as page:
        page.click("#play")
        page.focus("#time")
        for _ in range(3):
            page.keyboard.press("PageUp")
        wait_for(page, f"document.querySelectorAll('#list li').length === 2 && {CLOCK}.includes(' / ')")
        found = violations(page)
        shot(page, f"past-{look}", tmp_path)
        beyond = overflow(page)
        page.click("#list li:has-text('Kim') button")
        wait_for(page, "document.querySelectorAll('#history li').length > 0")
        if look == "wide":
            before_s = page.evaluate("echostep.scene.frame.play.t_s")
            page.click("#on")
            wait_for(page, f"echostep.scene.frame.play.t_s > {before_s} + 9")
        page.select_option("#times", "16")
        page.click("#play")
        wait_for(page, "echostep.scene.rows.some(({ state }) => state === 'mayday')")
        assert page.inner_text("#live") == ""  # nothing of then is announced
        assert not page.wrong
    assert found == []
    assert beyond == (0, 0)
