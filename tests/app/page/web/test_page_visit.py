# SPDX-License-Identifier: MIT
"""A whole visit in Chromium: watch, tap wrongly, undo; on seven floors, on a desk and on a phone.

Two pages of one run are open, 1280 px and 360 px wide; one of them acts, the other must agree. The walk goes on when the test says so.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import pytest

from echostep.localization import Estimate
from echostep.ports.chunks import Chunk, portion_of
from echostep.ports.people.check_in import PERSON
from echostep.tracker import Tracker
from echostep_app.page.live import LivePage
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import Scenario
from page.browser import PHONE, READY, loaded_page, spot, wait_for
from page.frames import LOCAL
from plan.imported_plans import seven_floors
from waiting import until

SIZES: dict[str, dict[str, Any]] = {"desk": {"viewport": {"width": 1280, "height": 800}}, "phone": PHONE}
SHEET = "document.querySelector('#sheet-text').textContent"
PORTION = 200  # chunks that are tracked together


HOUSE, WAY = seven_floors(), ((1.0, 7.0), (12.0, 7.0), (12.0, 9.0))
WALL, WRONG = (5.0, 6.0), (12.0, 3.0)  # a place in a wall, and one in a store beside the corridor


class Visit:
    """A run whose walk goes on by `walk`; check-ins of the page are taken by `hear`. Keeps all chunks, as a recording does."""

    def __init__(self) -> None:
        scenario = Scenario(HOUSE, WAY, 5, PythonBoard(seed=5))
        self._coming = list(scenario.chunks())
        self.kept: list[Chunk] = []
        self.tracker = Tracker(HOUSE, scenario.start, seed=1)
        self.page = LivePage(self.tracker, "A visit", LOCAL)
        self.estimates: list[Estimate] = []

    def walk(self, share: float) -> None:
        """Walk on for a share of the whole way."""
        count = int(share * (len(self._coming) + len(self.kept)))
        for k in range(0, count, PORTION):
            self._take(self._coming[k : min(k + PORTION, count)])
        self._coming = self._coming[count:]

    def hear(self, *, undone: int, check_ins: int) -> bool:
        """Take what the pages ask for; whether there were so many check-ins and undoings by now."""
        for payload in self.page.pop_check_ins():
            self._take([Chunk(PERSON, self.kept[-1].t_arrival_ns, payload)])
        state = self.tracker.state
        return (state.undone, state.check_ins) == (undone, check_ins)

    def _take(self, chunks: list[Chunk]) -> None:
        self.kept += chunks
        self.page.note_arrival()
        self.estimates += self.tracker.take(portion_of(chunks))
        self.page.publish(portion_of(chunks))


@contextmanager
def pages(browser: Any, url: str) -> Iterator[dict[str, Any]]:
    """A page of each size; whatever goes wrong on them fails the test."""
    with ExitStack() as opened:
        found = {}
        for size, how in SIZES.items():
            found[size] = loaded_page(browser, url, how, READY)
            opened.callback(found[size].context.close)
        yield found
        for page in found.values():
            assert not page.wrong
            assert page.text_content("#fault") == ""


def tap(page: Any, place: tuple[float, float]) -> None:
    page.mouse.click(*spot(page, *place))


def at(page: Any) -> tuple[float, float]:
    x, y = page.evaluate("[echostep.scene.frame.told.x_m, echostep.scene.frame.told.y_m]")
    return x, y


def tap_wrongly(visit: Visit, actor: Any, other: Any) -> None:
    """In a wall: the nearest place is offered. In a wrong room: it is said where that is, done, and undone without a trace."""
    before = at(actor)
    actor.click("#here")
    tap(actor, WALL)
    wait_for(actor, f"{SHEET}.startsWith('Nobody can stand there: it is inside a wall.')")
    actor.click("#sheet-close")
    actor.click("#here")
    tap(actor, WRONG)
    wait_for(actor, f"{SHEET}.includes('In Store 104, Ground floor.') && {SHEET}.includes('are you sure?')")
    actor.click("#sheet-here")
    assert until(lambda: visit.hear(undone=0, check_ins=1))
    for page in (actor, other):
        wait_for(page, "!document.querySelector('#undo').hidden")
        wait_for(
            page,
            f"Math.hypot(echostep.scene.frame.told.x_m - {WRONG[0]}, echostep.scene.frame.told.y_m - {WRONG[1]}) < 0.7",
        )
    actor.click("#undo-button")
    assert until(lambda: visit.hear(undone=1, check_ins=1))
    for page in (actor, other):
        wait_for(
            page, f"echostep.scene.frame.told.x_m === {before[0]} && echostep.scene.frame.told.y_m === {before[1]}"
        )
        wait_for(page, "document.querySelector('#undo').hidden")


@pytest.mark.long
@pytest.mark.parametrize("acting", SIZES)
def test_a_whole_visit(browser: Any, acting: str) -> None:
    visit = Visit()
    with visit.page, ExitStack() as stack:
        visit.walk(0.5)
        opened = stack.enter_context(pages(browser, visit.page.url))
        actor, (other,) = opened[acting], [page for size, page in opened.items() if size != acting]
        wait_for(actor, "document.querySelector('#place').textContent.startsWith('in Corridor, Ground floor')")
        tap_wrongly(visit, actor, other)
        visit.walk(0.5)
        wait_for(actor, f"echostep.scene.frame.told.y_m === {visit.estimates[-1].y_m!r}")
