"""The page in Chromium: what one sees, how soon, how often, and for whom.

With ECHOSTEP_PICTURES=1 the pictures of the README are made anew.
"""

from __future__ import annotations

import os
import re
import shutil
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from board_runs import ROOT
from echostep.foot.steps import Step
from echostep.guidance.cues import Cue, CueKind
from echostep.guidance.guided_run import GuidedRun
from echostep.page.elements.guidance import ShownGuidance, guidance_of_cue
from echostep.page.elements.scene import ParticleSample
from echostep.page.live import LivePage
from echostep.page.mailbox import Mailbox
from echostep.page.server import Address, PageServer
from echostep.path import PathSegment
from echostep.plan.model import Pose, load_plan
from echostep.plan.routing import RoutePlace
from echostep.ports.chunks import Chunk, portion_of
from echostep.simulation.devices.beacon_gateway import with_beacons
from echostep.simulation.devices.board import PythonBoard
from echostep.simulation.scenario import START_NS, demo_scenario
from echostep.tracker import Tracker
from page.test_page import scene

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed: pages are not looked at")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no chromium on this machine: pages are not looked at")

PLAN = load_plan(ROOT / "host/echostep/plans/demo.json")
PICTURES = ROOT / "host/pictures" if os.environ.get("ECHOSTEP_PICTURES") else None
LOCAL = Address(port=0)
PHONE = {"viewport": {"width": 360, "height": 640}, "has_touch": True, "is_mobile": True, "device_scale_factor": 2}
DESK = {"viewport": {"width": 1100, "height": 640}}
LOOKS: dict[str, dict[str, Any]] = {
    "bright": {**PHONE, "color_scheme": "light"},
    "dark": {**DESK, "color_scheme": "dark"},
    "contrast": {**PHONE, "contrast": "more"},
}


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as running:
        chromium = running.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield chromium
        chromium.close()


@cache
def demo_walk(*, beacons: bool) -> tuple[Pose, list[Chunk]]:
    """Where the demo's walk begins, and its chunks."""
    scenario = demo_scenario(PLAN, 1, PythonBoard(seed=1))
    return scenario.start, list(with_beacons(scenario, PLAN, 1) if beacons else scenario.chunks())


class Walk:
    """The demo's walk, tracked in a thread of its own at so many times real time, as a run does it; `guide`: with beacons, to a place."""

    def __init__(self, begin_s: float, pace: float, guide: RoutePlace | None = None) -> None:
        start, self._chunks = demo_walk(beacons=guide is not None)
        self._first_ns = self._chunks[0].t_arrival_ns
        self._tracker = Tracker(PLAN, start, seed=1)
        self._pace = pace
        self._stop = threading.Event()
        guided = GuidedRun(self._tracker, guide) if guide else None
        self.page = LivePage(self._tracker, "A simulated walk", LOCAL, guided)
        self._begin = sum(chunk.t_arrival_ns - self._first_ns < begin_s * 1e9 for chunk in self._chunks)
        self._thread = threading.Thread(target=self._run, daemon=True)
        self.taken = 0
        self.told_s: list[float] = []  # for each step, how long after the landing its bytes had come
        told = self._tracker.front_end.path.add_step

        def step(landed: Step) -> list[PathSegment]:
            self.told_s.append(self._now_s - landed.t_end_s)
            return told(landed)

        self._tracker.front_end.path.add_step = step  # type: ignore[assignment, method-assign]

    def __enter__(self) -> Walk:
        self.page.__enter__()
        for chunk in self._chunks[: self._begin]:
            self._take(chunk)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()
        self.page.__exit__(None, None, None)

    def _run(self) -> None:
        began, first_ns = time.monotonic(), self._chunks[self._begin].t_arrival_ns
        for chunk in self._chunks[self._begin :]:
            ahead_s = (chunk.t_arrival_ns - first_ns) * 1e-9 / self._pace - (time.monotonic() - began)
            if self._stop.wait(max(ahead_s, 0.0)):
                return
            for said in self.page.pop_check_ins():
                self.taken += 1
                self._take(Chunk("person", chunk.t_arrival_ns, said))
            self._take(chunk)

    def _take(self, chunk: Chunk) -> None:
        self._now_s = (chunk.t_arrival_ns - START_NS) * 1e-9
        portion = portion_of([chunk])
        self.page.note_arrival()
        self._tracker.take(portion)
        self.page.publish(portion)


