# SPDX-License-Identifier: MIT
"""A whole visit in Chromium: watch, tap wrongly, undo, go to a room, replay; on the demo's plan and on seven floors, on a desk and on a phone.

Two pages of one run are open, 1280 px and 360 px wide; one of them acts, the other must agree. The walk goes on when the test says so.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any, NamedTuple

import pytest

from echostep.localization import Estimate, digest
from echostep.plan import Plan, Pose
from echostep.ports.chunks import Chunk, portion_of
from echostep.ports.people.check_in import PERSON
from echostep.tracker import Tracker
from echostep_app.page.live import LivePage
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import Scenario
from page.browser import LOCAL, PHONE, PLAN, READY, loaded_page, spot, wait_for
from plan.imported_plans import seven_floors
from waiting import until

SIZES: dict[str, dict[str, Any]] = {"desk": {"viewport": {"width": 1280, "height": 800}}, "phone": PHONE}
TEXT = "document.querySelector('{}').textContent"
SHEET, CUE = TEXT.format("#sheet-text"), TEXT.format("#cue")
PORTION = 200  # chunks that are tracked together


class Place(NamedTuple):
    """A plan, a short walk on it, a place in a wall, a wrong place, a room to go to, and what the page says about them."""

    plan: Plan
    way: Sequence[tuple[float, float]]
    wall: tuple[float, float]
    wrong: tuple[float, float]
    room: str
    said: tuple[str, str]


PLACES = {
    "demo": Place(
        PLAN, ((2.0, 7.5), (9.5, 7.5), (9.5, 10.8)), (5.0, 6.5), (13.0, 2.0), "Meeting",
        ("In North corridor.", "In South corridor."),
    ),
    "seven floors": Place(
        seven_floors(), ((1.0, 7.0), (12.0, 7.0), (12.0, 9.0)), (5.0, 6.0), (12.0, 3.0), "Office 301 (Second floor)",
        ("In Corridor, Ground floor.", "In Store 104, Ground floor."),
    ),
}  # fmt: skip


class Visit:
    """A run whose walk goes on by `walk`; check-ins of the page are taken by `hear`. Keeps all chunks, as a recording does."""

    def __init__(self, place: Place) -> None:
        scenario = Scenario(place.plan, place.way, 5, PythonBoard(seed=5))
        self._coming = list(scenario.chunks())
        self.start: Pose = scenario.start
        self.kept: list[Chunk] = []
        self.tracker = Tracker(place.plan, self.start, seed=1)
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


def tap_wrongly(visit: Visit, place: Place, actor: Any, other: Any) -> None:
    """In a wall: the nearest place is offered. In a wrong room: it is said where that is, done, and undone without a trace."""
    before = at(actor)
    actor.click("#here")
    tap(actor, place.wall)
    wait_for(actor, f"{SHEET}.startsWith('Nobody can stand there: it is inside a wall.')")
    actor.click("#sheet-close")
    actor.click("#here")
    tap(actor, place.wrong)
    wait_for(actor, f"{SHEET}.includes('{place.said[1]}') && {SHEET}.includes('are you sure?')")
    actor.click("#sheet-here")
    assert until(lambda: visit.hear(undone=0, check_ins=1))
    for page in (actor, other):
        wait_for(page, "!document.querySelector('#undo').hidden")
        wait_for(
            page,
            f"Math.hypot(echostep.scene.frame.told.x_m - {place.wrong[0]}, echostep.scene.frame.told.y_m - {place.wrong[1]}) < 0.7",
        )
    actor.click("#undo-button")
    assert until(lambda: visit.hear(undone=1, check_ins=1))
    for page in (actor, other):
        wait_for(
            page, f"echostep.scene.frame.told.x_m === {before[0]} && echostep.scene.frame.told.y_m === {before[1]}"
        )
        wait_for(page, "document.querySelector('#undo').hidden")


def go_to_a_room(place: Place, actor: Any, other: Any) -> None:
    """Chosen on one page, shown by both, and still there after the connection was lost."""
    actor.select_option("#goal", label=place.room)
    for page in (actor, other):
        wait_for(page, "echostep.last.guidance?.own && echostep.last.guidance.kind !== 'looking'")
        wait_for(page, "echostep.last.guidance.path.length > 1")
        assert page.evaluate("document.querySelector('#goal').selectedOptions[0].text") == place.room
    cue = actor.evaluate(CUE)
    reconnected(actor)
    wait_for(actor, f"document.querySelector('#status-text').textContent !== 'not connected' && {CUE} === '{cue}'")
    assert actor.evaluate("document.querySelector('#goal').selectedOptions[0].text") == place.room


def reconnected(page: Any) -> None:
    """Lose the connection until the page has said so, then let it return."""
    page.evaluate("echostep.link.wait = 1e9, echostep.link.socket.close()")
    wait_for(page, "document.querySelector('#status-text').textContent === 'not connected'")
    page.evaluate("echostep.last = null, echostep.link.open()")
    wait_for(page, "echostep.last")


def replay(browser: Any, visit: Visit, place: Place, acting: str) -> None:
    """The recording gives the same estimates bit for bit; position and speed survive a lost connection."""
    tracker = Tracker(place.plan, visit.start, seed=1)
    with LivePage(tracker, "A replay of the visit", LOCAL, replay=True) as replay_page:
        portion = portion_of(visit.kept)
        found = tracker.take(portion)
        replay_page.publish(portion)
        assert digest(found) == digest(visit.estimates)
        with pages(browser, replay_page.url) as opened:
            page = opened[acting]
            page.select_option("#times", "4")
            page.click("#play")
            wait_for(page, "!echostep.scene.frame.play.playing && echostep.scene.frame.play.times === 4")
            page.locator("#time").fill("6")
            wait_for(page, "Math.abs(echostep.last.play.t_s - 6) < 0.1")
            reconnected(page)
            wait_for(page, "Math.abs(echostep.last.play.t_s - 6) < 0.1")
            wait_for(page, "!echostep.last.play.playing && echostep.last.play.times === 4")


@pytest.mark.long
@pytest.mark.parametrize(("name", "acting"), list(zip(PLACES, SIZES, strict=True)))
def test_a_whole_visit(browser: Any, name: str, acting: str) -> None:
    place = PLACES[name]
    visit = Visit(place)
    with visit.page, ExitStack() as stack:
        visit.walk(0.5)
        opened = stack.enter_context(pages(browser, visit.page.url))
        actor, (other,) = opened[acting], [page for size, page in opened.items() if size != acting]

        wait_for(
            actor,
            f"document.querySelector('#place').textContent.startsWith('{place.said[0].rstrip('.').replace('In ', 'in ')}')",
        )
        tap_wrongly(visit, place, actor, other)
        go_to_a_room(place, actor, other)
        visit.walk(0.5)
        wait_for(actor, f"echostep.scene.frame.told.y_m === {visit.estimates[-1].y_m!r}")
    replay(browser, visit, place, acting)
