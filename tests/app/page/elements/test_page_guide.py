# SPDX-License-Identifier: MIT
"""The guidance of a run and its beacons on the page: the run's cue unless a page has a destination of its own, each at its moment."""

from __future__ import annotations

import itertools
import json
import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from websockets.sync.client import ClientConnection

from echostep.localization import Estimate
from echostep.ports.chunks import Chunk, portion_of
from echostep.tracker import Tracker
from echostep_app.guidance.cues import Cue, CueKind
from echostep_app.guidance.guided_run import GuidedRun
from echostep_app.page.elements.guidance import guidance_of_cue, remaining_path
from echostep_app.page.elements.marks import BeaconMark
from echostep_app.page.elements.scene import PageScene
from echostep_app.page.live import LivePage
from echostep_app.plan.routing import Route, RoutePlace, Stretch
from echostep_simulation.devices.beacon_gateway import with_beacons
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import Scenario
from page.frames import LOCAL, PLAN, next_frame, opened, opened_url, scene, served
from waiting import PATIENCE_S

SEED = 5
TO = RoutePlace(9.5, 10.8)
WAY = Route((Stretch(0, np.array([[2.0, 7.5], [9.5, 7.5]])), Stretch(1, np.array([[9.5, 7.5], [9.5, 10.8]]))))
AHEAD = Cue(1.0, CueKind.AHEAD, "Straight ahead", 0.1, "Straight ahead.", 10.8)


@pytest.fixture(scope="module")
def chunks() -> list[Chunk]:
    scenario = Scenario(PLAN, ((2.0, 7.5), (9.5, 7.5), (9.5, 10.8)), SEED, PythonBoard(seed=SEED))
    return list(with_beacons(scenario, PLAN, SEED))


def guided_tracker() -> tuple[Tracker, GuidedRun]:
    tracker = Tracker(PLAN, None, seed=SEED)
    return tracker, GuidedRun(tracker, TO)