def looking(browser: Any, url: str, look: str) -> Any:
    page = browser.new_context(**LOOKS[look]).new_page()
    page.wrong = []
    page.on("pageerror", lambda error: page.wrong.append(str(error)))
    page.on("console", lambda said: page.wrong.append(said.text) if said.type == "error" else None)
    page.goto(url)
    wait_for(page, "echostep.scene.frame && echostep.scene.frame.told")
    return page


def until(holds: Callable[[], bool], timeout_s: float = 60.0) -> bool:
    deadline = time.monotonic() + timeout_s
    while not holds():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.05)
    return True


def skip_when_busy(reached: bool, measured: str) -> None:
    """What was missed while others had the processors says nothing about the page."""
    load, cores = os.getloadavg()[0], os.cpu_count() or 1
    if not reached and load > 0.5 * cores:
        pytest.skip(f"the machine is too busy to measure (load {load:.0f} on {cores} cores): {measured}")


def wait_for(page: Any, holds: str) -> None:
    """Until an expression holds (the page's own policy forbids Playwright's waiting)."""
    assert until(lambda: bool(page.evaluate(holds))), holds


def picture(page: Any, name: str, tmp_path: Path) -> None:
    page.screenshot(path=(PICTURES or tmp_path) / f"page-{name}.png")


def test_from_a_step_to_the_pixel_in_a_tenth_of_a_second(browser: Any) -> None:
    """The foot lands; its bytes come; the page draws where that leads: in data time, then by the clock."""
    with Walk(20.0, 3.0) as walk:
        page = looking(browser, walk.page.url, "dark")
        best_s = np.inf
        for _ in range(5):  # the machine does other things too
            for session in walk.page.server.sessions:
                session.latency_s.clear()
            time.sleep(4.0)
            (drawn_s,) = [np.array(session.latency_s) for session in walk.page.server.sessions]
            told_s = np.array(walk.told_s)
            assert len(drawn_s) > 8
            assert len(told_s) > 15
            total_s = np.percentile(told_s, 95) + np.percentile(drawn_s, 95)
            print(
                f"95 %: told {1e3 * np.percentile(told_s, 95):.0f} ms after landing, "
                f"drawn {1e3 * np.percentile(drawn_s, 95):.0f} ms later"
            )
            best_s = min(best_s, total_s)
            if best_s <= 0.1:
                break
        assert not page.wrong
        page.context.close()
    skip_when_busy(best_s <= 0.1, f"{1e3 * best_s:.0f} ms")
    assert best_s <= 0.1


def test_thirty_frames_a_second_with_ten_thousand_particles(browser: Any) -> None:
    mailbox = Mailbox(PLAN, "test", replay=False)
    with PageServer(mailbox, LOCAL) as server:
        mailbox.publish(scene())
        page = looking(browser, server.url, "dark")
        rates_hz = [frame_rate(page, mailbox) for _ in range(5)]
        assert page.evaluate("echostep.scene.cloud.count") == 10_000
        page.context.close()
    print("with 10,000 particles, frames/s:", ", ".join(f"{rate_hz:.1f}" for rate_hz in rates_hz))
    skip_when_busy(max(rates_hz) > 28.5, f"{max(rates_hz):.1f} frames/s")
    assert max(rates_hz) > 28.5  # the machine does other things too


def frame_rate(page: Any, mailbox: Mailbox, span_s: float = 2.0) -> float:
    """Frames that a page draws in a second while the mailbox has a new cloud sixty times a second."""
    rng = np.random.default_rng(0)
    began, frames, k = time.monotonic(), page.evaluate("echostep.frames"), 0
    while (now := time.monotonic()) - began < span_s:
        x, y = (rng.normal(v, 1.0, 10_000).astype(np.float32) for v in (12.0, 7.0))
        crowd = ParticleSample(x, y, rng.integers(0, 256, 10_000).astype(np.uint8), np.zeros(10_000, np.uint8))
        mailbox.publish(replace(scene(now), particles=crowd))
        k += 1
        time.sleep(max(began + k / 60.0 - time.monotonic(), 0.0))
    drawn = page.evaluate("echostep.frames") - frames
    return float(drawn / (time.monotonic() - began))


