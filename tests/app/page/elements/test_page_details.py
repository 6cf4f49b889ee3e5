# SPDX-License-Identifier: MIT
"""Details of the page: floors fit and faults are said in words, in Chromium; beacons of teammates."""

from __future__ import annotations

import math
from typing import Any

import pytest

from aiding.team.two_wearers import Two, told, two_wearers
from echostep.ports.people.team_beacons import SharedBeacon
from echostep_app.page import protocol
from echostep_app.page.elements.marks import beacon_marks
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


@pytest.fixture(scope="module")
def two() -> Two:
    return two_wearers()


@pytest.mark.slow
def test_a_page_shows_the_teammates_beacons_that_are_not_its_own(two: Two) -> None:
    far = SharedBeacon(99, 20.0, 2.0, 0, 0.04, 0.0, 0.01)
    tracker, estimates = two.run(told(*two.beacons, far))
    marks = {mark.number: mark for mark in beacon_marks(tracker, estimates[-1].t_s)}
    assert (marks[99].by, marks[99].state, marks[99].heard) == ("kim", "well", False)
    assert marks[99].radius95_m == pytest.approx(0.2 * math.sqrt(5.991), rel=1e-3)
    own = [mark for mark in marks.values() if mark.by is None]
    assert (
        {mark.number for mark in own} == {tracker.gateway.numbers[p.slot] for p in tracker.beacon_places(0.0)} != set()
    )
