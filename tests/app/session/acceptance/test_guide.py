# SPDX-License-Identifier: MIT
"""The guide: lines that are typed become taps in the order of the visits."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import cast

import pytest

from echostep_app.page.elements.taps import PointPress, ShownPoints
from echostep_app.page.mailbox import Mailbox
from echostep_app.ports.arrival_clock import now_ns
from echostep_app.ports.tap import Tap, parse_tap
from echostep_app.session.acceptance import guide as guides
from echostep_app.session.acceptance.guide import Guide
from echostep_app.session.acceptance.protocol import FIELD
from echostep_app.session.acceptance.survey import corridor
from echostep_app.session.acceptance.walked import Taps
from waiting import until


def taps_of(typed: str) -> tuple[list[Tap], list[str], Guide]:
    """The taps of these lines, and what was said."""
    said: list[str] = []
    guide = Guide(corridor("20x2"), 1, io.StringIO(typed), said.append, {"source": "live"})
    taps: list[Tap] = []
    end = "No more lines can be typed: what was tapped counts; Ctrl-C ends."

    def is_read() -> bool:
        is_over = end in said  # then the taps are there
        for tap in map(parse_tap, guide.pop()):
            assert tap is not None
            assert 0 < tap.t_ns <= now_ns()
            taps.append(Tap(tap.point, tap.standing))
        return is_over

    assert until(is_read)
    said.pop()
    return taps, said, guide


def test_enter_is_the_next_point() -> None:
    taps, said, guide = taps_of("\n\n")
    assert taps == [Tap(0, standing=True), Tap(1, standing=True)]
    assert "Stand on point 1, look to point 2" in said[1]
    assert said[-1].startswith("2 of 8, round 1 of 1: stop")
    assert said[-1].endswith(" 3")
    assert guide.metadata["source"] == "live"
    assert FIELD in guide.metadata


def test_a_name_skips_the_points_that_were_missed() -> None:
    taps, said, _ = taps_of("\n4\n\n")
    assert taps == [Tap(0, standing=True), Tap(3, standing=True), Tap(4, standing=True)]
    assert "2 points left out." in said


def test_a_tap_is_taken_back() -> None:
    taps, said, _ = taps_of("u\n\n4\nu\n\n")
    assert taps == [Tap(0, standing=True), Tap(3, standing=True), Tap(None), Tap(1, standing=True)]
    assert "There is no tap to take back." in said


def test_other_lines_are_no_taps() -> None:
    taps, said, _ = taps_of("9\n" + 1000 * "x" + "\n")
    assert taps == []
    assert sum("is no point that is still to come" in line for line in said) > 1
    assert max(map(len, said)) < 200


class Page:
    """A page that keeps what it is told to show, and whose buttons are pressed."""

    points: ShownPoints
    on_press: Callable[[PointPress], bool]

    def set_points(self, points: ShownPoints) -> None:
        self.points = points


def test_the_buttons_of_a_page_are_the_keys() -> None:
    """The same taps, at the time of the press; a second press of a button that named an earlier point is none."""
    presses = [(0, ""), (0, ""), (1, "4"), (4, "u"), (4, "u"), (1, "9"), (1, ""), (9, "")]
    page, pressed_ns = Page(), now_ns()
    guide = Guide(corridor("20x2"), 1, io.StringIO(), lambda _: None, {})
    guide.attach(cast(Mailbox, page))
    assert guide.pop() == []
    assert page.points == ShownPoints(
        0,
        "1",
        "Stand on point 1, look to point 2, and stay. Press while you stand.",
        ("1", "2", "3", "4", "5"),
        undo=False,
    )
    taken = [page.on_press(PointPress(pressed_ns + k, number, typed)) for k, (number, typed) in enumerate(presses)]
    assert taken == [True, False, True, True, False, True, True, False]
    payloads = guide.pop()
    assert payloads == [
        Tap(0, standing=True, t_ns=pressed_ns).encode(),
        Tap(3, standing=True, t_ns=pressed_ns + 2).encode(),
        Tap(None, t_ns=pressed_ns + 3).encode(),
        Tap(1, standing=True, t_ns=pressed_ns + 6).encode(),
    ]
    typed_taps, _, _ = taps_of("\n4\nu\n9\n\n")
    assert [tap and (tap.point, tap.standing) for tap in map(parse_tap, payloads)] == [
        (tap.point, tap.standing) for tap in typed_taps
    ]
    assert (page.points.number, page.points.name) == (2, "3")
    assert page.points.text == "2 of 8, round 1 of 1: stop with both feet beside it, press, walk on"
    assert page.points.undo


def test_after_the_last_point_no_button_is_left() -> None:
    page = Page()
    guide = Guide(corridor("20x2"), 1, io.StringIO(), lambda _: None, {})
    guide.attach(cast(Mailbox, page))
    assert guide.pop() == []
    assert all(
        page.on_press(PointPress(now_ns(), number, "")) for number in range(9)
    )  # at once, before the run goes on
    assert (page.points.name, page.points.later) == ("", ())
    assert page.points.text.startswith("The last point. Stand still for 5 s")
    assert len(guide.pop()) == 9


def test_a_flood_of_presses_is_refused_while_the_run_is_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guides, "MOST_TAPS", 4)
    page = Page()
    guide = Guide(corridor("20x2"), 1, io.StringIO(), lambda _: None, {})
    guide.attach(cast(Mailbox, page))
    guide.pop()
    taken = [page.on_press(PointPress(now_ns(), k % 2, "u" if k % 2 else "")) for k in range(8)]
    assert taken == 4 * [True] + 4 * [False]
    assert len(guide.pop()) == 4
    assert page.on_press(PointPress(now_ns(), 0, ""))


def test_the_run_ends_after_the_last_point(monkeypatch: pytest.MonkeyPatch) -> None:
    _, said, guide = taps_of(9 * "\n" + "\n")
    assert "All points were tapped." in said
    assert not guide.is_over()
    monkeypatch.setattr(guides, "REST_S", 0.0)
    assert guide.is_over()


def test_bytes_that_are_no_tap_are_counted() -> None:
    taps = Taps(points=2)
    hostile = (
        b"",
        b"{}",
        b'{"point":2}',
        b'{"point":-1}',
        b'{"point":true}',
        b"\xff",
        b'{"point":0,"t_ns":1e300}',
        b'{"point":0}' + 200 * b" ",
    )
    for payload in (*hostile, Tap(None).encode()):
        taps.receive(payload)
    assert (taps.kept, taps.bad, taps.taken_back) == ([], 9, 0)
    tap = Tap(1, standing=True, t_ns=2)
    taps.receive(tap.encode())
    assert taps.kept == [tap]
    taps.receive(Tap(None).encode())
    assert (taps.kept, taps.taken_back) == ([], 1)