@pytest.mark.parametrize("look", LOOKS)
def test_nothing_keeps_anybody_out(browser: Any, look: str, tmp_path: Path) -> None:
    from axe_playwright_python.sync_playwright import Axe  # type: ignore[import-untyped]

    with Walk(24.0, 1.0) as walk:
        page = looking(browser, walk.page.url, look)
        page.select_option("#goal", label="Meeting")
        wait_for(page, "echostep.scene.frame.guidance")
        if look == "dark":
            page.evaluate("echostep.view.zoom(4)")
        wait_for(page, "document.querySelector('#left').textContent.includes('to go')")
        page.wait_for_timeout(700)
        found = Axe().run(
            page, options={"runOnly": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]}
        )
        picture(page, look, tmp_path)
        page.click("#here")
        again = Axe().run(page)
        wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
        cut = page.evaluate(
            "[...document.querySelectorAll('button, select')].filter((e) => e.offsetParent && e.getBoundingClientRect().right > innerWidth).length"
        )
        assert not page.wrong
        page.context.close()
    assert found.violations_count == 0, found.generate_report()
    assert again.violations_count == 0, again.generate_report()
    assert (wide, cut) == (0, 0)


def test_a_tap_and_a_drag_check_in(browser: Any, tmp_path: Path) -> None:
    with Walk(24.0, 2.0) as walk:
        page = looking(browser, walk.page.url, "bright")
        box = page.locator("#map").bounding_box()
        page.click("#here")
        at = page.evaluate("echostep.view.toScreen(13.0, 2.0)")
        page.mouse.move(box["x"] + at[0], box["y"] + at[1])
        page.mouse.down()
        page.mouse.move(box["x"] + at[0], box["y"] + at[1] - 50.0, steps=4)
        picture(page, "check-in", tmp_path)
        page.mouse.up()
        assert until(lambda: walk.taken == 1)
        wait_for(page, "echostep.scene.frame.streams.check_ins === 1")
        told = page.evaluate("echostep.scene.frame.told")
        page.context.close()
    assert np.hypot(told["x_m"] - 13.0, told["y_m"] - 2.0) < 3.0


def test_keys_alone_check_in_and_choose_a_way(browser: Any) -> None:
    with Walk(24.0, 1.0) as walk:
        page = looking(browser, walk.page.url, "dark")
        page.focus("#map")
        before = page.evaluate("[echostep.view.x, echostep.view.scale, echostep.view.turn]")
        for key in ("ArrowRight", "+", "]"):
            page.keyboard.press(key)
        after = page.evaluate("[echostep.view.x, echostep.view.scale, echostep.view.turn]")
        assert after[0] > before[0]
        assert after[1] > before[1]
        assert after[2] < before[2]
        page.keyboard.press("g")
        page.keyboard.press("Enter")
        wait_for(page, "echostep.scene.frame.guidance")
        page.keyboard.press("h")
        page.keyboard.press(",")
        page.keyboard.press("Enter")
        assert until(lambda: walk.taken == 1)
        page.context.close()


def test_two_fingers_zoom_and_rotate(browser: Any) -> None:
    mailbox = Mailbox(PLAN, "test", replay=False)
    with PageServer(mailbox, LOCAL) as server:
        mailbox.publish(scene())
        page = looking(browser, server.url, "bright")
        before = page.evaluate("[echostep.view.scale, echostep.view.turn]")
        fingers, box = page.context.new_cdp_session(page), page.locator("#map").bounding_box()
        for k in range(10):
            reach, angle = 40.0 + 6.0 * k, 0.05 * k  # clockwise on the screen
            ends = [(side * reach * np.cos(angle), side * reach * np.sin(angle)) for side in (-1, 1)]
            points = [{"x": box["x"] + 180 + u, "y": box["y"] + 160 + v, "id": i} for i, (u, v) in enumerate(ends)]
            fingers.send(
                "Input.dispatchTouchEvent", {"type": "touchMove" if k else "touchStart", "touchPoints": points}
            )
        fingers.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

        def view() -> tuple[float, float]:
            scale, turn = page.evaluate("[echostep.view.scale, echostep.view.turn]")
            return scale / before[0], turn

        wanted = pytest.approx((94.0 / 40.0, -0.45), rel=0.02, abs=0.02)
        assert until(lambda: view() == wanted), view()
        page.context.close()


