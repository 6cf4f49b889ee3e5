# SPDX-License-Identifier: MIT
"""A mayday on the commander's page in Chromium: it is heard and seen, leads to its place and back, and who is nearest can be sent."""

from __future__ import annotations

import json
from typing import Any

import pytest

from echostep_app.team.messages.report import ReportedAlarm
from operation.teams import TOWER, ServedTeam, Team, place, whole_team
from page.browser import TABLE_READY, loaded_page, spot, violations, wait_for
from waiting import until

SIZES = ((1280, 800), (360, 740), (320, 256))
LISTENS = """
    window.rung = 0; window.shaken = 0;
    const { createOscillator: create, resume } = AudioContext.prototype;
    AudioContext.prototype.resume = function () { return resume.call(this).then(() => { window.sounds = true; }); };
    AudioContext.prototype.createOscillator = function () { window.rung++; return create.call(this); };
    navigator.vibrate = () => { window.shaken++; return true; };"""
VIEW = "[echostep.scene.level, echostep.view.x, echostep.view.y, echostep.view.scale, echostep.view.turn]"
FALL = ReportedAlarm("mayday", "fall", 1, 14.0)
X_M, Y_M = TOWER.levels[2].rooms[0].at_m


def calm_team() -> Team:
    """Three wearers on three floors; all is well."""
    team = Team()
    for k, name in enumerate(("Anna", "Eve", "Gil")):
        team.hear(name, place(TOWER, X_M + 2.0 * k, Y_M, k))
    return team


def opened_table(browser: Any, url: str, size: tuple[int, int]) -> Any:
    return loaded_page(browser, url, {"viewport": {"width": size[0], "height": size[1]}}, TABLE_READY, LISTENS)


def lets_sound(page: Any) -> None:
    """The first tap; the device takes its time."""
    page.click("#north")
    wait_for(page, "window.sounds")


def header_colour(page: Any) -> str:
    return str(page.evaluate("getComputedStyle(document.querySelector('header')).backgroundColor"))


@pytest.mark.long
@pytest.mark.parametrize("size", SIZES)
def test_a_mayday_is_heard_and_seen_and_leads_to_its_place_and_back(browser: Any, size: tuple[int, int]) -> None:
    team = calm_team()
    with ServedTeam(team) as served, opened_table(browser, served.page.url, size) as page:
        calm, title = header_colour(page), page.title()
        assert page.inner_text("#words") == "● connected"
        lets_sound(page)
        page.evaluate("echostep.view.zoom(6)")
        before = page.evaluate(VIEW)
        team.hear("Gil", place(TOWER, X_M + 9.0, Y_M, 2), alarm=FALL)
        served.show()
        wait_for(page, "echostep.scene.level === 2 && !document.querySelector('#mayday').hidden")
        assert (page.evaluate("rung"), page.evaluate("shaken")) == (3, 1)
        assert header_colour(page) != calm
        wait_for(page, "document.title === '▲ MAYDAY Gil'")
        wait_for(page, f"document.title === '{title}'")  # it blinks
        x, y = spot(page, X_M + 9.0, Y_M)
        cover = page.evaluate("([x, y]) => document.elementFromPoint(x, y)?.closest('#map, #messages > *')?.id", [x, y])
        assert cover == "map"  # the place is on the screen, and nothing lies over it
        found = violations(page)
        page.click("#mayday-back")
        wait_for(page, f"JSON.stringify({VIEW}) === '{json.dumps(before, separators=(',', ':'))}'")
        assert page.is_hidden("#mayday")
        served.show()
        team.hear("Gil", place(TOWER, X_M + 9.0, Y_M, 2))
        served.show()
        wait_for(page, "document.body.dataset.alarm === 'false'")
        assert header_colour(page) == calm
        assert page.title() == title
        assert page.evaluate("rung") == 3  # once
        assert not page.wrong
    assert found == []


