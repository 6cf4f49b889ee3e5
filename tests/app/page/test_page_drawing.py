# SPDX-License-Identifier: MIT
"""The page of a walk without a plan: the walls grow while it goes on, in a process of their own (simulated)."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from echostep.path import MeasuredSegment, PathSegment
from echostep.plan import NO_PLAN
from echostep.ports.chunks import Chunk, portion_of
from echostep.tracker import Tracker
from echostep_app.page import protocol
from echostep_app.page.drawing_process import STRETCH_M, DrawingProcess, Stretches
from echostep_app.page.elements.drawn_walls import (
    MOST_POINTS,
    MOST_WALLS,
    NO_DRAWING,
    ShownDrawing,
    WalkDrawing,
    shown_drawing,
)
from echostep_app.page.live import LivePage
from echostep_app.page.mailbox import Mailbox
from page.browser import DESK, PHONE, demo_walk, loaded_page, overflow, picture, wait_for
from page.frames import LOCAL, told
from waiting import until

PORTION = 500
WALLS = "echostep.scene.drawing?.walls.length / 5"
DRAWN = """(() => {
    const { trail: { points }, drawing: { walls, path, trail_count } } = echostep.scene;
    return [[...walls], [...path], [...points.slice(3 * trail_count - 3, 3 * trail_count - 1)]];
})()"""  # walls and path of one drawing, and the end of the trail when it was begun
LENGTH_M = """(() => {
    const { walls } = echostep.scene.drawing;
    return walls.reduce((sum, x, k) => k % 5 ? sum : sum + Math.hypot(walls[k + 2] - x, walls[k + 3] - walls[k + 1]), 0);
})()"""  # of all walls that are drawn
MESSAGE = 100_000  # bytes: what a page gets of a drawing at once
NO_PINGS = (np.zeros(0), np.zeros(0, np.int64), np.zeros(0))


def take(tracker: Tracker, page: LivePage, chunks: list[Chunk]) -> None:
    """A part of the walk, and the page of it."""
    for begin in range(0, len(chunks), PORTION):
        portion = portion_of(chunks[begin : begin + PORTION])
        page.note_arrival()
        tracker.take(portion)
        page.publish(portion)


def step(t_s: float, length_m: float) -> MeasuredSegment:
    """A step ahead without an echo."""
    return MeasuredSegment(PathSegment(t_s, t_s + 0.6, length_m, 0.0, 0.0, 0.0, 0.02, 0.001, 1), *NO_PINGS)


@pytest.mark.long
@pytest.mark.parametrize(("size", "how"), [("desk", {**DESK, "color_scheme": "dark"}), ("phone", PHONE)])
def test_the_walls_grow_on_the_page(browser: Any, tmp_path: Path, size: str, how: dict[str, Any]) -> None:
    """Half of the walk draws walls, the rest more of them; they stand beside the path, which meets the track."""
    start, chunks = demo_walk(beacons=False)
    tracker, half = Tracker(NO_PLAN, start, seed=1), len(chunks) // 2
    with LivePage(tracker, "A building without a plan", LOCAL) as live:
        take(tracker, live, chunks[:half])
        page = loaded_page(browser, live.url, how, f"{WALLS} > 2")
        before = page.evaluate(f"[{WALLS}, echostep.scene.drawing.trail_count]")
        take(tracker, live, chunks[half:])
        wait_for(page, f"{WALLS} > {before[0]} && {LENGTH_M} > 80")
        assert page.evaluate("echostep.scene.drawing.trail_count") > before[1]
        page.click("#whole")
        wait_for(page, "document.getElementById('drawn').textContent.startsWith('drawn: ')")
        walls, path, end = (np.array(part) for part in page.evaluate(DRAWN))
        picture(page, f"drawing-{size}", tmp_path)
        assert overflow(page) == (0, 0)
        assert page.wrong == []
    assert not live.server.shared.faults.notices
    walls, path = walls.reshape(-1, 5), path.reshape(-1, 2)
    assert np.hypot(*(path[-1] - end)) < 0.05
    assert 0.01 < walls[:, 4].mean() < 0.2
    middle = 0.5 * (walls[:, 0:2] + walls[:, 2:4])
    away = np.hypot(*(middle[:, None] - path).transpose(2, 0, 1)).min(axis=1)
    assert 0.3 < np.median(away) < 2.0  # beside the path, not on it


@pytest.mark.process
def test_a_page_that_draws_leaves_the_estimates_as_they_are() -> None:
    start, chunks = demo_walk(beacons=False)
    portions = [portion_of(chunks[begin : begin + PORTION]) for begin in range(0, len(chunks) // 2, PORTION)]
    alone, watched = Tracker(NO_PLAN, start, seed=1), Tracker(NO_PLAN, start, seed=1)
    expected = [estimate for portion in portions for estimate in alone.take(portion)]
    found = []
    with LivePage(watched, "test", LOCAL) as page:
        for portion in portions:
            found += watched.take(portion)
            page.publish(portion)
    assert found == expected


@pytest.mark.long
@pytest.mark.process
def test_a_replay_shows_what_was_drawn_by_then_and_draws_the_same_again() -> None:
    start, chunks = demo_walk(beacons=False)
    drawn = []
    for _ in range(2):
        tracker = Tracker(NO_PLAN, start, seed=1)
        with LivePage(tracker, "A replay", LOCAL, replay=True) as replay_page:
            take(tracker, replay_page, chunks[: len(chunks) // 2])
            mailbox = replay_page.mailbox
            assert until(lambda mailbox=mailbox: len(mailbox._drawings) >= 2)  # type: ignore[misc]
            drawn.append(mailbox._drawings[:2])
            first = mailbox._drawings[0]
            assert mailbox.drawing_at(first.t_s) is first
            assert mailbox.drawing_at(first.t_s - 0.1) is None
    for one, other in zip(*drawn, strict=True):
        assert one.t_s == other.t_s
        assert np.array_equal(one.walls, other.walls)
        assert np.array_equal(one.path, other.path)


def test_a_stretch_is_eight_metres_and_a_live_run_takes_all_that_wait() -> None:
    live, replay = Stretches(0.0), Stretches(0.5)
    for k in range(60):
        for stretches in (live, replay):
            stretches.add(step(0.6 * k, 1.0), told(t_s=0.6 * (k + 1)), k)
    lengths = []
    while replay.ready:
        lengths.append(len(replay.pop()[0]))
    assert lengths == [8, 8, 8, 12, 18]
    segments, estimate, trail_count = live.pop()
    assert (len(segments), trail_count) == (56, 55)
    assert estimate.t_s == pytest.approx(56 * 0.6)
    assert not live.ready


@pytest.mark.process
def test_a_drawing_that_cannot_go_on_is_said_once_and_nothing_waits_for_it() -> None:
    """A segment that no process can read."""
    said: list[str] = []
    process = DrawingProcess(lambda _: None, said.append, live=True)
    bad = replace(step(0.0, STRETCH_M), range_m=np.array(["no number"]), t_s=np.zeros(3))
    process.add(bad, told(), 0)
    assert until(lambda: bool(said))
    process.add(step(1.0, STRETCH_M), told(), 1)
    process.close()
    assert said == ["the walls are no longer drawn: EOFError"]


def test_the_drawing_meets_the_wearer() -> None:
    """The last pose of the walk is where the estimate is, and looks where it looks."""
    walls = np.array([[0.0, 1.0, 4.0, 1.0, 0.05]])
    drawing = WalkDrawing(walls, np.array([[0.0, 0.0], [4.0, 0.0]]), np.array([4.0, 0.0, 0.0]))
    estimate = replace(told(x_m=10.0, y_m=20.0), heading_rad=0.5 * np.pi)
    shown = shown_drawing(drawing, estimate, 7)
    assert shown.path == pytest.approx(np.array([[10.0, 16.0], [10.0, 20.0]]))
    assert shown.walls[0] == pytest.approx([9.0, 16.0, 9.0, 20.0, 0.05])
    assert shown.trail_count == 7


@pytest.mark.process
def test_the_greatest_drawing_is_a_bounded_message() -> None:
    most = ShownDrawing(1.0, np.ones((MOST_WALLS, 5), np.float32), np.ones((MOST_POINTS, 2), np.float32), 5)
    mailbox = Mailbox(NO_PLAN, "test", replay=False)
    mailbox.add_drawing(NO_DRAWING)
    mailbox.add_drawing(most)
    assert mailbox.drawing_at(0.5) is None  # a live run keeps the newest only
    part, rows = protocol._drawing(most)
    assert len(rows) + len(json.dumps(str(part))) < MESSAGE
    assert (part.walls, part.points, part.trail_count) == (MOST_WALLS, MOST_POINTS, 5)
