# SPDX-License-Identifier: MIT
"""A browser on the live page of the demo's walk, tracked in a thread at any multiple of real time.

With ECHOSTEP_PICTURES=1 the pictures of the manual are made anew.
"""

from __future__ import annotations

import os
import threading
import time
from functools import cache
from pathlib import Path
from typing import Any

from board_runs import ROOT
from echostep.foot.steps import Step
from echostep.localization import Estimate, Start
from echostep.path import PathSegment
from echostep.plan import Pose
from echostep.ports.chunks import Chunk, portion_of
from echostep.tracker import Tracker
from echostep_app.guidance.guided_run import GuidedRun
from echostep_app.page.live import LivePage
from echostep_app.plan.routing import RoutePlace
from echostep_simulation.devices.beacon_gateway import with_beacons
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import START_NS, demo_scenario
from page.frames import LOCAL
from waiting import PATIENCE_S, until
from walks import PLAN

PICTURES = ROOT / "host/pictures" if os.environ.get("ECHOSTEP_PICTURES") else None
HELD_MS = 1200  # for which a button is held that a brush must not press
SKIPPED = 500  # chunks in a portion before the page is opened
SHOWN = (  # for the error of a test
    "[window.echostep?.scene?.frame && { ...echostep.scene.frame, beams: 0, trail: 0, cloud: 0 }, document.body.innerText]"
)
NAMES = "[...document.querySelectorAll('#rooms .room')].filter((e) => e.getAttribute('visibility') === 'visible').map((e) => e.textContent)"
SETTLED = """(() => {
    const map = document.querySelector('#map'), { view } = echostep;
    return Math.abs(view.width - map.clientWidth) < 1 && Math.abs(view.height - map.clientHeight) < 1;
})()"""  # the view has the size of the map
READY = f"window.echostep?.last?.told && document.querySelector('#walls path') && {SETTLED}"  # an estimate and a floor are drawn
TABLE_READY = "window.echostep?.last && document.querySelector('#walls path') && document.querySelectorAll('#list li').length"  # a commander's
FRAMED = "new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)))"  # after two frames
SPOT = f"""([x_m, y_m]) => {{
    const {{ left, top }} = document.querySelector('#map').getBoundingClientRect(), [x, y] = echostep.view.toScreen(x_m, y_m);
    return {SETTLED} && [left + x, top + y];
}}"""
PHONE = {"viewport": {"width": 360, "height": 640}, "has_touch": True, "is_mobile": True, "device_scale_factor": 2}
DESK = {"viewport": {"width": 1100, "height": 640}}
LOOKS: dict[str, dict[str, Any]] = {
    "bright": {**PHONE, "color_scheme": "light"},
    "dark": {**DESK, "color_scheme": "dark"},
    "contrast": {**PHONE, "contrast": "more"},
}


@cache
def demo_walk(*, beacons: bool) -> tuple[Pose, list[Chunk]]:
    """Where the demo's walk begins, and its chunks."""
    scenario = demo_scenario(PLAN, 1, PythonBoard(seed=1))
    return scenario.start, list(with_beacons(scenario, PLAN, 1) if beacons else scenario.chunks())


class Walk:
    """The demo's walk, tracked in a thread of its own at so many times real time, as a run does it; `guide`: with beacons, to a place.

    `start`: what the tracker is told of the start, where it is not the true one. `stands`: the walk goes on with `go_on` only.
    """

    def __init__(
        self,
        begin_s: float,
        pace: float,
        guide: RoutePlace | None = None,
        start: Start | None = None,
        *,
        stands: bool = False,
    ) -> None:
        true_start, self._chunks = demo_walk(beacons=guide is not None)
        self._first_ns = self._chunks[0].t_arrival_ns
        self._tracker = Tracker(PLAN, start or true_start, seed=1)
        self._pace = pace
        self._stop = threading.Event()
        self._goes = threading.Event()
        if not stands:
            self._goes.set()
        guided = GuidedRun(self._tracker, guide) if guide else None
        self.page = LivePage(self._tracker, "A simulated walk", LOCAL, guided)
        self._begin = sum(chunk.t_arrival_ns - self._first_ns < begin_s * 1e9 for chunk in self._chunks)
        self._thread = threading.Thread(target=self._run, daemon=True)
        self.checked_in: list[Estimate] = []  # the estimate that each check-in gave
        self.told_s: list[float] = []  # for each step, how long after the landing its bytes had come
        told = self._tracker.front_end.path.add_step

        def step(landed: Step) -> list[PathSegment]:
            self.told_s.append(self._now_s - landed.t_end_s)
            return told(landed)

        self._tracker.front_end.path.add_step = step  # type: ignore[assignment, method-assign]

    def __enter__(self) -> Walk:
        self.page.__enter__()
        for begin in range(0, self._begin, SKIPPED):
            self._take(self._chunks[begin : min(begin + SKIPPED, self._begin)])
        self.told_s.clear()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._goes.set()
        self._thread.join()
        self.page.__exit__(None, None, None)

    def go_on(self) -> None:
        """Let a walk that stands go on."""
        self._goes.set()

    def _run(self) -> None:
        """Take the chunks at the walk's pace, and the check-ins of the pages, these beyond the end of the walk too."""
        self._goes.wait()
        began, t_ns = time.monotonic(), self._chunks[self._begin].t_arrival_ns
        first_ns = t_ns
        for chunk in self._chunks[self._begin :]:
            t_ns = chunk.t_arrival_ns
            ahead_s = (t_ns - first_ns) * 1e-9 / self._pace - (time.monotonic() - began)
            if self._stop.wait(max(ahead_s, 0.0)):
                return
            self._take_check_ins(t_ns)
            self._take([chunk])
        while not self._stop.wait(0.01):
            self._take_check_ins(t_ns)

    def _take_check_ins(self, t_ns: int) -> None:
        for said in self.page.pop_check_ins():
            self.checked_in += self._take([Chunk("person", t_ns, said)])

    def _take(self, chunks: list[Chunk]) -> list[Estimate]:
        self._now_s = (chunks[-1].t_arrival_ns - START_NS) * 1e-9
        portion = portion_of(chunks)
        self.page.note_arrival()
        estimates = self._tracker.take(portion)
        self.page.publish(portion)
        return estimates


