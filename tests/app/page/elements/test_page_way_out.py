# SPDX-License-Identifier: MIT
"""The way out on the page: one tap, shown and spoken; without an exit the way back along the own steps."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from echostep.plan import Door
from echostep.ports.chunks import Chunk, portion_of
from echostep.tracker import Tracker
from echostep_app.page.elements.marks import BLOCKED, ShownMark, ShownOrder
from echostep_app.page.live import LivePage
from echostep_app.page.mailbox import Mailbox
from echostep_app.page.server import PageServer
from echostep_app.plan.routing import EXIT
from echostep_simulation.scenario import Scenario
from page.browser import LOOKS, READY, loaded_page, picture, spot, wait_for
from page.frames import LOCAL, PLAN, scene, told
from page.test_page_browser import SPEECH
from plan.test_exits import EAST, INNER, SOUTH, house, level

HOUSE = house(level(0.0, Door(SOUTH), Door(EAST), Door(INNER)), level(3.5, Door(INNER)))
SHOWN = "document.querySelector('#guidance').innerText"


def test_the_way_out_is_one_tap_and_is_spoken(browser: Any, tmp_path: Any) -> None:
    mailbox = Mailbox(HOUSE, "test", replay=False)
    with PageServer(mailbox, LOCAL) as server:
        mailbox.publish(replace(scene(), estimate=told(12.0, 5.0), particles=None))
        page = loaded_page(browser, server.url, LOOKS["bright"], READY, SPEECH)
        assert page.evaluate("[...document.querySelector('#goal').options].map((o) => o.text)")[:2] == [
            "Go to…",
            "Way out",
        ]
        page.click("#way-out")
        wait_for(page, "echostep.last.guidance?.path.length > 1")
        wait_for(page, "document.querySelector('#goal').value === 'exit'")
        assert page.evaluate("echostep.last.guidance.path.at(-1)") == [20.6, 5.0]
        wait_for(page, "said.includes('Way out. Straight ahead.')")
        assert page.evaluate(SHOWN).startswith("Straight ahead\n9 m to go")
        picture(page, "way-out", tmp_path)
        mailbox.publish(replace(scene(), estimate=told(20.5, 5.0, t_s=9.0), particles=None))
        wait_for(page, "said.at(-1) === 'You are outside.'")
        page.select_option("#goal", "")
        wait_for(page, "document.querySelector('#guidance').hidden")
        assert not page.wrong


def test_a_passage_is_struck_out_by_a_tap_and_the_way_is_made_anew(browser: Any, tmp_path: Any) -> None:
    mailbox = Mailbox(HOUSE, "test", replay=False)
    with PageServer(mailbox, LOCAL) as server:
        mailbox.publish(replace(scene(), estimate=told(12.0, 5.0), particles=None))
        page = loaded_page(browser, server.url, LOOKS["bright"], READY)
        page.click("#way-out")
        wait_for(page, "echostep.last.guidance?.path.at(-1)?.[0] === 20.6")
        for x_m in (4.5, 20.6):  # a second tap there takes it back
            page.touchscreen.tap(*spot(page, 19.6, 5.3))
            page.click("#sheet-strike")
            wait_for(page, f"echostep.last.guidance?.path.at(-1)?.[0] === {x_m}")
            picture(page, f"struck-{x_m}", tmp_path)
        mailbox.set_marks((ShownMark("1", BLOCKED, 20.0, 5.0, 0, "Ann"),))  # a commander's
        wait_for(page, "echostep.last.guidance?.path.at(-1)?.[0] === 4.5")
        assert not page.wrong


def test_the_order_to_leave_shows_and_speaks_the_way_out(browser: Any) -> None:
    mailbox = Mailbox(HOUSE, "test", replay=False)
    order = ShownOrder("everybody 1", "Ann: Everybody out!", urgent=True)
    with PageServer(mailbox, LOCAL) as server:
        mailbox.publish(replace(scene(), estimate=told(12.0, 5.0), particles=None))
        page = loaded_page(browser, server.url, LOOKS["bright"], READY, SPEECH)
        mailbox.set_orders((replace(order, id="note 1", urgent=False),))
        wait_for(page, "said.includes('Ann: Everybody out!')")
        assert page.evaluate("echostep.last.goal") is None  # a note sends nobody out
        mailbox.set_orders((order,))
        wait_for(page, "said.at(-1) === 'Ann: Everybody out! Straight ahead.'")
        assert page.evaluate(SHOWN).startswith("Straight ahead\n9 m to go")
        page.click("#understood")
        mailbox.set_orders(())
        mailbox.publish(replace(scene(), estimate=told(20.5, 5.0, t_s=9.0), particles=None))
        wait_for(page, "said.at(-1) === 'You are outside.'")
        assert not page.wrong


def test_without_an_exit_the_way_out_is_the_way_back(scenario: Scenario, chunks: list[Chunk]) -> None:
    tracker = Tracker(PLAN, scenario.start, seed=5)
    with LivePage(tracker, "test", LOCAL) as live:
        half = 2 * len(chunks) // 3
        for part in (chunks[:half], chunks[half:]):
            portion = portion_of(part)
            tracker.take(portion)
            live.publish(portion)
            shown = live.mailbox.latest.guidance if live.mailbox.latest else None
            if part is not chunks[half:]:
                live.mailbox.set_goal(EXIT)
        assert shown
        assert shown.own
        assert shown.path[-1] == pytest.approx((2.0, 7.5), abs=0.1)