def test_a_replay_plays_stops_and_seeks(browser: Any, tmp_path: Path) -> None:
    start, chunks = demo_walk(beacons=False)
    tracker = Tracker(PLAN, start, seed=1)
    with LivePage(tracker, "A replay", LOCAL, replay=True) as replay_page:
        for begin in range(0, len(chunks), 2000):
            portion = portion_of(chunks[begin : begin + 2000])
            tracker.take(portion)
            replay_page.publish(portion)
        page = looking(browser, replay_page.url, "bright")
        assert page.is_hidden("#here")
        page.select_option("#times", "16")
        wait_for(page, "echostep.scene.frame.play.t_s > 8")
        page.click("#play")
        wait_for(page, "!echostep.scene.frame.play.playing")
        trail_count = page.evaluate("echostep.scene.trail.count")
        page.locator("#time").fill("60")
        wait_for(page, "Math.abs(echostep.scene.frame.play.t_s - 60) < 0.1")
        assert page.evaluate("echostep.scene.trail.count") > trail_count
        assert page.evaluate("echostep.scene.frame.t_s") == pytest.approx(60.0, abs=2.0)
        page.click("#back")
        wait_for(page, "echostep.scene.frame.play.t_s < 59.9")
        picture(page, "replay", tmp_path)
        page.locator("#time").fill("20")
        wait_for(page, "Math.abs(echostep.scene.frame.play.t_s - 20) < 0.1")
        assert page.evaluate("echostep.scene.trail.count") < 30
        assert not page.wrong
        page.context.close()


GUIDED = """({
    cue: document.querySelector('#cue').textContent, left: document.querySelector('#left').textContent,
    sign: document.querySelector('#turn').dataset.sign, end: document.querySelector('#end-guidance').offsetParent !== null,
    sentence: document.querySelector('#sentence').textContent, beacons: document.querySelector('#beacons').textContent })"""
SPEECH = """
    window.said = [];
    speechSynthesis.speak = (sentence) => window.said.push(sentence.text);
    speechSynthesis.cancel = () => window.said.push(null);"""


@pytest.mark.parametrize("look", LOOKS)
def test_the_runs_guidance_and_its_beacons_are_seen(browser: Any, look: str, tmp_path: Path) -> None:
    from axe_playwright_python.sync_playwright import Axe

    with Walk(25.0, 0.1, RoutePlace(19.6, 5.4)) as walk:  # so slow that nothing is over before it was looked at
        page = looking(browser, walk.page.url, look)
        wait_for(page, "echostep.scene.frame.beacons.length > 5")
        seen = page.evaluate(GUIDED)
        path = page.evaluate("echostep.scene.frame.guidance.path")
        page.wait_for_timeout(700)
        colours = [ink_near(page, *place) for place in path[1:]]
        found = Axe().run(page)
        if look != "contrast":
            picture(page, "guide" if look == "bright" else "guide-wide", tmp_path)
        wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
        outside = page.evaluate(
            "[...document.querySelectorAll('#guidance > *')].filter((e) => e.offsetParent && e.getBoundingClientRect().right > innerWidth).length"
        )
        page.select_option("#goal", label="Store")
        wait_for(page, "echostep.scene.frame.guidance.own")
        wait_for(page, f"{GUIDED}.end")
        page.click("#end-guidance")
        wait_for(page, "!echostep.scene.frame.guidance.own")
        assert not page.wrong
        page.context.close()
    assert seen["cue"] in ("Straight ahead", "Turn right", "Turn left", "Turn around")
    assert seen["sign"] == "arrow"
    assert seen["left"].endswith(" m to go")
    assert seen["sentence"]
    assert not seen["end"]
    assert re.fullmatch(r"beacons: \d+ of \d+ heard", seen["beacons"])
    assert all(colours)
    assert found.violations_count == 0, found.generate_report()
    assert (wide, outside) == (0, 0)


def ink_near(page: Any, x_m: float, y_m: float) -> bool:
    """Whether the canvas shows anything of the way's colour within a few pixels of a place."""
    return bool(
        page.evaluate(
            """([x, y]) => {
                const canvas = document.querySelector('#canvas'), [sx, sy] = echostep.view.toScreen(x, y).map((v) => v * devicePixelRatio);
                const hex = getComputedStyle(document.documentElement).getPropertyValue('--goal').trim();
                const want = [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
                const { data } = canvas.getContext('2d').getImageData(sx - 40, sy - 40, 80, 80);
                for (let k = 0; k < data.length; k += 4) if (want.every((v, c) => Math.abs(data[k + c] - v) < 6) && data[k + 3] > 250) return true;
                return false;
            }""",
            [x_m, y_m],
        )
    )