def looking(browser: Any, url: str, look: str) -> Any:
    """A page with an estimate, a floor and names that are drawn."""
    return loaded_page(browser, url, LOOKS[look], READY)


def loaded_page(browser: Any, url: str, how: dict[str, Any], ready: str, script: str = "") -> Any:
    """A page of its own context at a URL, once it is ready; faults and errors on its console are in `wrong`. `script` runs before its own."""
    page = opened_page(browser, **how)
    page.add_init_script(script)
    page.wrong = []
    page.on("pageerror", lambda error: page.wrong.append(str(error)))
    page.on("console", lambda said: page.wrong.append(said.text) if said.type == "error" else None)
    page.goto(url)
    wait_for(page, ready)
    return page


def violations(page: Any, **options: Any) -> list[str]:
    """What axe finds on a page: the rule and the first element of each."""
    from axe_playwright_python.sync_playwright import Axe  # type: ignore[import-untyped]

    return [
        f"{found['id']}: {found['nodes'][0]['html']}" for found in Axe().run(page, **options).response["violations"]
    ]


def overflow(page: Any) -> tuple[int, int]:
    """How many pixels a page is wider than its window, and how many of its controls reach beyond the right edge."""
    wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
    cut = page.evaluate(
        "[...document.querySelectorAll('button, select, input')].filter((e) => e.offsetParent && e.getBoundingClientRect().right > innerWidth).length"
    )
    return wide, cut


def opened_page(browser: Any, **how: Any) -> Any:
    """A page of its own context, which is patient."""
    page = browser.new_context(**how).new_page()
    page.set_default_timeout(1e3 * PATIENCE_S)
    return page


def spot(page: Any, x_m: float, y_m: float) -> tuple[float, float]:
    """The pixel of the page at a place, once the view has the size of the map."""
    found: list[list[float]] = []

    def is_settled() -> bool:
        found.append(page.evaluate(SPOT, [x_m, y_m]))
        return bool(found[-1])

    assert until(is_settled), page.evaluate(SHOWN)
    return found[-1][0], found[-1][1]


def wait_for(page: Any, holds: str) -> None:
    """Until an expression holds (the page's own policy forbids Playwright's waiting)."""
    assert until(lambda: bool(page.evaluate(holds))), f"{holds}: {page.evaluate(SHOWN)}"


def painted(page: Any, colour: str, x_m: float, y_m: float, within_px: int = 12) -> bool:
    """Whether the canvas has a colour of the style within so many pixels of a place."""
    return bool(
        page.evaluate(
            """([name, x, y, within]) => {
                const canvas = document.querySelector('#canvas'), [sx, sy] = echostep.view.toScreen(x, y).map((v) => v * devicePixelRatio);
                const hex = getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
                const want = [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
                const { data } = canvas.getContext('2d').getImageData(sx - within, sy - within, 2 * within, 2 * within);
                for (let k = 0; k < data.length; k += 4) if (want.every((v, c) => Math.abs(data[k + c] - v) < 6) && data[k + 3] > 250) return true;
                return false;
            }""",
            [colour, x_m, y_m, within_px],
        )
    )


def picture(page: Any, name: str, tmp_path: Path) -> None:
    page.screenshot(path=kept(f"page-{name}.png", tmp_path))


@cache
def manual() -> str:
    """The text of the pages that show pictures."""
    return "".join(path.read_text() for path in (ROOT / "host/docs").rglob("*.md"))


def kept(name: str, tmp_path: Path) -> Path:
    """Where a picture goes: to those of the manual when they are made anew and a page shows it."""
    return (PICTURES if PICTURES and f"pictures/{name})" in manual() else tmp_path) / name
