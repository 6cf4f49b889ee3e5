# SPDX-License-Identifier: MIT
"""An officer on the commander's page in Chromium: with a list of twenty; with four wearers and two outages."""

from __future__ import annotations

import json
import time
from typing import Any

from echostep_app.team.messages.orders import EVERYBODY, Receipt, receipt_message
from echostep_app.team.messages.report import ReportedAlarm
from operation.crowd import walking
from operation.teams import STOREYS, TOWER, ServedTeam, Team
from operation.test_table_page import WIDE, WORDS
from page.browser import FRAMED, HELD_MS, TABLE_READY, loaded_page, spot, violations, wait_for
from page.outage import Wire
from page.web.test_page_silence import OUTBOX, STATUS
from page.web.test_page_sizes import SIZES, UNREACHED
from waiting import until

STEP_S = 5.0
NAMES = "[...document.querySelectorAll('#list .name')].map((e) => e.textContent)"
EVERYBODY_TEXT = "document.querySelector('#everybody-text').textContent"
HINT = "document.querySelector('#hint').textContent"
SHOWN = "echostep.storeys.shown"
OVER_EACH_OTHER = f"""{SHOWN}.every(({{ place, at: [, y] }}) => {SHOWN}.every((other) => other.place.level <= place.level || other.at[1] < y))"""
IS_FITTED = """(() => {
    const map = document.querySelector('#map'), same = (one, other) => Math.abs(one - other) < 1, { view, storeys } = echostep;
    return same(view.width, map.clientWidth) && same(view.height, map.clientHeight)
        && storeys.floors.every(({ view: { height, middle: [, y] } }) => same(height, map.clientHeight) && y > 0 && y < height);
})()"""
ON_PAGE = """([x, y]) => { const box = document.querySelector('#map').getBoundingClientRect(); return [box.x + x, box.y + y]; }"""


def crowd(wearers: int) -> Team:
    team = Team(now_s=0.0)
    for n in range(wearers):
        team.hear(f"wearer {n:02d}", walking(n, 0.0, n % STOREYS))
    return team


def shown(page: Any, expression: str, wanted: list[str]) -> None:
    """Wait until a list on the page is as wanted."""
    wait_for(page, f"JSON.stringify({expression}) === {json.dumps(json.dumps(wanted, separators=(',', ':')))}")


def test_a_list_of_twenty_is_sorted_and_looked_through(browser: Any) -> None:
    """Calls for help stay on top; a place has coordinates, and a distance to a second one."""
    team = crowd(20)
    team.hear("wearer 13", walking(13, 0.0, 1), alarm=ReportedAlarm("mayday", "fall", 1, 14.0))
    with ServedTeam(team) as served, loaded_page(browser, served.page.url, WIDE, TABLE_READY) as page:
        page.select_option("#sort", "floor")
        floors = f"{WORDS}.map((text) => text.match(/(Ground|1st|2nd) floor/)?.[1])"
        shown(page, floors, ["1st", *["2nd"] * 6, *["1st"] * 6, *["Ground"] * 7])
        page.select_option("#sort", "name")
        shown(page, NAMES, ["wearer 13", *(f"wearer {n:02d}" for n in range(20) if n != 13)])
        page.fill("#find", "r 07")
        shown(page, NAMES, ["wearer 13", "wearer 07"])
        team.pass_time(1.0)
        served.show()
        wait_for(page, "echostep.last.unix_s > 1800000000")
        assert page.evaluate(NAMES) == ["wearer 13", "wearer 07"]
        page.fill("#find", "")
        wait_for(page, f"{NAMES}.length === 20")
        page.evaluate(f"(echostep.view.zoom(0.5), {FRAMED})")
        x_m, y_m = TOWER.levels[0].rooms[0].at_m
        page.mouse.click(*spot(page, x_m + 2.0, y_m))
        wait_for(
            page, f"document.querySelector('#sheet-text').textContent.includes('x {x_m + 2.0:.1f}, y {y_m:.1f} m')"
        )
        page.click("#measure")
        wait_for(page, f"{HINT} === 'Tap the second place.'")
        page.mouse.click(*spot(page, x_m + 2.0, y_m + 3.0))
        wait_for(page, f"/^Distance: (2.9|3.0|3.1)/.test({HINT})")
        assert page.is_hidden("#sheet")
        assert not page.wrong


