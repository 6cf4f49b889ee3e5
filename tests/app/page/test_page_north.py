# SPDX-License-Identifier: MIT
"""Needle and north-up view point where the words say that north is, on a plan that is turned on the Earth, on the live and the commander's page."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from echostep.plan import Georeference, Plan
from echostep_app.plan.places.bearing import heading_words, north_rad
from page.browser import FRAMED, loaded_page, wait_for
from page.frames import PLAN
from page.roles import role_page

DESK = {"viewport": {"width": 1280, "height": 800}}
POINTS = """(heading) => {
    const { m21, m22 } = new DOMMatrix(getComputedStyle(document.querySelector('#needle')).transform);
    const [x, y] = echostep.view.toScreen(0, 0), [u, v] = echostep.view.toScreen(Math.cos(heading), Math.sin(heading));
    return [Math.atan2(-m21, m22), Math.atan2(u - x, y - v)].map((angle) => 180 / Math.PI * angle);
}"""  # degrees clockwise from up: the needle's tip, and a heading on the map


def turned(rotation_deg: float | None) -> Plan:
    placed = None if rotation_deg is None else Georeference(7.0, 50.0, math.radians(rotation_deg))
    return replace(PLAN, digest="5" * 64, georeference=placed)


def check(page: Any, plan: Plan) -> None:
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
        page.evaluate("echostep.view.rotate(-echostep.view.turn)")


@pytest.mark.parametrize(("role", "rotation_deg"), [("wearer", -100.0), ("wearer", None), ("commander", 30.0)])
def test_the_page_turns_to_the_north_of_its_words(browser: Any, role: str, rotation_deg: float | None) -> None:
    plan = turned(rotation_deg)
    with role_page(role, plan, (6.0, 7.5), 0, north_rad(plan)) as (url, ready):
        page = loaded_page(browser, url, DESK, ready)
        if role == "commander":
            page.click("#list button")
        words = {"wearer": "#place", "commander": "#facts"}[role]
        wait_for(page, f"document.querySelector('{words}').textContent.includes('N 000°')")
        check(page, plan)
        assert not page.wrong
