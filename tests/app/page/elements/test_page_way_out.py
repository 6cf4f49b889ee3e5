# SPDX-License-Identifier: MIT
"""The way out on the page: one tap, shown and spoken; without an exit the way back along the own steps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from echostep.plan import Door
from echostep.ports.chunks import Chunk, portion_of
from echostep.tracker import Tracker
from echostep_app.page.elements.marks import BLOCKED, ShownMark, ShownOrder
from echostep_app.page.mailbox import Mailbox
from echostep_app.plan.routing import EXIT
from echostep_app.session.options import OutputOptions
from echostep_app.session.session import Session
from echostep_simulation.scenario import Scenario
from page.browser import DESK, LOOKS, READY, loaded_page, picture, spot, wait_for
from page.frames import LOCAL, PLAN, scene, served, told
from page.test_page_browser import SPEECH
from plan.test_exits import EAST, INNER, SOUTH, house, level

HOUSE = house(level(0.0, Door(SOUTH), Door(EAST), Door(INNER)), level(3.5, Door(INNER)))
END = "echostep.last.guidance?.path.at(-1)?."
SIGNS = "[...document.querySelectorAll('#rooms .exit')].filter((e) => e.textContent === 'EXIT' && e.getAttribute('visibility') === 'visible').length"
WHOLE = """(() => {
    const box = (e) => e.getBoundingClientRect(), signs = [...document.querySelectorAll('#rooms .exit')].map(box);
    const map = box(document.querySelector('#map'));
    return signs.length === 2 && signs.every((sign) => sign.width > 60 && sign.left >= map.left && sign.right <= map.right);
})()"""
SHOWN = "document.querySelector('#guidance').innerText"


@pytest.fixture
def visit(browser: Any) -> Iterator[tuple[Mailbox, Any]]:
    """What a wearer in the house is shown, and the page."""
    with served(Mailbox(HOUSE, "test", replay=False)) as (server, mailbox):
        stands(mailbox, 12.0)
        page = loaded_page(browser, server.url, LOOKS["bright"], READY, SPEECH)
        yield mailbox, page
        assert not page.wrong


def stands(mailbox: Mailbox, x_m: float) -> None:
    mailbox.publish(replace(scene(), estimate=told(x_m, 5.0, t_s=x_m), particles=None))


def test_the_way_out_is_one_tap_and_is_spoken(visit: tuple[Mailbox, Any], tmp_path: Path) -> None:
    mailbox, page = visit
    wait_for(page, f"{SIGNS} === 2")  # each exit has its sign, before anybody asks
    page.click("#way-out")
    wait_for(page, "document.querySelector('#goal').value === document.querySelector('#goal').options[1].value")
    wait_for(page, f"{END}[0] === 20.6 && said.includes('Way out. Straight ahead.')")
    assert page.evaluate(SHOWN).startswith("Straight ahead\n9 m to go")
    picture(page, "way-out", tmp_path)
    stands(mailbox, 20.5)
    wait_for(page, "said.at(-1) === 'You are outside.'")
    page.select_option("#goal", "")
    wait_for(page, "document.querySelector('#guidance').hidden")


def test_signs_of_exits_are_whole_beside_the_plan(browser: Any) -> None:
    with served(Mailbox(HOUSE, "test", replay=False)) as (server, mailbox):
        stands(mailbox, 12.0)
        page = loaded_page(browser, server.url, {**DESK, "locale": "de-DE"}, READY)
        page.click("#whole")
        wait_for(page, WHOLE)


def test_a_passage_is_struck_out_by_a_tap_and_the_way_is_made_anew(visit: tuple[Mailbox, Any], tmp_path: Path) -> None:
    mailbox, page = visit
    page.click("#way-out")
    for x_m in (20.6, 4.5, 20.6):  # a second tap takes it back
        wait_for(page, f"{END}[0] === {x_m}")
        picture(page, f"struck-{x_m}", tmp_path)
        page.touchscreen.tap(*spot(page, 19.6, 5.3))
        page.click("#sheet-strike")
    wait_for(page, f"{END}[0] === 4.5")
    page.touchscreen.tap(*spot(page, 19.6, 5.3))
    page.click("#sheet-strike")
    mailbox.set_marks((ShownMark("1", BLOCKED, 20.0, 5.0, 0, "Ann"),))  # a commander's
    wait_for(page, f"{END}[0] === 4.5 && echostep.scene.marks.length === 1")


def test_the_order_to_leave_shows_and_speaks_the_way_out(visit: tuple[Mailbox, Any]) -> None:
    mailbox, page = visit
    order = ShownOrder("everybody 1", "Ann: Everybody out!", urgent=True)
    mailbox.set_orders((replace(order, id="note 1", urgent=False),))
    wait_for(page, "said.includes('Ann: Everybody out!')")
    assert page.evaluate("echostep.last.goal") is None  # a note sets no goal
    mailbox.set_orders((order,))
    wait_for(page, "said.at(-1) === 'Ann: Everybody out! Straight ahead.'")
    assert page.evaluate(SHOWN).startswith("Straight ahead\n9 m to go")
    page.click("#understood")
    mailbox.set_orders(())
    stands(mailbox, 20.5)
    wait_for(page, "said.at(-1) === 'You are outside.'")


def test_without_an_exit_a_run_to_it_goes_back(scenario: Scenario, chunks: list[Chunk], tmp_path: Path) -> None:
    tracker, output = Tracker(PLAN, scenario.start, seed=5), OutputOptions(tmp_path, terminal=False, page=LOCAL)
    with Session(tracker, "test", "live", output, EXIT) as session:
        assert session.page
        assert session.page.mailbox.goal == EXIT  # so that it avoids what is struck out on the page
        half = 2 * len(chunks) // 3
        for part in (chunks[:half], chunks[half:]):
            portion = portion_of(part)
            tracker.take(portion)
            session.page.publish(portion)
        shown = session.page.mailbox.latest.guidance if session.page.mailbox.latest else None
        assert shown
        assert shown.own
        assert shown.path[-1] == pytest.approx((2.0, 7.5), abs=0.1)
