# SPDX-License-Identifier: MIT
"""The page in Chromium: what is drawn, on a desk and on a phone, by touch and by keys."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from echostep.ports.chunks import portion_of
from echostep.tracker import Tracker
from echostep_app.guidance.cues import Cue, CueKind
from echostep_app.kernel_parts import PREPARING
from echostep_app.page.elements.guidance import ShownGuidance, guidance_of_cue
from echostep_app.page.live import LivePage
from echostep_app.page.mailbox import Mailbox
from echostep_app.plan.routing import RoutePlace
from page.browser import (
    LOOKS,
    Walk,
    demo_walk,
    looking,
    opened_page,
    overflow,
    painted,
    picture,
    spot,
    violations,
    wait_for,
)
from page.frames import LOCAL, scene, served
from waiting import until
from walks import PLAN


@pytest.mark.long
@pytest.mark.parametrize("look", LOOKS)
def test_nothing_keeps_anybody_out(browser: Any, look: str, tmp_path: Path) -> None:
    with Walk(24.0, 1.0) as walk, looking(browser, walk.page.url, look) as page:
        page.select_option("#goal", label="Meeting")
        wait_for(page, "echostep.scene.frame.guidance")
        if look == "dark":
            page.evaluate("echostep.view.zoom(4)")
        wait_for(page, "document.querySelector('#left').textContent.includes('to go')")
        wait_for(page, STILL)
        found = violations(
            page, options={"runOnly": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]}
        )
        picture(page, look, tmp_path)
        page.click("#here")
        again = violations(page)
        beyond = overflow(page)
        assert not page.wrong
    assert found == []
    assert again == []
    assert beyond == (0, 0)


SAME_PLAY = "['t_s', 'playing', 'times'].every((name) => echostep.last.play[name] === stood[name])"
SHEET = "document.querySelector('#sheet-text').textContent"
STILL = "!document.getAnimations().length"
NEAR_PX = 40  # of a way


def test_a_tap_and_a_drag_check_in(browser: Any, tmp_path: Path) -> None:
    with Walk(24.0, 0.1) as walk:  # so slow that no line of text grows while the finger is on the map
        page = looking(browser, walk.page.url, "bright")
        page.click("#here")
        x_px, y_px = spot(page, 13.0, 2.0)
        page.mouse.move(x_px, y_px)
        page.mouse.down()
        page.mouse.move(x_px, y_px - 50.0, steps=4)
        page.mouse.up()
        wait_for(page, f"{SHEET}.includes('In South corridor.') && {SHEET}.includes('You face the arrow.')")
        assert not walk.checked_in  # it is said what it would do; only then it is done
        picture(page, "check-in", tmp_path)
        page.click("#sheet-here")
        assert until(lambda: len(walk.checked_in) == 1)
        wait_for(
            page,
            "echostep.last.streams.check_ins === 1 && echostep.last.undo?.undo === 1 && !document.querySelector('#undo').hidden",
        )
    (estimate,) = walk.checked_in
    assert np.hypot(estimate.x_m - 13.0, estimate.y_m - 2.0) < 0.5  # where the finger was; the walk goes on from there


def test_keys_alone_check_in_and_choose_a_way(browser: Any) -> None:
    with Walk(24.0, 1.0) as walk, looking(browser, walk.page.url, "dark") as page:
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
        wait_for(page, f"{SHEET} && !document.querySelector('#sheet-here').disabled")  # what it would do is said
        page.focus("#sheet-here")
        page.keyboard.press("Enter")
        assert until(lambda: len(walk.checked_in) == 1)


def test_two_fingers_zoom_and_rotate(browser: Any) -> None:
    with served() as (server, mailbox):
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


def test_a_quick_stroke_does_not_swallow_the_next_tap(browser: Any) -> None:
    with served() as (server, mailbox):
        mailbox.publish(scene())
        page = looking(browser, server.url, "bright")
        finger, box = page.context.new_cdp_session(page), page.locator("#map").bounding_box()
        for k in range(4):
            place = {"x": box["x"] + 80 + 60 * k, "y": box["y"] + 160}
            finger.send(
                "Input.dispatchTouchEvent", {"type": "touchMove" if k else "touchStart", "touchPoints": [place]}
            )
        finger.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        before = page.evaluate("echostep.view.scale")
        page.tap("#closer")
        wait_for(page, f"echostep.view.scale > {before}")


@pytest.mark.long
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
        page.select_option("#times", "2")  # so that it is paused long before the end, however late the click comes
        wait_for(page, "echostep.scene.frame.play.t_s > 8")
        page.click("#play")
        wait_for(page, "!echostep.scene.frame.play.playing")
        assert page.evaluate("echostep.scene.frame.play.times") == 2
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


def test_a_page_of_a_replay_counts_the_kernels_and_is_where_it_was_after_a_lost_connection(browser: Any) -> None:
    with served(Mailbox(PLAN, "test", replay=True)) as (server, mailbox):
        mailbox.show(replace(scene(), status_text=f"{PREPARING}: 12%"))
        page = looking(browser, server.url, "dark")
        wait_for(page, f"document.querySelector('#status-text').textContent === '{PREPARING}: 12%'")
        for t_s in range(60):
            mailbox.publish(scene(float(t_s)))
        page.click("#play")
        page.select_option("#times", "4")
        page.locator("#time").fill("20")
        wait_for(page, "(window.stood = echostep.last.play)?.t_s === 20 && stood.times === 4 && !stood.playing")
        server.show(mailbox)  # ends all connections
        wait_for(page, f"echostep.last.play !== stood && {SAME_PLAY}")
        assert not page.wrong


GUIDED = """({
    cue: document.querySelector('#cue').textContent, left: document.querySelector('#left').textContent,
    sign: document.querySelector('#turn').dataset.sign, end: document.querySelector('#end-guidance').offsetParent !== null,
    sentence: document.querySelector('#sentence').textContent, beacons: document.querySelector('#beacons').textContent })"""
SPEECH = """
    window.said = [];
    speechSynthesis.speak = (sentence) => window.said.push(sentence.text);
    speechSynthesis.cancel = () => window.said.push(null);"""


@pytest.mark.parametrize("look", ["bright", "dark"])
def test_the_runs_guidance_and_its_beacons_are_seen(browser: Any, look: str, tmp_path: Path) -> None:
    with Walk(25.0, 0.1, RoutePlace(19.6, 5.4)) as walk:  # so slow that nothing is over before it was looked at
        page = looking(browser, walk.page.url, look)
        wait_for(page, "echostep.last.beacons.length > 5 && echostep.last.guidance.path.length > 1")
        wait_for(page, STILL)
        seen, path = page.evaluate(f"[{GUIDED}, echostep.last.guidance.path]")
        colours = [painted(page, "goal", x, y, NEAR_PX) for x, y in path[1:]]
        found = violations(page)
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
    assert seen["cue"] in ("Straight ahead", "Turn right", "Turn left", "Turn around")
    assert seen["sign"] == "arrow"
    assert seen["left"].endswith(" m to go")
    assert seen["sentence"]
    assert not seen["end"]
    assert re.fullmatch(r"beacons: \d+ of \d+ heard", seen["beacons"])
    assert all(colours)
    assert found == []
    assert (wide, outside) == (0, 0)


def test_the_page_says_one_sentence_at_a_time_when_it_may(browser: Any) -> None:
    told = [guidance_of_cue(Cue(t, CueKind.TURN, text, 0.5, f"{text}.", 9.0), None, 0, None) for t, text in SENTENCES]
    with served() as (server, mailbox), opened_page(browser, **LOOKS["bright"]) as page:
        page.add_init_script(SPEECH)
        page.goto(server.url)

        def hears(shown: ShownGuidance) -> None:
            mailbox.publish(replace(scene(), guidance=shown))
            wait_for(page, f"document.querySelector('#sentence').textContent === '{shown.spoken}'")
            wait_for(page, f"echostep.last?.guidance?.arrow_rad === {shown.arrow_rad}")

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


SENTENCES = ((1.0, "Turn left"), (2.0, "Turn right"), (3.0, "Turn left"))


def test_the_arrow_turns_the_short_way_and_is_gone_when_the_heading_is_unknown(browser: Any) -> None:
    turn = "document.querySelector('#arrow').style.transform"
    with served() as (server, mailbox):
        shown = replace(guidance_of_cue(Cue(1.0, CueKind.TURN, "Turn left", 3.0, "", 9.0), None, 0, None))
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
