# SPDX-License-Identifier: MIT
"""Typed lengths and angles, the grid and the scale bar of `plan edit`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from echostep_app.page.editor import EditServer
from page.browser import spot, violations, wait_for
from page.edit.drawing import PHONES, click, drag, on_phone, opened, saved, says, status, tap


def typed(page: Any, length: str, angle: str = "") -> str:
    """Type a length and an angle; what the page says then."""
    page.fill("#length", length)
    page.fill("#angle", angle)
    page.press("#angle", "Enter")
    return status(page)


def test_walls_by_typed_lengths_and_angles(browser: Any, drawn: EditServer, tmp_path: Path) -> None:
    page = opened(browser, drawn)
    page.click('[data-tool="wall"]')
    assert typed(page, "3", "0") == "First click where it begins"
    click(page, 3.0, 3.0)
    assert typed(page, "4.37", "0") == "Wall 4.37 m, 0.0°, as typed"
    assert page.input_value("#length") == page.input_value("#angle") == ""
    assert typed(page, "2,5", "90") == "Wall 2.50 m, 90.0°, as typed"
    for length, angle, words in (
        ("two", "0", "The length is a number of metres from 0.01 to 10000"),
        ("-1", "0", "The length is a number of metres from 0.01 to 10000"),
        ("1e9", "0", "The length is a number of metres from 0.01 to 10000"),
        ("1", "north", "The angle is a number of degrees, counter-clockwise from x"),
        ("1", "", "Type the angle too: degrees counter-clockwise from x"),
    ):
        assert typed(page, length, angle) == words
    page.mouse.move(*spot(page, 5.0, 5.51))
    page.screenshot(path=tmp_path / "typed.png")
    assert typed(page, "4.37") == "Wall 4.37 m, 180.0°, as typed"  # in the direction of the draft
    assert typed(page, "2.5", "270") == "Wall 2.50 m, 270.0°, as typed"  # closes: the wall ends
    assert page.evaluate("echostep.tools.chain") is None
    level = saved(page, drawn)
    assert level.walls.tolist() == [[3, 3, 7.37, 3], [7.37, 3, 7.37, 5.5], [7.37, 5.5, 3, 5.5], [3, 5.5, 3, 3]]
    assert not page.wrong


def test_an_outline_the_start_and_movements_are_typed(browser: Any, drawn: EditServer) -> None:
    page = opened(browser, drawn)
    page.click('[data-tool="obstacle"]')
    click(page, 3.0, 3.0)
    typed(page, "1.23", "0")
    assert typed(page, "1", "90") == "Corner 3 at x 4.23, y 4.00 m"
    page.click("#end")
    page.click('[data-tool="start"]')
    click(page, 2.0, 2.0)
    assert typed(page, "", "33.3") == "Start at x 2.00, y 2.00 m, looking 33.3°"
    page.click('[data-tool="wall"]')
    drag(page, (2.0, 8.0), (9.0, 8.0))
    page.click('[data-tool="door"]')
    click(page, 4.0, 8.0)
    page.click('[data-tool="select"]')
    assert typed(page, "1", "0") == "First click on what is to be moved"
    click(page, 4.0, 8.0)
    assert typed(page, "0.33", "0") == "Moved the door by 0.33 m, 0.0°"
    assert typed(page, "0.5", "90") == "Nothing changed: it does not fit there"  # a door stays in its wall
    click(page, 3.9, 3.3)
    assert typed(page, "0.77", "90") == "Moved the obstacle by 0.77 m, 90.0°"
    click(page, 7.0, 8.0)
    assert typed(page, "1.11", "90") == "Moved the wall by 1.11 m, 90.0°"
    level = saved(page, drawn)
    assert level.doors[0].line == pytest.approx((3.88, 9.11, 4.78, 9.11))
    assert level.obstacles[0].tolist() == [[3, 3.77], [4.23, 3.77], [4.23, 4.77]]
    for words in ("Moved the wall by 1.11 m, 90.0°", "Moved the obstacle by 0.77 m, 90.0°"):
        page.click("#step-back")
        says(page, f"Undone: {words}")
    assert not page.wrong


def test_digits_on_the_sheet_go_to_the_length(browser: Any, drawn: EditServer) -> None:
    page = opened(browser, drawn)
    page.focus("#map")
    page.evaluate("echostep.tools.cross = [5, 5]")
    page.keyboard.press("w")
    page.keyboard.press("Enter")
    page.keyboard.press("ArrowUp")  # the draft gives the direction
    wait_for(page, "!document.querySelector('#length').disabled")
    page.keyboard.type("3.21")
    page.keyboard.press("Enter")
    says(page, "Wall 3.21 m, 90.0°, as typed")
    page.keyboard.press("Escape")
    page.keyboard.press("d")
    page.keyboard.press("2")  # no length belongs to this tool
    assert page.evaluate("document.activeElement.id") == "map"
    assert not page.wrong


GRID = """(() => {
    const number = (id) => parseFloat(document.querySelector(id).textContent.replace('▦', '')), { view } = echostep;
    const lines = document.querySelector('#grid').getAttribute('d').match(/M[-\\d.]+ 0V/g).map((line) => parseFloat(line.slice(1)));
    return { scale: view.scale, origin: view.toScreen(0, 0)[0], lines, bar: document.querySelector('#bar').offsetWidth,
        metres: number('#bar-text'), square: number('#square') };
})()"""  # pixels, and what is written


@pytest.mark.parametrize("scale", [3.0, 45.0, 800.0])
def test_the_grid_and_the_scale_bar_fit_the_zoom(browser: Any, drawn: EditServer, scale: float) -> None:
    page = opened(browser, drawn)
    page.evaluate(f"echostep.view.centre(0.4, 0.4); echostep.view.scale = {scale}")
    page.click("#closer")
    wait_for(page, f"Math.abs(({GRID}).bar - ({GRID}).metres * {1.25 * scale}) < 1")
    seen = page.evaluate(GRID)
    square_px = seen["square"] * seen["scale"]
    assert 60 <= seen["metres"] * seen["scale"] <= 160
    assert square_px >= 14
    assert np.diff(seen["lines"]) == pytest.approx(square_px, abs=0.15)
    assert min(abs(line - seen["origin"]) for line in seen["lines"]) < 0.1  # one goes through the origin


@pytest.mark.parametrize("held", PHONES)
def test_fingers_type_on_a_phone_held_either_way(browser: Any, drawn: EditServer, held: str, tmp_path: Path) -> None:
    page = on_phone(browser, drawn, held)
    page.tap('[data-tool="wall"]')
    tap(page, 5, 5)
    page.fill("#length", "2.22")
    page.fill("#angle", "45")
    page.tap("#go")
    says(page, "Wall 2.22 m, 45.0°, as typed")
    page.screenshot(path=tmp_path / f"typed-{held}.png")
    assert violations(page) == []
    assert page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth") == 0
    assert not page.wrong