def until(page: ClientConnection, holds: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    """The first frame for which something holds; each is drawn."""
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        frame = next_frame(page)
        page.send(json.dumps({"kind": "drawn", "seq": frame["seq"]}))
        if holds(frame):
            return frame
    raise AssertionError(f"no such frame in {PATIENCE_S} s")


def at(t_s: float) -> Callable[[dict[str, Any]], bool]:
    """Whether the time bar is there."""
    return lambda frame: bool(frame["play"]["t_s"] == t_s)


def test_a_sentence_stands_until_there_is_a_new_one() -> None:
    first = guidance_of_cue(AHEAD, WAY, 0, None)
    assert (first.spoken, first.spoken_s) == ("Straight ahead.", 1.0)
    assert first.path == ((2.0, 7.5), (9.5, 7.5))
    silent = guidance_of_cue(replace(AHEAD, t_s=2.0, spoken=""), WAY, 1, first)
    assert (silent.spoken, silent.spoken_s) == ("Straight ahead.", 1.0)
    assert silent.path == ((9.5, 7.5), (9.5, 10.8))
    left = guidance_of_cue(replace(AHEAD, t_s=3.0, kind=CueKind.STOP, spoken="Stop."), None, 0, silent)
    assert (left.spoken, left.spoken_s, left.left_m, left.path) == ("Stop.", 3.0, None, ())


def test_what_is_left_of_a_way() -> None:
    there_and_back = Route((*WAY.stretches, Stretch(0, np.array([[9.5, 10.8], [9.5, 5.8], [2.0, 5.8]]))))
    assert remaining_path(there_and_back, 0, 99.0) == ((2.0, 7.5), (9.5, 7.5), (9.5, 10.8), (9.5, 5.8), (2.0, 5.8))
    assert remaining_path(there_and_back, 0, 12.5 + 3.3 + 4.5) == (
        (5.0, 7.5),
        (9.5, 7.5),
        (9.5, 10.8),
        (9.5, 5.8),
        (2.0, 5.8),
    )
    assert remaining_path(there_and_back, 1, 12.5 + 1.3) == ((9.5, 9.5), (9.5, 10.8))
    assert remaining_path(there_and_back, 0, 12.5 + 1.3) == ((9.5, 10.8), (9.5, 5.8), (2.0, 5.8))
    assert np.allclose(remaining_path(there_and_back, 0, 7.0), ((9.0, 5.8), (2.0, 5.8)))
    assert remaining_path(there_and_back, 1, 7.0) == remaining_path(there_and_back, 0, 0.0) == ()


def test_who_turns_and_who_falls_silent() -> None:
    shown = guidance_of_cue(AHEAD, WAY, 0, None)
    assert shown.turned(0.3).arrow_rad == pytest.approx(-0.2)
    stopped = shown.stopped("There is nothing from the foot", 4.0)
    assert (stopped.kind, stopped.arrow_rad, stopped.left_m) == ("stop", None, None)
    assert stopped.spoken == "Stop. There is nothing from the foot."
    assert stopped.turned(0.3) == stopped


def test_all_pages_are_guided_by_the_run_until_one_of_them_chooses_a_destination() -> None:
    guide = guidance_of_cue(AHEAD, WAY, 0, None)
    mark = BeaconMark(7, 3.0, 4.0, 0.5, 0, "moved", heard=True)
    with served() as (server, mailbox):
        mailbox.publish(replace(scene(), guidance=guide, beacons=(mark,)))
        with opened(server) as one, opened(server) as other:
            for page in (one, other):
                page.recv(timeout=PATIENCE_S)
                frame = until(page, lambda frame: bool(frame["told"]))
                assert frame["guidance"]["text"] == "Straight ahead"
                assert not frame["guidance"]["own"]
                assert frame["beacons"][0]["number"] == 7
            one.send('{"kind":"go_to","x_m":13.0,"y_m":4.5}')
            own = until(one, lambda frame: frame["guidance"]["own"] and frame["guidance"]["kind"] != "looking")
            assert own["guidance"]["spoken"]
            assert own["guidance"]["path"][-1] == [13.0, 4.5]
            mailbox.publish(replace(scene(), guidance=guide))
            there = until(other, lambda frame: not frame["beacons"] and frame["guidance"]["kind"] != "looking")
            assert there["guidance"]["own"]
            assert there["goal"] == own["goal"] == {"x_m": 13.0, "y_m": 4.5, "level": 0}
            other.send('{"kind":"go_nowhere"}')
            for page in (one, other):
                end = until(page, lambda frame: not frame["guidance"]["own"])
                assert (end["guidance"]["text"], end["goal"]) == ("Straight ahead", None)
        with opened(server) as late:
            mailbox.set_goal(RoutePlace(13.0, 4.5))
            late.recv(timeout=PATIENCE_S)
            assert until(late, lambda frame: bool(frame["goal"]))["guidance"]["own"]


@pytest.mark.slow
def test_a_replay_shows_the_cue_and_the_beacons_of_its_moment(chunks: list[Chunk]) -> None:
    tracker, guided = guided_tracker()
    with LivePage(tracker, "A replay", LOCAL, guided, replay=True) as replay_page:
        portion = portion_of(chunks)  # all at once, as a headless replay does
        tracker.take(portion)
        replay_page.publish(portion)
        with opened_url(replay_page.url) as page:
            page.recv(timeout=PATIENCE_S)
            page.send('{"kind":"play","playing":false}')
            for t_s in (2.5, 15.2, 11.0, 7.0):
                (*_, cue) = (cue for cue in guided.cues if cue.t_s <= t_s)
                page.send(json.dumps({"kind": "seek", "t_s": t_s}))
                frame = until(page, at(t_s))
                assert frame["t_s"] == cue.t_s
                assert (frame["guidance"]["kind"], frame["guidance"]["text"]) == (cue.kind.value, cue.text)
                assert frame["guidance"]["arrow_rad"] == cue.arrow_rad
            page.send(json.dumps({"kind": "seek", "t_s": 1e9}))
            last = until(page, lambda frame: frame["t_s"] == guided.cues[-1].t_s)
            page.send(json.dumps({"kind": "seek", "t_s": 0.0}))
            first = until(page, lambda frame: frame["t_s"] == guided.cues[0].t_s)
    assert last["guidance"]["text"] == "You have arrived"
    assert len(last["beacons"]) > len(first["beacons"])
    assert {b["state"] for b in last["beacons"]} == {"well"}
    assert any(b["heard"] for b in frame["beacons"])
    assert not any(b["heard"] for b in last["beacons"])  # in a room, behind walls


def test_without_bytes_a_guided_page_says_stop(chunks: list[Chunk]) -> None:
    tracker, guided = guided_tracker()
    early = chunks[: len(chunks) // 2]
    shift_ns = time.monotonic_ns() - 5_000_000_000 - early[-1].t_arrival_ns
    with LivePage(tracker, "test", LOCAL, guided) as live:
        portion = portion_of([replace(chunk, t_arrival_ns=chunk.t_arrival_ns + shift_ns) for chunk in early])
        tracker.take(portion)
        live.publish(portion)
        live.publish(portion_of([]))
        with opened_url(live.url) as page:
            page.recv(timeout=PATIENCE_S)
            frame = until(page, lambda frame: frame["guidance"]["kind"] == "stop")
    assert frame["words"].startswith("lost: nothing from the foot for ")
    assert (frame["told"]["status"], frame["told"]["heading_known"]) == ("lost", False)
    assert frame["told"]["major_m"] > 5.0
    assert frame["guidance"]["text"] == "Stop. There is nothing from the foot"
    assert frame["guidance"]["arrow_rad"] is None
    assert frame["beacons"]
    assert not any(b["heard"] for b in frame["beacons"])


@pytest.mark.long
def test_a_step_that_is_shown_before_its_echoes_turns_the_arrow(chunks: list[Chunk]) -> None:
    tracker, guided = guided_tracker()
    scenes: list[PageScene] = []
    estimates: list[Estimate] = []
    with LivePage(tracker, "test", LOCAL, guided) as live:
        live.mailbox.publish = scenes.append  # type: ignore[assignment, method-assign]
        for chunk in chunks:
            portion = portion_of([chunk])
            live.note_arrival()
            estimates += tracker.take(portion)
            live.publish(portion)
    ahead = [(a, b) for a, b in itertools.pairwise(scenes) if b.guidance and b.estimate and b.estimate not in estimates]
    turns = [aim(b) - aim(a) for a, b in ahead if b.guidance and b.guidance.kind != "arrived"]
    assert not any(shown.guidance.kind == "stop" for shown in scenes if shown.guidance)
    assert (
        max(abs(b.estimate.heading_rad - a.estimate.heading_rad) for a, b in ahead if a.estimate and b.estimate) > 0.1
    )
    assert len(turns) > 5
    assert max(map(abs, turns)) < 1e-9


def aim(shown: PageScene) -> float:
    """Where the arrow points in the map; NaN for none."""
    assert shown.guidance
    assert shown.estimate
    return math.nan if shown.guidance.arrow_rad is None else shown.estimate.heading_rad + shown.guidance.arrow_rad
