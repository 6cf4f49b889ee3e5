# SPDX-License-Identifier: MIT
"""The verbs of `plan edit` in Chromium: scale, wall, door, name, select many and delete; by mouse, by keys, by fingers."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from echostep.plan import load_plan, parse_plan
from echostep_app.page.editor import EditServer
from echostep_app.plan.check import check_plan
from echostep_app.plan.writer import save_plan
from page.browser import PICTURES, overflow, spot, violations, wait_for
from page.edit.drawing import PHONES, answers, click, drag, on_phone, opened, saved, says, status, tap
from waiting import until

HOUSE = {
    "echostep_plan": 1,
    "name": "house",
    "levels": [
        {
            "name": "Ground", "height_m": 0,
            "walls": [[0, 0, 5, 0], [6, 0, 8, 0], [9, 0, 12, 0], [12, 0, 12, 8], [12, 8, 0, 8], [0, 8, 0, 0], [2, 2, 3, 2], [3, 2, 3, 3]],
            "doors": [{"line": [5, 0, 6, 0]}], "windows": [[8, 0, 9, 0]], "obstacles": [[[5, 3], [6, 3], [6, 4]]],
            "rooms": [{"name": "Hall", "at": [8, 3]}],
        },
        {"name": "First", "height_m": 3, "walls": [[0, 0, 12, 0]]},
    ],
    "connectors": [{"kind": "lift", "levels": ["Ground", "First"], "outline": [[9, 5], [11, 5], [11, 7], [9, 7]]}],
    "start": {"x": 2.5, "y": 5, "heading_deg": 0},
}  # fmt: skip
APART = """(() => {
    const boxes = [...document.querySelectorAll('#marks text')].map((e) => e.getBoundingClientRect());
    const apart = (a, b) => a === b || a.left >= b.right || a.right <= b.left || a.top >= b.bottom || a.bottom <= b.top;
    return boxes.length > 3 && boxes.every((a) => boxes.every((b) => apart(a, b)));
})()"""
LEFT = """(() => {
    const { level, tree } = echostep.sheet, lists = [level.walls, level.doors, level.windows, level.obstacles, level.rooms, tree.connectors];
    return [...lists.map((list) => list?.length ?? 0), tree.start ? 1 : 0];
})()"""  # elements of the plan by kind
VIEW = "[echostep.view.x, echostep.view.y, echostep.view.scale]"
WALLS = "echostep.sheet.level.walls"


@pytest.fixture
def house(tmp_path: Path) -> Iterator[EditServer]:
    save_plan(parse_plan(json.dumps(HOUSE).encode()), tmp_path / "house.json")
    with EditServer(tmp_path / "house.json", port=0) as server:
        yield server


def test_the_scale_walls_and_doors(browser: Any, drawn: EditServer) -> None:
    page = opened(browser, drawn)
    page.click('[data-tool="scale"]')  # 400 px are 20 m at first; the rectangle's upper side is 15 m
    answers(page, "7.5")
    drag(page, (2.5, 12.5), (17.5, 12.5))
    assert page.evaluate("echostep.sheet.tree.picture") == [pytest.approx(0.025, abs=1e-3), 0, 0]
    page.click("#whole")
    page.click('[data-tool="wall"]')
    for place in ((3.01, 2.02), (8.02, 2.05), (8.04, 6.0), (8.04, 6.0)):
        click(page, *place)
    says(page, "Wall ended")
    drag(page, (1.0, 2.0), (1.0, 6.0))
    page.click('[data-tool="door"]')
    drag(page, (5.0, 2.0), (5.95, 2.0))
    says(page, "Door 0.95 m")
    drag(page, (4.0, 4.0), (5.0, 4.0))
    assert status(page).startswith("No wall here")
    click(page, 1.0, 2.0)  # the gap, by two taps
    click(page, 3.0, 2.0)
    says(page, "Door 2.00 m")
    page.click("#step-back")
    level = saved(page, drawn)
    assert level.walls.tolist() == [[3, 2, 5, 2], [5.95, 2, 8, 2], [8, 2, 8, 6], [1, 2, 1, 6]]
    assert [door.line for door in level.doors] == [(5.0, 2.0, 5.95, 2.0)]
    page.click('[data-tool="select"]')
    click(page, 5.5, 2.0)
    page.click("#delete")  # the wall is closed where the door was
    assert sorted(saved(page, drawn).walls.tolist()) == [[1, 2, 1, 6], [3, 2, 8, 2], [8, 2, 8, 6]]
    page.click('[data-tool="room"]')
    answers(page, "Hall")
    click(page, 5.0, 4.0)
    answers(page, "Lobby", "Hall")
    click(page, 5.0, 4.0)
    assert [room.name for room in saved(page, drawn).rooms] == ["Lobby"]
    assert not page.wrong


def test_many_are_selected_and_deleted_in_one_step(browser: Any, house: EditServer, tmp_path: Path) -> None:
    page = opened(browser, house)
    before, all_left = page.evaluate("JSON.stringify(echostep.sheet.tree)"), page.evaluate(LEFT)
    drag(page, (1.5, 1.5), (7.0, 5.5))  # not the outer walls, which leave the rectangle
    says(page, "Selected: 4")  # two walls, an obstacle, the start
    page.screenshot(path=(PICTURES or tmp_path) / "plan-edit.png")
    click(page, 4.0, 5.0)
    says(page, "Nothing here")
    for place in ((5.5, 0.0), (8.5, 0.0), (8.0, 3.0)):
        click(page, *place)
        says(page, "Selected: 1")
    page.keyboard.down("Shift")
    click(page, 8.5, 0.0)
    drag(page, (4.5, 4.5), (11.5, 2.5))
    drag(page, (8.5, 4.5), (11.5, 7.5))
    says(page, "Selected: 4")  # the name, the window, the obstacle, the lift
    click(page, 8.0, 3.0)
    says(page, "Selected: 3")
    page.keyboard.up("Shift")
    page.keyboard.press("Delete")
    says(page, "Deleted: 3")
    assert page.evaluate(LEFT) == [7, 1, 0, 0, 1, 0, 1]  # two walls and the window are one wall
    page.keyboard.press("Delete")
    says(page, "Nothing is selected")
    page.click("#step-back")
    assert page.evaluate("JSON.stringify(echostep.sheet.tree)") == before
    page.click("#farther")
    drag(page, (-1.0, -1.0), (13.0, 9.0))
    says(page, f"Selected: {sum(all_left)}")
    page.click("#delete")
    page.click("#save")
    page.get_by_text("Saved house.json").wait_for()
    plan = load_plan(house.file.path)
    assert (len(plan.levels[0].walls), len(plan.levels[1].walls), plan.start, plan.connectors) == (0, 1, None, ())
    assert not page.wrong


def test_drawing_does_not_move_the_sheet_and_moving_it_draws_nothing(browser: Any, drawn: EditServer) -> None:
    page = opened(browser, drawn)
    begin = page.evaluate(VIEW)
    page.click('[data-tool="wall"]')
    drag(page, (2.0, 4.0), (6.0, 4.0))
    drag(page, (2.0, 6.0), (6.0, 6.0))
    assert page.evaluate(WALLS) == [[2, 4, 6, 4], [2, 6, 6, 6]]
    page.click('[data-tool="room"]')
    drag(page, (4.0, 5.0), (4.0, 4.0))
    assert page.evaluate(VIEW) == begin
    page.click('[data-tool="wall"]')
    click(page, 8.0, 4.0)
    drag(page, (9.0, 4.0), (8.0, 5.0), "right")
    assert page.evaluate(VIEW) != begin
    click(page, 8.0, 6.0)  # the wall that was begun goes on
    assert page.evaluate(f"{WALLS}.at(-1)") == [8, 4, 8, 6]
    assert not page.wrong


def test_keys_alone_draw_name_and_delete(browser: Any, drawn: EditServer) -> None:
    page = opened(browser, drawn)
    page.focus("#map")
    page.evaluate("echostep.tools.cross = [5, 5]")

    def press(keys: str) -> None:
        for name in keys.split():
            page.keyboard.press(name)

    press("w Enter" + 20 * " ArrowRight")
    reached = page.evaluate("echostep.tools.cross[0]")
    answers(page, "Hall")
    press("Enter Escape" + 10 * " ArrowLeft" + " d Enter ArrowLeft ArrowLeft Enter ArrowUp ArrowUp n Enter")
    press("Control+s")
    page.get_by_text("Saved new.json").wait_for()
    level = load_plan(drawn.file.path).levels[0]
    assert (level.walls[0, :2].tolist(), level.walls[-1, 2:].tolist()) == ([5.0, 5.0], [pytest.approx(reached), 5.0])
    assert (len(level.doors), [room.name for room in level.rooms]) == (1, ["Hall"])
    press("v Enter")
    says(page, "Selected: 1")
    press("ArrowDown ArrowDown Shift+Enter")
    says(page, "Selected: 2")
    press("Delete Control+z ArrowUp l Space" + 20 * " ArrowRight" + 3 * " ArrowDown")
    press(40 * "ArrowLeft " + 3 * " ArrowUp" + " Space")
    says(page, "Selected: 3")  # two walls and the door
    press("Delete")
    assert page.evaluate(LEFT)[:5] == [0, 0, 0, 0, 1]
    assert not page.wrong


@pytest.mark.parametrize("held", PHONES)
def test_fingers_on_a_phone_held_either_way(browser: Any, house: EditServer, held: str) -> None:
    page = on_phone(browser, house, held)
    page.tap("#add")
    for place in ((2.5, 2.0), (3.0, 2.5)):
        tap(page, *place)
    says(page, "Selected: 2")
    page.tap("#lasso")
    finger = page.context.new_cdp_session(page)

    def touch(kind: str, *place: float) -> None:
        x, y = spot(page, *place) if place else (0, 0)
        finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y}] if place else []})

    touch("touchStart", 4.5, 2.5)
    for place in ((7.0, 2.5), (7.0, 4.5), (4.5, 4.5)):
        touch("touchMove", *place)
    touch("touchEnd")
    says(page, "Selected: 3")
    found = violations(page)
    assert (found, overflow(page)) == ([], (0, 0))
    page.tap("#delete")
    says(page, "Deleted: 3")
    page.tap("#step-back")
    page.tap('[data-tool="room"]')
    answers(page, "Office")
    tap(page, 4.0, 6.0)
    says(page, "Room Office")
    assert page.evaluate(LEFT) == [8, 1, 1, 1, 2, 1, 1]
    assert not page.wrong


def test_what_is_wrong_is_gone_to(browser: Any, house: EditServer) -> None:
    page = opened(browser, house)
    (finding,) = check_plan(load_plan(house.file.path))
    page.click("#check")
    assert until(lambda: status(page).startswith("1 of 1 findings: lift ")), status(page)
    assert page.evaluate("echostep.tools.cross") == pytest.approx(finding.position_m)
    assert not page.wrong


def test_geometry(browser: Any, drawn: EditServer) -> None:
    page = opened(browser, drawn)
    rng = np.random.default_rng(7)
    geometry = "import(location.href + 'edit/geometry.js')"
    for _ in range(30):  # a door cut anywhere and closed again is the wall that was
        x0, y0, x1, y1 = wall = rng.uniform(-50, 50, 4).round(2).tolist()
        t = rng.random()
        p, width = [x0 + t * (x1 - x0), y0 + t * (y1 - y0)], 0.9
        level, closed = page.evaluate(
            f"""async ([wall, p, w]) => {{ const g = await {geometry}, cut = g.cutDoor({{ walls: [wall] }}, 0, p, w);
            return [cut, g.closed(cut.walls, cut.doors[0].line)]; }}""",
            [wall, p, width],
        )
        x2, y2, x3, y3 = level["doors"][0]["line"]
        assert np.hypot(x3 - x2, y3 - y2) == pytest.approx(width, abs=2e-4)
        lengths = [np.hypot(c - a, d - b) for a, b, c, d in level["walls"]]
        assert sum(lengths) + width == pytest.approx(np.hypot(x1 - x0, y1 - y0), abs=1e-3)
        assert sorted([closed[0][:2], closed[0][2:]]) == sorted([[x0, y0], [x1, y1]])
    short, snapped, within = page.evaluate(
        f"""async () => {{ const g = await {geometry}, walls = [[0, 0, 4, 0], [4, 0, 4, 3]], hook = [[0, 0], [4, 0], [4, 4], [3, 4], [3, 1], [0, 1]];
        return [g.cutDoor({{ walls }}, 0, [1, 0], 5), [
          g.snap([3.9, 0.1], {{ walls }}), g.snap([1.02, 1.53], {{ walls }}), g.snap([2.04, 0.1], {{ walls }}),
          g.snap([2.13, 2.12], {{ from: [1, 1], before: [0, 0] }}), g.snap([1.07, 3.02], {{ from: [1, 1] }}),
          g.snap([3.93, 2.02], {{ walls, from: [1, 2] }})],
          [[0.5, 0.5, 3.5, 0.5], [0.5, 0.5, 3.5, 3.5], [1, 2, 2, 2], [3.5, 3, 3.5, 3]].map((row) => g.within(row, hook))]; }}"""
    )
    assert short is None
    assert [(row["kind"], row["at"]) for row in snapped] == [
        ("end", [4, 0]),
        ("grid", [1.0, 1.55]),
        ("wall", [2.04, 0]),
        ("right angle", pytest.approx([1 + 1.6 * 0.5**0.5, 1 + 1.6 * 0.5**0.5], abs=1e-4)),
        ("right angle", [1, 3]),
        ("wall", [4, 2]),
    ]
    assert within == [True, False, False, True]


@pytest.mark.parametrize("look", ["dark", "contrast"])
def test_nothing_keeps_anybody_out(browser: Any, served: EditServer, look: str) -> None:
    phone = {"viewport": {"width": 360, "height": 640}, "has_touch": True, "is_mobile": True}
    page = opened(browser, served, **({} if look == "dark" else phone))
    page.select_option("#look", look)
    drag(page, (0.0, 0.0), (26.0, 14.0))
    found = violations(page)
    assert not page.wrong
    assert found == []
    assert overflow(page) == (0, 0)
    page.set_viewport_size({"width": 320, "height": 256})
    wait_for(page, "echostep.view.width < 250")
    page.click("#whole")
    wait_for(page, APART)  # names that would cover others are left out
    wait_for(page, "document.querySelector('#status').clientWidth > 100")
