# SPDX-License-Identifier: MIT
"""Obstacles, stairs, lifts and the start in `plan edit`: drawn, shown, moved, deleted, undone, written as the plan's schema has them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from echostep.plan import Plan, Pose, load_plan, parse_plan
from echostep_app.page.editor import EditServer
from echostep_app.plan.check import check_plan
from echostep_app.plan.writer import save_plan
from page.browser import violations, wait_for
from page.edit.drawing import PHONES, answered, click, drag, on_phone, opened, says, status, tap
from waiting import until

HOUSE = b"""{"echostep_plan": 1, "name": "house", "levels": [
    {"name": "Ground", "height_m": 0, "walls": [[0, 0, 12, 0], [12, 0, 12, 8], [12, 8, 0, 8], [0, 8, 0, 0]], "rooms": []},
    {"name": "First", "height_m": 3, "walls": [[0, 0, 12, 0]], "rooms": []},
    {"name": "Cellar", "height_m": -3, "walls": [[0, 0, 12, 0]], "rooms": []}]}"""


@pytest.fixture
def house(tmp_path: Path) -> Any:
    save_plan(parse_plan(HOUSE), tmp_path / "house.json")
    with EditServer(tmp_path / "house.json", port=0) as server:
        yield server


def written(page: Any, server: EditServer) -> Plan:
    page.click("#save")
    page.get_by_text("Saved house.json").wait_for()
    return load_plan(server.file.path)


def start_of(page: Any, server: EditServer) -> Pose:
    start = written(page, server).start
    assert start is not None
    return start


def test_an_obstacle_corner_by_corner_and_by_a_drag(browser: Any, house: EditServer) -> None:
    page = opened(browser, house)
    page.click('[data-tool="obstacle"]')
    for place in ((2.0, 2.0), (4.0, 2.0), (4.0, 3.5), (2.0, 2.0)):
        click(page, *place)
    says(page, "Obstacle 2.00 m by 1.50 m")
    drag(page, (6.0, 2.0), (8.0, 3.0))
    for place in ((9.0, 2.0), (10.0, 2.0), (10.0, 3.0)):
        click(page, *place)
    page.click("#end")  # closes what has three corners
    level = written(page, house).levels[0]
    assert [corners.tolist() for corners in level.obstacles] == [
        [[2, 2], [4, 2], [4, 3.5]],
        [[6, 2], [8, 2], [8, 3], [6, 3]],
        [[9, 2], [10, 2], [10, 3]],
    ]
    click(page, 1.0, 6.0)
    click(page, 2.0, 6.0)
    page.keyboard.press("Escape")
    says(page, "An outline has three corners or more: nothing drawn")
    page.click('[data-tool="select"]')
    drag(page, (7.0, 2.5), (7.5, 4.5))
    says(page, "Moved the obstacle by 2.06 m, 76.0°")
    drag(page, (8.5, 5.0), (9.0, 6.0))  # the chosen one's corner
    page.click('[data-tool="erase"]')
    click(page, 3.7, 2.5)
    says(page, "Deleted the obstacle")
    assert [corners.tolist() for corners in written(page, house).levels[0].obstacles] == [
        [[6.5, 4], [8.5, 4], [9, 6], [6.5, 5]],
        [[9, 2], [10, 2], [10, 3]],
    ]
    for words in ("Deleted the obstacle", "Moved the corner by 1.12 m, 63.4°", "Moved the obstacle by 2.06 m, 76.0°"):
        page.click("#step-back")
        says(page, f"Undone: {words}")
    page.click("#step-forth")
    says(page, "Again: Moved the obstacle by 2.06 m, 76.0°")
    assert not page.wrong


def test_stairs_and_a_lift_join_levels(browser: Any, house: EditServer) -> None:
    page = opened(browser, house)
    page.click('[data-tool="stairs"]')
    drag(page, (1.0, 5.0), (3.0, 8.0))  # up to the wall
    chosen = "[...document.querySelectorAll('#ways-levels input')].map((box) => box.checked)"
    assert page.evaluate(chosen) == [True, True, False]  # this level and the next higher one
    page.click("#ways [value='yes']")
    says(page, "Stairs: Ground, First")
    page.click('[data-tool="lift"]')
    drag(page, (5.0, 6.0), (7.0, 8.0))
    page.get_by_label("First").uncheck()
    page.click("#ways [value='yes']")
    assert page.text_content("#ways-few") == "Choose two levels or more"
    page.get_by_label("First").check()
    page.get_by_label("Cellar").check()
    page.fill("#ways-name", "Lift A")
    page.keyboard.press("Enter")
    says(page, "Lift: Ground, First, Cellar")
    wait_for(page, "[...document.querySelectorAll('#marks text')].map((e) => e.textContent).join() === 'stairs,Lift A'")
    page.select_option("#level", "2")
    wait_for(page, "[...document.querySelectorAll('#marks text')].map((e) => e.textContent).join() === 'Lift A'")
    ways = written(page, house).connectors
    assert [(way.kind, way.name, way.levels, way.outline_m.tolist()) for way in ways] == [
        ("stairs", "", (0, 1), [[1, 5], [3, 5], [3, 8], [1, 8]]),
        ("lift", "Lift A", (0, 1, 2), [[5, 6], [7, 6], [7, 8], [5, 8]]),
    ]
    click(page, 6.0, 7.0)  # inside: asks again
    assert page.input_value("#ways-name") == "Lift A"
    page.fill("#ways-name", "Lift B")
    page.keyboard.press("Enter")
    answered(page)
    page.click('[data-tool="ramp"]')
    drag(page, (8.0, 1.0), (9.0, 3.0))
    page.click("#ways [type='button']")
    says(page, "No ramp drawn")
    page.click('[data-tool="erase"]')
    page.select_option("#level", "0")
    click(page, 2.0, 6.0)
    says(page, "Deleted the stairs")
    assert [(way.kind, way.name) for way in written(page, house).connectors] == [("lift", "Lift B")]
    page.click("#step-back")
    page.click("#step-back")
    assert [(way.kind, way.name) for way in written(page, house).connectors] == [("stairs", ""), ("lift", "Lift A")]
    assert not page.wrong


def test_stairs_of_one_level_are_refused(browser: Any, drawn: EditServer) -> None:
    page = opened(browser, drawn)
    page.click('[data-tool="stairs"]')
    drag(page, (5.0, 5.0), (7.0, 7.0))
    says(page, "No stairs drawn: there is one level. Add the other one first (+ Level)")
    assert page.evaluate("[echostep.sheet.past.length, echostep.tools.chain]") == [0, None]


def test_the_start_is_set_moved_and_deleted(browser: Any, house: EditServer) -> None:
    page = opened(browser, house)
    page.click('[data-tool="start"]')
    click(page, 2.0, 2.0)
    says(page, "Start at x 2.00, y 2.00 m: now click where the wearer looks")
    click(page, 2.0, 4.0)
    says(page, "Start at x 2.00, y 2.00 m, looking 90.0°")
    start = start_of(page, house)
    assert (start.x_m, start.y_m, start.level) == (2.0, 2.0, 0)
    assert start.heading_rad == pytest.approx(1.5708, abs=1e-4)
    wait_for(page, "document.querySelector('#start')")
    page.select_option("#level", "1")
    wait_for(page, "!document.querySelector('#start')")
    drag(page, (5.0, 5.0), (8.0, 8.0))  # another place, on the first floor
    says(page, "Start at x 5.00, y 5.00 m, looking 45.0°")
    page.click('[data-tool="select"]')
    drag(page, (5.0, 5.0), (6.0, 5.0))
    start = start_of(page, house)
    assert (start.x_m, start.y_m, start.level) == (6.0, 5.0, 1)
    page.focus("#map")
    page.keyboard.press("Delete")
    says(page, "Deleted the start")
    assert written(page, house).start is None
    page.keyboard.press("Control+z")
    assert start_of(page, house).x_m == 6.0
    assert not page.wrong


def test_keys_alone_draw_stairs_and_the_start(browser: Any, house: EditServer) -> None:
    page = opened(browser, house)
    page.focus("#map")
    press = page.keyboard.press
    page.evaluate("echostep.tools.cross = [2, 5]")
    press("t")
    for keys in (("ArrowRight",) * 5, ("ArrowUp",) * 4, ()):
        press("Enter")
        for name in keys:
            press(name)
    press("Escape")
    page.locator("#ways[open]").wait_for()
    press("Enter")
    answered(page)
    press("g")
    press("Enter")
    press("ArrowLeft")
    press("Enter")
    plan = written(page, house)
    (way,) = plan.connectors
    assert (way.kind, way.levels, len(way.outline_m)) == ("stairs", (0, 1), 3)
    assert start_of(page, house).heading_rad == pytest.approx(3.1416, abs=1e-4)
    assert not page.wrong


@pytest.mark.parametrize("held", PHONES)
def test_fingers_draw_stairs_on_a_phone_held_either_way(
    browser: Any, house: EditServer, held: str, tmp_path: Path
) -> None:
    page = on_phone(browser, house, held)
    page.tap('[data-tool="stairs"]')
    for x, y in ((2, 3), (5, 3), (5, 6), (2, 6), (2, 3)):
        tap(page, x, y)
    page.locator("#ways[open]").wait_for()
    page.screenshot(path=tmp_path / f"stairs-{held}.png")
    found = violations(page)
    page.tap("#ways [value='yes']")  # the tap that opened the dialog chose nothing in it
    says(page, "Stairs: Ground, First")
    after = violations(page)
    page.screenshot(path=tmp_path / f"drawn-{held}.png")
    wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
    cut = page.evaluate(
        "[...document.querySelectorAll('button')].filter((e) => e.offsetParent && e.scrollWidth > e.clientWidth).map((e) => e.textContent)"
    )
    assert found == after == []
    assert (wide, cut, page.wrong) == (0, [], [])
    assert written(page, house).connectors[0].outline_m.tolist() == [[2, 3], [5, 3], [5, 6], [2, 6]]


def test_windows_and_what_is_wrong(browser: Any, house: EditServer) -> None:
    """Glass is cut into a wall, moved along it, and is no way; what plan check finds is gone to, one after the other."""
    page = opened(browser, house)
    page.click('[data-tool="window"]')
    click(page, 6.0, 0.0)
    says(page, "Window 0.90 m")
    page.click('[data-tool="select"]')
    drag(page, (6.0, 0.0), (8.0, 0.0))
    says(page, "Moved the window by 2.00 m, 0.0°")
    level = written(page, house).levels[0]
    assert (level.windows.round(2).tolist(), len(level.doors)) == ([[7.55, 0.0, 8.45, 0.0]], 0)
    page.click("#check")
    found = f"{len(check_plan(load_plan(house.file.path)))} findings: "
    assert until(lambda: found in status(page)), status(page)
    page.click("#check")
    assert until(lambda: status(page).startswith(f"2 of {found}")), status(page)
    page.click('[data-tool="erase"]')
    page.select_option("#level", "0")
    page.click("#whole")
    click(page, 8.0, 0.0)
    says(page, "Deleted the window")
    assert not len(written(page, house).levels[0].windows)
    page.click('[data-tool="start"]')
    click(page, 2.0, 2.0)
    page.click('[data-tool="wall"]')
    assert status(page).startswith("No start drawn. Click from corner to corner")
    page.set_viewport_size({"width": 320, "height": 256})
    wait_for(page, "document.querySelector('#status').clientWidth > 100")
    assert not page.wrong