def test_all_storeys_feet_and_the_log(browser: Any) -> None:
    """Each storey has its wearers in the order of the heights, at every size; a tap leads to one; a note is for all commanders, as it was written."""
    team = crowd(6)
    team.unix_s = time.time()
    place_words = "document.querySelector('#list .said').textContent"
    with ServedTeam(team) as served, loaded_page(browser, served.page.url, WIDE, TABLE_READY) as page:
        served.page.feed.send = lambda *message: team.put_bytes(*message) or True  # type: ignore[func-returns-value]
        page.focus("#map")
        page.keyboard.press("v")
        wait_for(page, f"document.querySelector('#map.stacked') && {SHOWN}.length === 6")
        for width, height in SIZES:
            page.set_viewport_size({"width": width, "height": height})
            wait_for(page, f"{IS_FITTED} && {OVER_EACH_OTHER}")
            assert (page.evaluate(UNREACHED), violations(page)) == ([], [])
        page.set_viewport_size(WIDE["viewport"])
        wait_for(page, f"{IS_FITTED} && {OVER_EACH_OTHER}")
        x, y = page.evaluate(f"{SHOWN}.find((row) => row.place.level === 2).at")
        page.mouse.click(*page.evaluate(ON_PAGE, [x, y + 40]))
        wait_for(page, "!document.querySelector('#map.stacked') && echostep.scene.level === 2")
        page.click("#all-floors")
        wait_for(page, f"document.querySelector('#map.stacked') && echostep.storeys.stamp && {OVER_EACH_OTHER}")
        page.mouse.click(*page.evaluate(ON_PAGE, page.evaluate(f"{SHOWN}.find((row) => row.place.level === 1).at")))
        wait_for(page, "echostep.scene.chosen !== null && echostep.scene.level === 1")
        page.click("#legend-button")
        page.select_option("#unit", "ft")
        page.keyboard.press("Escape")
        wait_for(page, "[...document.querySelectorAll('#facts dd')].some((e) => / ft$/.test(e.textContent))")
        page.click("#close")
        wait_for(page, f"/within .* ft/.test({place_words})")
        assert not page.evaluate(f"/\\d m\\b/.test({place_words})")
        page.fill("#me", "Ann")
        page.click("#log summary")
        page.fill("#log-note", "cleared, 12 m of smoke")
        page.keyboard.press("Enter")
        assert until(lambda: bool(team.scene().log))
        served.show()
        wait_for(page, "/Ann: cleared, 12 m of smoke$/.test(document.querySelector('#log-list').innerText)")
        assert (page.evaluate(UNREACHED), violations(page)) == ([], [])
        assert not page.wrong