def test_the_page_says_one_sentence_at_a_time_when_it_may(browser: Any) -> None:
    mailbox = Mailbox(PLAN, "test", replay=False)
    told = [
        guidance_of_cue(Cue(t, CueKind.TURN, text, 0.5, f"{text}.", 9.0, 0.5), None, 0, None) for t, text in SENTENCES
    ]
    with PageServer(mailbox, LOCAL) as server:
        page = browser.new_context(**LOOKS["bright"]).new_page()
        page.add_init_script(SPEECH)
        page.goto(server.url)

        def hears(shown: ShownGuidance) -> None:
            mailbox.publish(replace(scene(), guidance=shown))
            wait_for(page, f"document.querySelector('#sentence').textContent === '{shown.spoken}'")

        hears(told[0])
        assert page.evaluate("said") == []  # off at first
        assert page.get_attribute("#speech", "aria-pressed") == "false"
        page.click("#speech")
        assert page.evaluate("said") == [None, "Turn left."]
        hears(told[1])
        hears(replace(told[1], arrow_rad=0.2))
        hears(told[2])
        assert page.evaluate("said") == [None, "Turn left.", None, "Turn right.", None, "Turn left."]
        page.reload()
        wait_for(page, "window.said?.length")
        assert page.get_attribute("#speech", "aria-pressed") == "true"  # remembered
        page.click("#speech")
        hears(told[1])
        assert page.evaluate("said") == [None, "Turn left.", None]
        page.context.close()


SENTENCES = ((1.0, "Turn left"), (2.0, "Turn right"), (3.0, "Turn left"))


def test_the_arrow_turns_the_short_way_and_is_gone_when_nobody_knows(browser: Any) -> None:
    mailbox = Mailbox(PLAN, "test", replay=False)
    turn = "document.querySelector('#arrow').style.transform"
    with PageServer(mailbox, LOCAL) as server:
        shown = replace(guidance_of_cue(Cue(1.0, CueKind.TURN, "Turn left", 2.0, "", 9.0, 3.0), None, 0, None))
        mailbox.publish(replace(scene(), guidance=shown))
        page = looking(browser, server.url, "bright")
        wait_for(page, f"{turn} === 'rotate(-3rad)'")
        mailbox.publish(replace(scene(), guidance=replace(shown, arrow_rad=-3.0)))
        wait_for(page, f"Math.abs(parseFloat({turn}.slice(7)) + 2 * Math.PI - 3) < 1e-4")
        mailbox.publish(replace(scene(), guidance=shown.stopped("There is nothing from the foot", 2.0)))
        wait_for(page, f"{GUIDED}.sign === 'halt'")
        assert page.is_hidden("#arrow")
        assert page.evaluate(f"{GUIDED}.cue") == "Stop. There is nothing from the foot"
        mailbox.publish(replace(scene(), guidance=None))
        wait_for(page, "document.querySelector('#guidance').hidden")
        assert page.evaluate(f"{GUIDED}.sentence") == ""
        page.context.close()


def test_ten_pages_at_once_and_one_that_comes_back(browser: Any) -> None:
    with Walk(10.0, 8.0) as walk:
        pages = [looking(browser, walk.page.url, "bright") for _ in range(10)]
        assert walk.page.pages == 10
        pages[0].evaluate("echostep.link.wait = 1e6, echostep.link.socket.close()")  # away until it is told to return
        assert until(lambda: walk.page.pages == 9)
        missed = pages[0].evaluate("echostep.scene.trail.count")
        wait_for(pages[1], f"echostep.scene.trail.count > {missed + 20}")
        pages[0].evaluate("echostep.link.open()")
        assert until(lambda: walk.page.pages == 10)
        wait_for(pages[0], f"echostep.scene.trail.count > {missed + 20}")
        counts = [page.evaluate("echostep.frames") for page in pages]
        assert min(counts[1:]) > 5
        for page in pages:
            page.context.close()
