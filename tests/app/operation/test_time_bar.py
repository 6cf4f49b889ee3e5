# SPDX-License-Identifier: MIT
"""The time bar over the whole operation: over the socket, and in Chromium."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import ClientConnection

from echostep_app.operation.operation import Operation
from echostep_app.operation.page import TablePage
from echostep_app.operation.recorded.player import load
from echostep_app.operation.recorded.tape import Tape
from echostep_app.page.server import Address
from operation.teams import TOWER, Recording, ServedTeam, Team, place, whole_team
from operation.test_command import header_of
from operation.test_table_page import LOOKS, shot, table
from page.browser import overflow, violations, wait_for
from page.frames import opened_url
from waiting import PATIENCE_S, until

SHOWN = "document.querySelector('#clock').textContent"


def two_moments(folder: Path) -> tuple[Team, Recording]:
    """A team without a mayday, and 40 s later one with it."""
    team = Team()
    made = Recording(folder, team)
    x_m, y_m = TOWER.levels[0].rooms[0].at_m
    for k in range(20):
        for n, name in enumerate(("Finn", "Kim")):
            team.hear(name, place(TOWER, x_m + 0.3 * k, y_m + n, 0))
        team.pass_time(2.0)
    whole_team(team)
    assert until(made.on_disk)
    return team, made


def ask(page: ClientConnection, **request: Any) -> None:
    page.send(json.dumps(request))


def test_a_page_goes_back_and_returns_and_cannot_act_on_the_past(tmp_path: Path) -> None:
    team, made = two_moments(tmp_path)
    with ServedTeam(team, made.tape) as served:
        url = served.page.url
        with opened_url(url) as page:
            page.recv(PATIENCE_S)

            def frames_until(holds: Any) -> dict[str, Any]:
                while True:
                    received = page.recv(PATIENCE_S)
                    if isinstance(received, str):
                        continue
                    header = header_of(received)
                    ask(page, kind="drawn", seq=header["seq"])
                    if holds(header):
                        return header
                    served.show()

            now = frames_until(lambda header: header["time"]["now"])
            assert now["list"][0]["name"] == "Finn"
            assert now["time"]["live"]
            ask(page, kind="seek", t_s=20.0)
            past = frames_until(lambda header: not header["time"]["now"])
            assert past["time"]["t_s"] == pytest.approx(20.0)
            assert past["time"]["open_alarms"] == 1
            assert {row["state"] for row in past["list"]} == {"tracking"}
            assert past["trail_from"] == 0 < past["trail"]
            numbers = {row["name"]: row["id"] for row in now["list"]}
            assert all(numbers[row["name"]] == row["id"] for row in past["list"])
            ask(page, kind="choose", id=numbers["Kim"])
            assert frames_until(lambda header: header["details"])["details"]["history"]
            ask(page, kind="acknowledge", id=numbers["Finn"], by="Ann")
            while not isinstance(answer := page.recv(PATIENCE_S), str):
                pass
            assert "return to now" in json.loads(answer)["reason"]
            ask(page, kind="now")
            back = frames_until(lambda header: header["time"]["now"])
            assert len(back["list"]) == 8
    made.close()


@pytest.mark.parametrize("look", LOOKS)
def test_the_time_bar_in_a_browser(browser: Any, look: str, tmp_path: Path) -> None:
    team, made = two_moments(tmp_path)
    with ServedTeam(team, made.tape) as served, table(browser, served.page.url, look) as page:
        wait_for(page, f"{SHOWN}.endsWith('now')")
        assert page.is_disabled("#now")
        page.focus("#time")
        for _ in range(3):
            page.keyboard.press("PageDown")
        wait_for(page, "document.body.dataset.past === 'true' && document.querySelectorAll('#list li').length === 2")
        wait_for(page, f"{SHOWN}.endsWith('ago')")
        wait_for(page, "document.querySelector('#now').textContent === 'Now: ▲ 1'")
        found = violations(page)
        if look != "contrast":
            shot(page, f"past-{look}", tmp_path)
        beyond = overflow(page)
        page.click("#list li:has-text('Kim') button")
        wait_for(page, "document.querySelectorAll('#history li').length > 0")
        if look == "wide":
            page.click("#back")
            wait_for(page, "echostep.scene.frame.time.t_s < 35")
        page.click("#now")
        wait_for(page, "document.body.dataset.past === 'false' && document.activeElement.id === 'time'")
        wait_for(page, "echostep.scene.rows.length === 8")
        assert not page.wrong
    made.close()
    assert found == []
    assert beyond == (0, 0)


def test_a_recorded_operation_is_played_in_a_browser(browser: Any, tmp_path: Path) -> None:
    _, made = two_moments(tmp_path)
    tape, operation = Tape(made.close(), grows=False), Operation(TOWER)
    (*_, player) = load(tape, operation)
    with TablePage(operation, "Recorded", Address(port=0), tape) as served:
        served.feed.publish(player.scene())
        page = table(browser, served.url, "phone")
        wait_for(page, f"{SHOWN}.includes(' / ')")
        assert page.is_hidden("#now")
        page.select_option("#times", "32")

        def is_over() -> bool:
            served.feed.publish(player.scene())
            return bool(page.evaluate("echostep.scene.rows.some(({ state }) => state === 'mayday')"))

        assert until(is_over)
        assert not page.wrong
