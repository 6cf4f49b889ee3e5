# SPDX-License-Identifier: MIT
"""A traced picture of 30 rooms is clean after 40 strokes: a stroke is a drag, a tap or a key."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import shapely

from echostep.plan import Plan, load_plan
from echostep_app.page.editor import EditServer
from echostep_app.plan.check import check_plan
from echostep_app.plan.importers.formats import import_plan
from echostep_app.plan.importers.report import Hints
from echostep_app.plan.places.faces import OUTSIDE
from echostep_app.plan.places.spaces import find_spaces
from echostep_app.plan.questions import with_questions
from echostep_app.plan.writer import save_plan
from page.browser import PICTURES, spot, wait_for
from page.edit.drawing import opened, status
from page.edit.traced_house import PIXEL_M, ROOMS, draw, room_middles

MOST_STROKES = 40
NEAR_M = 0.1  # two and a half pixels
# Round a wall of 1 m that begins at 0, 0
ROUND = (0.2, 0.7), (3.4, 0.7), (3.4, -2.1), (0.2, -2.1), (0.2, -0.25), (1.2, -0.25), (1.2, 0.25), (0.2, 0.25)


class Hand:
    """A person's hand on the page, whose strokes are counted."""

    def __init__(self, page: Any) -> None:
        self._page = page
        self.strokes = 0

    def tap(self, selector: str) -> None:
        self.strokes += 1
        self._page.click(selector)

    def key(self, name: str) -> None:
        self.strokes += 1
        self._page.keyboard.press(name)

    def drag(self, *places: tuple[float, float], held: str = "") -> None:
        """Along these places; `held`: a key meanwhile, as Shift."""
        self.strokes += 1
        if held:
            self._page.keyboard.down(held)
        self._page.mouse.move(*spot(self._page, *places[0]))
        self._page.mouse.down()
        for place in places[1:]:
            self._page.mouse.move(*spot(self._page, *place), steps=3)
        self._page.mouse.up()
        if held:
            self._page.keyboard.up(held)


def traced(path: Path) -> Plan:
    return with_questions(import_plan(path, Hints(scale_m=PIXEL_M)))


def walls(plan: Plan) -> Any:
    """The walls as one geometry."""
    return shapely.union_all(shapely.linestrings(plan.levels[0].walls.reshape(-1, 2, 2)))


def enclosed_rooms(plan: Plan) -> int:
    """How many of the picture's rooms are spaces of their own."""
    spaces = find_spaces(plan, 0)
    assert spaces is not None
    return len({spaces.face_at(*place) for place in room_middles()} - {OUTSIDE})


def clean(hand: Hand) -> None:
    """Take away all that is no wall."""
    hand.drag((1.3, 8.6), (24.7, 13.0))  # half a row of rooms: their walls leave the rectangle
    hand.drag((29.3, 8.6), (60.6, 13.0), held="Shift")
    for x0, x1 in ((1.3, 8.8), (13.3, 36.8), (41.3, 60.6)):
        hand.drag((x0, 1.4), (x1, 5.8), held="Shift")
    hand.drag((19.5, 6.5), (27.0, 8.0), held="Shift")
    hand.drag((29.6, 11.4), (30.4, 13.4), held="Shift")  # what touches the outer wall
    hand.key("l")
    for x, y in ((9.1, 3.5), (37.1, 3.5), (25.1, 10.7)):  # round the walls that stand in a room
        hand.drag(*((x + dx, y + dy) for dx, dy in ROUND), held="Shift")


def test_a_traced_picture_of_30_rooms_is_clean_after_40_strokes(browser: Any, tmp_path: Path) -> None:
    picture = draw(tmp_path / "scan.png", cluttered=True)
    wanted, dirty = traced(draw(tmp_path / "clean.png", cluttered=False)), traced(picture)
    assert len(dirty.levels[0].walls) > 3 * len(wanted.levels[0].walls)
    save_plan(dirty, tmp_path / "plan.json")
    with EditServer(tmp_path / "plan.json", picture, 0) as server:
        page = opened(browser, server, viewport={"width": 1280, "height": 520})
        hand = Hand(page)
        assert not status(page).startswith("Set the scale first")  # the import knows it: walls lie on the picture's
        clean(hand)
        wait_for(page, "document.querySelector('#chosen').getAttribute('d').length > 1000")
        page.screenshot(path=(PICTURES or tmp_path) / "plan-edit.png")
        hand.key("Delete")
        page.screenshot(path=tmp_path / "deleted.png")
        hand.key("w")
        hand.drag((29.9, 13.2), (30.5, 13.2))  # the crack that is left in the outer wall
        hand.tap("#save")
        page.get_by_text("Saved plan.json").wait_for()
        page.screenshot(path=tmp_path / "cleaned.png")
        assert not page.wrong
    cleaned = load_plan(tmp_path / "plan.json")
    assert walls(wanted).buffer(NEAR_M).covers(walls(cleaned))
    assert walls(cleaned).buffer(NEAR_M).covers(walls(wanted))
    assert (enclosed_rooms(cleaned), check_plan(cleaned)) == (2 * ROOMS, [])
    assert hand.strokes <= MOST_STROKES
