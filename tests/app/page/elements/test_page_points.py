# SPDX-License-Identifier: MIT
"""The points of an acceptance walk on the page: the buttons of a phone held either way, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import ClientConnection

from echostep_app.page.elements.taps import NO_TAP, PointPress, ShownPoints
from echostep_app.page.mailbox import Mailbox
from echostep_app.ports.arrival_clock import now_ns
from page.browser import READY, loaded_page, overflow, violations, wait_for
from page.frames import PLAN, next_frame, opened, scene, served
from page.test_language import CUT, LOCALES, MISSING, settles
from page.web.test_page_sizes import UNREACHED
from waiting import PATIENCE_S, until

THIRD = ShownPoints(
    13, "3", "13 of 34, round 2 of 4: stop with both feet beside it, press, then turn slowly on the spot",
    ("3", "4", "5", "2", "behind the fire door"), undo=True,
)  # fmt: skip
OVER = ShownPoints(35, "", "The last point. Stand still for 5 s: the page follows.", (), undo=True)
BUTTON = """(() => {
    const { left, top, right, bottom, height } = document.querySelector('#at-point').getBoundingClientRect();
    return [left >= 0 && top >= 0 && right <= innerWidth && bottom <= innerHeight, height >= 56];
})()"""  # whether it is in the window without scrolling, and large


def refused(page: ClientConnection, *requests: dict[str, object]) -> str:
    """The reason for which the last of these requests was refused."""
    for request in requests:
        page.send(json.dumps(request))
    answers = (page.recv(timeout=PATIENCE_S) for _ in range(100))
    return str(next(json.loads(text)["reason"] for text in answers if isinstance(text, str) and "refused" in text))


def offer(mailbox: Mailbox, points: ShownPoints, presses: list[PointPress]) -> None:
    """Show points; presses of their buttons are accepted and kept."""

    def take(press: PointPress) -> bool:
        presses.append(press)
        return True

    mailbox.on_press = take
    mailbox.set_points(points)


def at_point(number: int, **fields: object) -> dict[str, object]:
    return {"kind": "at_point", "number": number, **fields}


def test_a_press_is_queued_with_its_time_and_what_is_typed() -> None:
    begin_ns = now_ns()
    presses: list[PointPress] = []
    with served() as (server, mailbox):
        offer(mailbox, THIRD, presses)
        mailbox.publish(scene())
        with opened(server) as page:
            page.recv(timeout=PATIENCE_S)
            assert next_frame(page)["points"]["name"] == "3"
            for request in (at_point(13), at_point(13, name="5"), {"kind": "no_tap", "number": 13}):
                page.send(json.dumps(request))
            assert until(lambda: len(presses) == 3)
        assert [(press.number, press.typed) for press in presses] == [(13, ""), (13, "5"), (13, NO_TAP)]
        assert begin_ns < presses[0].t_ns <= presses[1].t_ns <= now_ns()
        assert server.counts.refused == 0


def test_what_cannot_be_a_tap_is_refused_and_counted() -> None:
    with served() as (server, mailbox):
        mailbox.publish(scene())
        with opened(server) as page:
            assert "no points are measured" in refused(page, at_point(0))
            mailbox.set_points(THIRD)
            assert "at another point" in refused(page, at_point(12))
            assert "at another point" in refused(page, {"kind": "no_tap", "number": 14})
            mailbox.on_press = lambda _: False
            assert "too busy" in refused(page, at_point(13))
            hostile = [
                at_point(-1),
                at_point(13, name="x" * 33),
                {"kind": "at_point"},
                {"kind": "no_tap", "number": "13"},
            ]
            for request in hostile:
                page.send(json.dumps(request))
            assert until(lambda: server.counts.unknown == len(hostile))
        assert server.counts.refused == 4


def test_a_replay_takes_no_tap() -> None:
    mailbox = Mailbox(PLAN, "test", replay=True)
    mailbox.publish(scene())
    with served(mailbox) as (server, _), opened(server) as page:
        assert "no points are measured" in refused(page, at_point(0))
        offer(mailbox, THIRD, [])
        assert "a replay" in refused(page, at_point(13))


@pytest.mark.parametrize("lang", LOCALES)
@pytest.mark.parametrize("size", [(360, 740), (740, 360)])
def test_the_buttons_fit_a_phone_held_either_way(
    browser: Any, size: tuple[int, int], lang: str, tmp_path: Path
) -> None:
    presses: list[PointPress] = []
    with served() as (server, mailbox):
        offer(mailbox, THIRD, presses)
        mailbox.publish(scene())
        how = {"viewport": {"width": size[0], "height": size[1]}, "locale": LOCALES[lang]}
        page = loaded_page(browser, server.url, how, READY)
        wait_for(page, "!document.querySelector('#points').hidden")
        page.screenshot(path=tmp_path / f"points-{lang}-{size[0]}.png")
        assert page.evaluate(BUTTON) == [True, True]
        assert settles(page), page.evaluate(CUT)
        assert page.evaluate(UNREACHED) == []
        assert overflow(page) == (0, 0)
        assert violations(page) == []
        page.click("#at-point")
        page.select_option("#other-point", "5")
        assert page.evaluate("document.querySelector('#at-point').disabled")  # until the walk has gone on
        assert until(lambda: len(presses) == 2)
        assert [press.typed for press in presses] == ["", "5"]
        mailbox.set_points(OVER)
        wait_for(page, "document.querySelector('#at-point').hidden && !document.querySelector('#no-tap').disabled")
        page.click("#no-tap")
        assert until(lambda: len(presses) == 3)
        assert (presses[-1].number, presses[-1].typed) == (35, NO_TAP)
        assert set(page.evaluate(MISSING)) <= {"echostep", "GeoJSON"}
        assert not page.wrong
