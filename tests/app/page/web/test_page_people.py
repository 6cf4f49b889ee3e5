# SPDX-License-Identifier: MIT
"""A newcomer and a responder each visit the wearer's page in Chromium, in four windows at once, on the demo's plan and on seven floors."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from echostep.plan import Plan
from page.browser import HELD_MS, READY, loaded_page, overflow, violations, wait_for
from page.web.test_page_sizes import SIZES
from page.web.test_page_visit import PLACES, Visit
from waiting import until

Look = Callable[[str], None]


@contextmanager
def windows(browser: Any, url: str) -> Iterator[tuple[list[Any], Look]]:
    """A page of each size, and `look`, which checks all of them by axe and takes their pictures; what goes wrong on them fails the test."""
    pages = [loaded_page(browser, url, {"viewport": {"width": w, "height": h}}, READY) for w, h in SIZES]

    def look(moment: str) -> None:
        for (width, _), page in zip(SIZES, pages, strict=True):
            found = violations(page)
            assert found == [], f"{width}, {moment}"
            assert overflow(page) == (0, 0), f"{width}, {moment}"

    yield pages, look
    for page in pages:
        assert not page.wrong
        assert page.is_hidden("#fault")


def legend(page: Any) -> None:
    """Open the legend and close it by its key."""
    page.click("#legend-button")
    wait_for(page, "document.querySelector('dialog[open]').innerText.includes('tairs')")
    page.keyboard.press("Escape")
    wait_for(page, "!document.querySelector('dialog[open]')")


@pytest.mark.long
@pytest.mark.parametrize("name", PLACES)
def test_a_newcomer_looks_around(browser: Any, name: str) -> None:
    """Reads where the wearer is, turns and zooms the map, tries legend, tap, other floors and colours: nothing of that moves the estimate."""
    spot = PLACES[name]
    visit = Visit(spot)
    with visit.page:
        visit.walk(0.5)
        with windows(browser, visit.page.url) as (pages, look):
            look("0-arrives")
            before = visit.estimates[-1]
            for page in pages:
                wait_for(page, "document.querySelector('#status-text').textContent.startsWith('tracking, ')")
                assert spot.said[0].split(",")[0].rstrip(".").lower() in page.inner_text("#place").lower()
                legend(page)
                page.click("#closer")
                page.click("#north")
                page.mouse.click(*middle(page))
                wait_for(page, "document.querySelector('#sheet-text').textContent")
                page.click("#sheet-close")
                other_floor(page, spot.plan)
                page.click("#whole")
                page.click("#tools-button")
                page.select_option("#theme", "dark")
                page.keyboard.press("Escape")
            look("1-dark")
            visit.walk(0.5)
            for page in pages:
                page.click("#follow")
                wait_for(
                    page,
                    f"echostep.scene.frame.told.x_m === {visit.estimates[-1].x_m!r} && echostep.scene.level === {before.level}",
                )
            assert visit.hear(undone=0, check_ins=0)


def middle(page: Any) -> tuple[float, float]:
    box = page.locator("#map").bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def other_floor(page: Any, plan: Plan) -> None:
    """Go to the last floor, by button or list; a plan of one floor has neither."""
    last = len(plan.levels) - 1
    if not last:
        assert page.is_hidden("#floors")
        return
    if page.is_visible("#floor"):
        page.select_option("#floor", str(last))
    else:
        page.click(f"#floors button:nth-child({last + 1})")
    wait_for(page, f"echostep.scene.level === {last}")


@pytest.mark.long
@pytest.mark.parametrize("name", PLACES)
def test_a_responder_is_guided_and_calls(browser: Any, name: str) -> None:
    """Goes to a room; is sent to one in distress by a commander; calls for help, and is all right again: on every window."""
    spot = PLACES[name]
    visit = Visit(spot)
    with visit.page:
        visit.walk(0.5)
        with windows(browser, visit.page.url) as (pages, look):
            pages[2].select_option("#goal", label=spot.room)  # a phone held sideways
            for page in pages:
                wait_for(page, "echostep.last.guidance?.own && echostep.last.guidance.path.length > 1")
                assert page.is_visible("#cue")
            x_m, y_m = spot.wrong
            visit.page.set_errand(x_m, y_m, visit.estimates[-1].level, "Ben sends you to Finn, in distress")
            for page in pages:
                wait_for(
                    page, f"echostep.last.goal?.x_m === {x_m} && echostep.last.guidance?.path.at(-1)?.[0] === {x_m}"
                )
                assert page.inner_text("#errand") == "Ben sends you to Finn, in distress"
            look("1-sent")
            pages[3].evaluate("() => { window.said = []; speechSynthesis.speak = ({ text }) => said.push(text); }")
            pages[3].click("#help", delay=HELD_MS)  # at 400 %
            assert until(lambda: called(visit, "mayday"))
            visit.walk(0.1)
            for page in pages:
                wait_for(
                    page, "document.querySelector('#alarm-text').textContent.startsWith('Mayday: you asked for help.')"
                )
            wait_for(pages[3], "said.some((text) => text.startsWith('Mayday.'))")  # although speech is off
            look("2-mayday")
            pages[1].click("#fine")
            assert until(lambda: called(visit, "over"))
            visit.walk(0.1)
            for page in pages:
                wait_for(page, "document.querySelector('#alarm-text').textContent === 'The mayday is over.'")


def called(visit: Visit, kind: str) -> bool:
    visit.hear(undone=0, check_ins=0)
    alarm = visit.tracker.watch.alarm
    return alarm is not None and alarm.kind == kind
