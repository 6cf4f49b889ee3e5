# SPDX-License-Identifier: MIT
"""Details of the page in Chromium: floors fit, faults are said in words."""

from __future__ import annotations

from typing import Any

import pytest

from echostep_app.page import protocol
from echostep_app.page.mailbox import Mailbox
from page.browser import LOOKS, looking, opened_page, wait_for
from page.frames import PLAN, scene, served
from plan.imported_plans import seven_floors

BOX = "(({ left, top, right, bottom }) => [left, top, right, bottom])(document.querySelector('%s').getBoundingClientRect())"


@pytest.mark.parametrize("look", ["bright", "dark"])
def test_one_floor_needs_no_button_and_seven_fit(browser: Any, look: str) -> None:
    for plan in (PLAN, seven_floors()):
        with served(Mailbox(plan, "test", replay=False)) as (server, mailbox):
            mailbox.publish(scene())
            page = looking(browser, server.url, look)
            assert (page.is_visible("#floors") or page.is_visible("#floor")) == (plan is not PLAN)
            if plan is not PLAN:
                chosen = "#floor" if look == "bright" else "#floors"
                control, area = page.evaluate(f"[{BOX % chosen}, {BOX % '#map'}]")
                assert all(a <= b for a, b in zip(area[:2], control[:2], strict=True))
                assert all(a >= b for a, b in zip(area[2:], control[2:], strict=True))
                assert control[3] - control[1] < 0.85 * (area[3] - area[1])
            if look == "bright" and plan is not PLAN:
                page.select_option("#floor", "5")
                wait_for(page, "echostep.scene.level === 5")


@pytest.mark.long
def test_a_fault_of_the_server_is_said_and_goes_when_it_is_gone(browser: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise TypeError("ndarray")

    with served() as (server, mailbox):
        mailbox.publish(scene())
        monkeypatch.setattr(protocol, "hello", broken)
        page = opened_page(browser, **LOOKS["bright"])
        page.goto(server.url)
        wait_for(
            page,
            "document.querySelector('#fault').textContent.startsWith(\"The page's server has a fault: TypeError: ndarray\")",
        )
        assert page.is_visible("#fault")
        monkeypatch.undo()
        wait_for(
            page, "echostep.scene.frame && document.querySelector('#fault').hidden"
        )  # the page tries again by itself
        assert len(server.shared.faults.notices) == 1
        page.evaluate("setTimeout(() => { throw new Error('of the page'); })")
        wait_for(
            page,
            "document.querySelector('#fault').textContent === 'This page has a fault: Uncaught Error: of the page. Reload it.'",
        )
