# SPDX-License-Identifier: MIT
"""Both pages in windows of every size in Chromium: the map keeps its place whatever the status says, and everything can be reached."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from echostep.localization import LikelyPlace, TrackStatus
from echostep_app.page.elements.alarm import ShownAlarm
from echostep_app.page.elements.scene import PageScene, status_text
from echostep_app.page.elements.stream_rates import StreamRates
from echostep_app.page.mailbox import Mailbox
from echostep_app.team.messages.report import ReportedAlarm
from operation.teams import TOWER, ServedTeam, place, whole_team
from page.browser import READY, TABLE_READY, loaded_page, overflow, violations, wait_for
from page.frames import scene, served, told
from plan.imported_plans import seven_floors

SIZES = ((1280, 800), (360, 740), (740, 360), (320, 256))
LOW = ((740, 360), (320, 256))  # a phone held sideways, and 1280 x 1024 at 400 %
BOX = "JSON.stringify(document.querySelector('#map').getBoundingClientRect())"
HEADER = "document.querySelector('header').getBoundingClientRect().height"
SHARE = "document.querySelector('#map').getBoundingClientRect().height / innerHeight"
UNREACHED = """(() => {
    const wrong = [];
    for (const element of document.querySelectorAll('button, select, input')) {
        if (!element.offsetParent || element.disabled) continue;
        const name = element.id || element.textContent;
        const isCut = element.tagName === 'BUTTON' && element.scrollWidth > element.clientWidth + 1;
        if (isCut && getComputedStyle(element).textOverflow !== 'ellipsis') wrong.push(`${name} is too narrow`);
        element.scrollIntoView({ block: 'center' });
        for (const box of [document.documentElement, document.body]) {
            if (getComputedStyle(box).overflowY !== 'hidden' || !box.scrollTop) continue;  // a script may scroll it, a finger may not
            wrong.push(`${name} is beyond the window`);
            box.scrollTop = 0;
        }
        const { left, top, width, height } = element.getBoundingClientRect(), hit = document.elementFromPoint(left + width / 2, top + height / 2);
        if (!element.contains(hit)) wrong.push(`${name} is under ${hit?.id || hit?.tagName}`);
        if (width < 24 || height < 24) wrong.push(`${name} is too small`);
    }
    document.body.scrollTo(0, 0);
    return wrong;
})()"""  # what a finger cannot reach, or what is cut off
PLACES = (LikelyPlace(0.62, 12.0, 7.0, 1, 0.4, 0.0), LikelyPlace(0.31, 4.0, 10.0, 3, 0.4, 0.0))
RATES = StreamRates(
    100.0, 31.0, 12345, 678, 90, True, 0, "the board has no rangers: look at its plug (docs/mistakes.md)"
)
RUNNING = "running: position good to about 12.3 m"
MAYDAY = ShownAlarm("mayday", "Mayday: a fall 14 s ago. No team is connected: only this page says so.", "Mayday.", 1)


def moments() -> list[PageScene]:
    """What a page is told in a bad hour."""
    known = scene(2.0)
    lost = replace(told(t_s=3.0, status=TrackStatus.LOST, sd_m=4.0), levels=(0.2,) * 7)
    several = replace(told(12.0, 7.0, 4.0, TrackStatus.UNCERTAIN), level=1, levels=(0.1,) * 7, hypotheses=PLACES)
    return [
        replace(known, status_text="tracking, 0.2 m"),
        replace(scene(3.0), estimate=lost, status_text=status_text(lost)),
        replace(scene(4.0), estimate=several, status_text=status_text(several), streams=RATES, gait=RUNNING),
        replace(scene(5.0), estimate=several, status_text=status_text(several), streams=RATES, alarm=MAYDAY),
    ]  # fmt: skip


def opened(browser: Any, url: str, size: tuple[int, int], ready: str) -> Any:
    return loaded_page(browser, url, {"viewport": {"width": size[0], "height": size[1]}}, ready)


def check(page: Any, size: tuple[int, int]) -> None:
    """At least half of the height is map, in a low window all of it; nothing is cut off, and all can be reached."""
    assert page.evaluate(SHARE) >= (1.0 if size in LOW else 0.3)
    assert overflow(page) == (0, 0)
    assert page.evaluate(UNREACHED) == []


@pytest.mark.parametrize("size", SIZES)
def test_the_live_page_keeps_its_map(browser: Any, size: tuple[int, int]) -> None:
    with served(Mailbox(seven_floors(), "A walk", replay=False)) as (server, mailbox):
        mailbox.set_team(("Anna", "Christopher"))
        mailbox.publish(scene())
        page = opened(browser, server.url, size, READY)
        boxes, heights, found = set(), set(), list[str]()
        for moment in moments():
            mailbox.publish(moment)
            wait_for(page, f"echostep.last.t_s === {moment.t_s}")
            boxes.add(page.evaluate(BOX))
            heights.add(page.evaluate(HEADER))
            if moment.alarm:
                assert page.evaluate("document.querySelector('#fine').getBoundingClientRect().bottom <= innerHeight")
            else:
                check(page, size)
            found += violations(page)
        assert len(boxes) == 1
        assert len(heights) == 1 or size == LOW[1]  # there it scrolls beside the map, in the width of a word or two
        assert found == []
        assert not page.wrong


@pytest.mark.parametrize("size", SIZES)
def test_the_commanders_page_keeps_its_map(browser: Any, size: tuple[int, int]) -> None:
    team = whole_team()
    with ServedTeam(team) as table, opened(browser, table.page.url, size, TABLE_READY) as page:
        boxes = {page.evaluate(BOX)}
        check(page, size)
        table.show(connected=False)
        wait_for(page, "document.querySelector('#words').dataset.status === 'broken'")
        boxes.add(page.evaluate(BOX))
        team.put_bytes("echostep/red/nobody/estimate", b"no report")
        team.hear("Dana", place(TOWER, 12.0, 2.0, 2), alarm=ReportedAlarm("mayday", "fall", 1, 14.0))
        table.show()
        wait_for(page, "!document.querySelector('#mayday').hidden && !document.querySelector('#refused').hidden")
        boxes.add(page.evaluate(BOX))
        page.click("#invitation")
        check(page, size)
        page.click("#mayday-open")
        wait_for(page, "document.querySelectorAll('#rescuers li').length === 3")
        check(page, size)
        assert violations(page) == []
        boxes.add(page.evaluate(BOX))
        assert len(boxes) == 1
        assert not page.wrong