def test_a_page_in_the_background_sounds_too(browser: Any) -> None:
    team = calm_team()
    with ServedTeam(team) as served, opened_table(browser, served.page.url, SIZES[0]) as page:
        lets_sound(page)
        page.evaluate("""() => {
            Object.defineProperty(document, 'hidden', { get: () => true });
            window.requestAnimationFrame = () => 0;
        }""")
        for _ in range(6):  # more than a page is sent that draws none
            team.pass_time(0.6)
            for name in ("Anna", "Eve", "Gil"):
                team.hear(name, place(TOWER, X_M, Y_M, 0))
            served.show()
            wait_for(page, f"echostep.scene.frame.unix_s >= {team.unix_s}")
        team.hear("Eve", place(TOWER, X_M, Y_M, 1), alarm=FALL)
        served.show()
        wait_for(page, "rung === 3 && document.title === '▲ MAYDAY Eve'")


def test_who_was_asked_after_a_fall_comes_to_the_top(browser: Any) -> None:
    team = calm_team()
    team.hear("Kim", place(TOWER, X_M, Y_M, 0), status="lost")
    team.hear("Gil", place(TOWER, X_M, Y_M, 2), alarm=ReportedAlarm("asking", "fall", 1, 4.0))
    team.hear("Eve", place(TOWER, X_M, Y_M, 1), alarm=ReportedAlarm("asking", "no motion", 1, 21.0))
    with ServedTeam(team) as served, opened_table(browser, served.page.url, SIZES[0]) as page:
        names = page.evaluate("[...document.querySelectorAll('#list .name')].map((e) => e.textContent)")
        assert names[:2] == ["Gil", "Kim"]
        assert page.inner_text("#list li:first-child .said").startswith("asked after a fall, 2nd floor")
        assert page.inner_text("#floors button:nth-child(3)").endswith("!")
        assert page.get_attribute("body", "data-alarm") == "false"  # it is no mayday yet
        page.click("#list li:first-child button")
        wait_for(page, "!document.querySelector('#distress').hidden")
        assert page.is_hidden("#acknowledge")


@pytest.mark.parametrize("size", SIZES)
def test_details_of_one_in_distress_are_what_is_needed(browser: Any, size: tuple[int, int]) -> None:
    team = whole_team()
    team.hear("Hal", place(TOWER, X_M + 4.0, Y_M, 0))
    sent: list[tuple[str, bytes]] = []
    with ServedTeam(team) as served:
        served.page.feed.send = lambda *message: bool(sent.append(message) or True)  # type: ignore[func-returns-value]
        page = opened_table(browser, served.page.url, size)
        page.click("#list li:first-child button")  # Finn
        wait_for(page, "document.querySelectorAll('#rescuers li').length === 3")
        needs = page.evaluate("[...document.querySelectorAll('#needs > *')].map((e) => e.textContent)")
        assert needs[:4] == ["place", "Ground floor, in corridor, within 0.4 m", "since", "mayday: no motion for 40 s"]
        assert needs[4] == "stairs"
        assert needs[5].endswith(" m")
        assert page.is_hidden("#facts")  # the rest is folded
        nearest = page.inner_text("#rescuers li:first-child")
        assert nearest.startswith("Send Hal")
        assert "floor" not in nearest  # farther away than others are, but on the same floor
        assert "1 floor above" in page.inner_text("#rescuers")
        page.fill("#me", "Ben")
        page.click("#rescuers li:first-child button")
        assert until(lambda: sent)
        team.put_bytes(*sent[0])
        served.show()
        wait_for(page, "document.querySelector('#rescuers li').innerText.includes('sent by Ben')")
        page.click("#all summary")
        assert page.is_visible("#facts")
        page.click("#close")
        page.click("#list li:has-text('Dana') button")
        wait_for(page, "document.querySelectorAll('#facts dt').length > 5")
        assert page.is_hidden("#distress")
        assert page.is_visible("#facts")
        assert not page.wrong
