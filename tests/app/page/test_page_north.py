# SPDX-License-Identifier: MIT
"""Needle and north-up view point where the words say that north is, on a plan that is turned on the Earth, on the live and the commander's page."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from echostep.plan import Georeference, Plan
from echostep_app.page.mailbox import Mailbox
from echostep_app.plan.places.bearing import heading_words, north_rad
from operation.teams import ServedTeam, Team, place
from page.browser import FRAMED, READY, TABLE_READY, loaded_page, wait_for
from page.frames import PLAN, scene, served, told

DESK = {"viewport": {"width": 1280, "height": 800}}
POINTS = """(heading) => {
    const { m21, m22 } = new DOMMatrix(getComputedStyle(document.querySelector('#needle')).transform);
    const [x, y] = echostep.view.toScreen(0, 0), [u, v] = echostep.view.toScreen(Math.cos(heading), Math.sin(heading));
    return [Math.atan2(-m21, m22), Math.atan2(u - x, y - v)].map((angle) => 180 / Math.PI * angle);
}"""  # degrees clockwise from up: the needle's tip, and a heading on the map


def turned(rotation_deg: float | None) -> Plan:
    placed = None if rotation_deg is None else Georeference(7.0, 50.0, math.radians(rotation_deg))
    return replace(PLAN, digest="5" * 64, georeference=placed)


def check(page: Any, plan: Plan, shot: Path) -> None:
    """Needle and map agree at first, when the map is turned by hand, and with north up, where both point up."""
    north = north_rad(plan)
    assert heading_words(plan, north).startswith("N 000°")

    def angles() -> tuple[float, float]:
        needle, heading = page.evaluate(POINTS, north)
        return needle, heading

    def turn_north() -> None:
        page.click("#north")

    def press_n() -> None:
        page.keyboard.press("n")

    needle, heading = angles()
    assert math.remainder(needle - heading, 360.0) == pytest.approx(0.0, abs=0.1)
    assert heading == pytest.approx(90.0 - math.degrees(north), abs=0.1)  # the building is drawn as on its plan
    for act in (turn_north, press_n):
        page.focus("#map")
        page.keyboard.press("[")
        wait_for(page, f"({POINTS})({north}).every((angle) => Math.abs(angle) > 10)")
        page.evaluate(FRAMED)
        needle, heading = angles()
        assert math.remainder(needle - heading, 360.0) == pytest.approx(0.0, abs=0.1)
        act()
        page.focus("#map")
        wait_for(page, f"({POINTS})({north}).every((angle) => Math.abs(angle) < 0.1)")
        page.screenshot(path=shot)
        page.evaluate("echostep.view.rotate(-echostep.view.turn)")


@pytest.mark.parametrize("rotation_deg", [30.0, -100.0, None])
def test_the_live_page_turns_to_the_north_of_its_words(
    browser: Any, rotation_deg: float | None, tmp_path: Path
) -> None:
    plan = turned(rotation_deg)
    with served(Mailbox(plan, "test", replay=False)) as (server, mailbox):
        mailbox.publish(replace(scene(), estimate=replace(told(), heading_rad=north_rad(plan))))
        page = loaded_page(browser, server.url, DESK, READY)
        assert "heading N 000°" in page.text_content("#place")
        check(page, plan, tmp_path / "live.png")
        assert not page.wrong


def test_the_commanders_page_turns_to_the_north_of_its_words(browser: Any, tmp_path: Path) -> None:
    plan = turned(30.0)
    team = Team(plan)
    team.hear("Anna", place(plan, 6.0, 7.5, 0, heading_rad=north_rad(plan)))
    with ServedTeam(team) as team_page, loaded_page(browser, team_page.page.url, DESK, TABLE_READY) as page:
        page.click("#list button")
        wait_for(page, "document.querySelector('#facts').innerText.includes('N 000°')")
        check(page, plan, tmp_path / "table.png")
        assert not page.wrong
