# SPDX-License-Identifier: MIT
"""The commander's page in Chromium: on a desk and on a phone, by touch, by keys and for screen readers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from operation.teams import TOWER, ServedTeam, place, whole_team
from page.browser import FRAMED, PHONE, TABLE_READY, kept, loaded_page, overflow, spot, violations, wait_for

WIDE = {"viewport": {"width": 1280, "height": 720}}
LOOKS: dict[str, dict[str, Any]] = {
    "wide": {**WIDE, "color_scheme": "light"},
    "tablet": {**PHONE, "viewport": {"width": 820, "height": 1180}, "color_scheme": "light"},
    "phone": {**PHONE, "color_scheme": "dark"},
    "contrast": {**PHONE, "contrast": "more"},
}
WORDS = "[...document.querySelectorAll('#list li')].map((e) => e.innerText.replaceAll('\\n', ' '))"


def table(browser: Any, url: str, look: str) -> Any:
    """A page that shows a plan and a list."""
    return loaded_page(browser, url, LOOKS[look], TABLE_READY)


def shot(page: Any, name: str, tmp_path: Path) -> None:
    page.screenshot(path=kept(f"table-{name}.png", tmp_path))


@pytest.mark.long
@pytest.mark.parametrize("look", LOOKS)
def test_nothing_keeps_a_commander_out(browser: Any, look: str, tmp_path: Path) -> None:
    with ServedTeam(whole_team()) as served, table(browser, served.page.url, look) as page:
        found = violations(page)
        shot(page, look, tmp_path)
        page.click("#list li:nth-child(1) button")
        wait_for(page, "document.querySelectorAll('#facts dt').length > 5")
        again = violations(page)
        shot(page, f"{look}-one", tmp_path)
        beyond = overflow(page)
        assert not page.wrong
    assert found == []
    assert again == []
    assert beyond == (0, 0)


def test_a_tap_on_the_map_or_on_the_list_shows_a_wearer_with_history(browser: Any) -> None:
    team = whole_team()
    with ServedTeam(team) as served, table(browser, served.page.url, "wide") as page:
        page.click("#list li:has-text('Anna') button")
        wait_for(page, "document.querySelectorAll('#history li').length > 0")
        assert page.inner_text("#who") == "● Anna (red)"
        wait_for(page, "echostep.scene.level === 1")  # the map went to the floor of this wearer
        page.keyboard.press("Enter")  # the focus is on ✕
        wait_for(page, "document.activeElement.innerText.includes('Anna')")
        for name in ("Anna", "Gil"):
            team.hear(name, place(TOWER, 7.0, 2.0, 1))  # on one spot: their signs are beside each other
        served.show()
        wait_for(page, "[...echostep.scene.places.values()].filter(({ x, y }) => x === 7 && y === 2).length === 2")
        page.evaluate(FRAMED)  # a tap finds the signs that are painted
        page.mouse.click(*spot(page, 7.0, 2.0))
        wait_for(page, "document.querySelector('#who').textContent.includes('Anna')")
        page.mouse.click(*np.add(spot(page, 7.0, 2.0), (16.0, -28.0)).tolist())
        wait_for(page, "document.querySelector('#who').textContent.includes('Gil')")
        assert not page.wrong


def test_trails_move_with_the_map_and_are_painted_anew(browser: Any) -> None:
    team = whole_team()
    for k in range(12):
        team.hear("Anna", place(TOWER, 6.0 + k, 2.0, 1))
        team.pass_time(1.0)
    with ServedTeam(team) as served, table(browser, served.page.url, "wide") as page:
        page.click("#floors button:nth-child(2)")
        wait_for(page, TRAIL_SEEN)
        page.evaluate("echostep.view.grip([300, 200], [340, 230], 1.3, 0.4)")
        wait_for(page, f"{TRAIL_SEEN} && {TRAILS_SHOWN}.style.transform === ''")  # painted for this view
        team.hear("Anna", place(TOWER, 17.0, 5.0, 1))
        served.show()
        wait_for(page, TRAIL_SEEN.replace("12, 2", "17, 4"))  # a new point is added
        page.click("#floors button:nth-child(1)")
        wait_for(page, f"echostep.scene.level === 0 && !({TRAIL_SEEN})")
        assert not page.wrong


TRAILS_SHOWN = "[...document.querySelectorAll('.trails')].find((e) => e.style.visibility !== 'hidden')"
TRAIL_SEEN = f"""(() => {{
    const sheet = {TRAILS_SHOWN}, [x, y] = echostep.view.toScreen(12, 2), placed = new DOMMatrix(sheet.style.transform).inverse();
    const {{ x: sx, y: sy }} = placed.transformPoint({{ x, y }});
    return sheet.getContext('2d').getImageData(Math.round(sx) - 3, Math.round(sy) - 3, 7, 7).data.some((value) => value > 0);
}})()"""  # the sheet of the trails that is shown has something within 3 px of (12, 2) m