class Visit:
    """An officer's page behind a wire; what the page asks for comes back from the broker while there is one."""

    def __init__(self, served: ServedTeam, page: Any, wearers: int) -> None:
        self.page, self.sent = page, list[str]()
        self._served, self._team, self._wearers, self._waiting = served, served.team, wearers, list[tuple[str, bytes]]()
        self._connected, self._begun_s = True, served.team.now_s
        self._fields: dict[int, dict[str, Any]] = {}
        served.page.feed.send = self._send

    def _send(self, topic: str, payload: bytes) -> bool:
        self._waiting.append((topic, payload))
        return True

    def show(self) -> None:
        while self._connected and self._waiting:
            topic, payload = self._waiting.pop(0)
            self.sent.append(topic)
            self._team.put_bytes(topic, payload)
        self._served.show(connected=self._connected, waiting=len(self._waiting))
        self._served.page.feed.exchange.note_alive()

    def until(self, holds: str) -> None:
        def shown() -> bool:
            self.show()
            return bool(self.page.evaluate(holds))

        assert until(shown), (holds, self.page.evaluate(WORDS))

    def pass_time(self, seconds: float) -> None:
        """All wearers walk, and report while there is a broker."""
        for _ in range(round(seconds / STEP_S)):
            self._team.pass_time(STEP_S)
            t_s = self._team.now_s - self._begun_s
            for n in range(self._wearers if self._connected else 0):
                self._team.hear(f"wearer {n:02d}", walking(n, t_s, n % STOREYS), **self._fields.get(n, {}))
            self.show()

    def call(self, n: int, number: int) -> None:
        """Wearer n asks for help from now on; `number`: of the alarm."""
        self._fields[n] = {"alarm": ReportedAlarm("mayday", "help", number, 1.0)}

    def is_well(self, n: int) -> None:
        self._fields.pop(n)

    def understood(self, n: int) -> None:
        """Wearer n taps that the order to everybody is understood."""
        order, name = self._team.scene().order, f"wearer {n:02d}"
        assert order
        self._team.put_bytes(
            *receipt_message((EVERYBODY, "red", name), Receipt(1, order.unix_s, name, self._team.unix_s))
        )

    def broker(self, *, there: bool) -> None:
        self._connected = there
        self.show()


def test_an_officer_with_four_wearers_and_two_outages(browser: Any) -> None:
    """Watches; loses the wire while one calls for help; answers; loses the broker; orders everybody out; all answer."""
    wearers, part_s = 4, 10.0
    caller = wearers - 1
    name = f"wearer {caller:02d}"
    with ServedTeam(crowd(wearers)) as served, Wire(served.page.url) as wire:
        page = loaded_page(browser, wire.url, WIDE, TABLE_READY)
        visit = Visit(served, page, wearers)
        visit.pass_time(part_s)
        visit.until(f"{STATUS} === 'connected' && echostep.scene.rows.length === {wearers}")
        page.fill("#me", "Ann")
        wire.freeze()  # the first outage: one calls for help behind it
        visit.call(caller, 1)
        visit.pass_time(part_s)
        wait_for(page, "document.body.dataset.silent === 'present'")
        assert page.inner_text("#status-text").startswith("no news for ")
        wire.mend()
        visit.until(
            f"!document.body.dataset.silent && document.querySelector('#mayday-text').textContent.includes('{name}')"
        )
        page.click("#mayday-open")
        visit.until(
            "document.querySelectorAll('#rescuers li').length === 3 || document.querySelectorAll('#list li').length < 4"
        )
        page.click("#rescuers li:first-child button")
        page.click("#acknowledge")
        visit.until("document.querySelector('#acknowledge').hidden && document.body.dataset.alarm === 'false'")
        visit.pass_time(part_s)
        visit.broker(there=False)  # the second one: orders wait, and nobody is heard
        visit.pass_time(part_s)
        visit.until(f"{STATUS} === 'no broker: the last known state'")
        page.click("#close")
        visit.until("![...document.querySelectorAll('#list .said')].some((e) => e.textContent.includes('heard now'))")
        page.click("#out", delay=HELD_MS)
        visit.until(f"{OUTBOX}.includes('Requests that wait for the broker: 1')")
        assert page.is_hidden("#everybody")  # it is not said before the broker has it
        visit.broker(there=True)
        visit.is_well(caller)
        visit.until(f"{EVERYBODY_TEXT}.includes('understood by 0 of {wearers}')")
        visit.pass_time(part_s)
        for n in range(wearers - 1):
            visit.understood(n)
        visit.until(
            f"{EVERYBODY_TEXT}.endsWith('understood by {wearers - 1} of {wearers}. not understood yet: {name}')"
        )
        visit.understood(caller)
        visit.until(f"{EVERYBODY_TEXT}.endsWith('understood by {wearers} of {wearers}')")
        page.click("#everybody-end")
        visit.until("document.querySelector('#everybody').hidden")
        visit.pass_time(part_s)
        kinds = [topic.split("/")[1] for topic in visit.sent]
        assert kinds == ["errand", "ack", "order", "order"]  # each once
        assert not [wrong for wrong in page.wrong if "WebSocket" not in wrong]
