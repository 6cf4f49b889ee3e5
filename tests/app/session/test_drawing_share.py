# SPDX-License-Identifier: MIT
"""One walks without a plan and draws, a teammate is tracked on the drawing: through a real broker, with a page and without (simulated)."""

from __future__ import annotations

import csv
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from command_line import echostep
from echostep.localization import Estimate
from echostep.plan import NO_PLAN, Plan, load_plan
from echostep.ports.chunks import Chunk, Portion, portion_of
from echostep.tracker import Tracker
from echostep_app.page.server import Address
from echostep_app.session.metadata import run_metadata, start_recording
from echostep_app.session.options import OutputOptions
from echostep_app.session.session import Session
from echostep_app.session.team import teammate_feed
from echostep_app.team.endpoint import parse_endpoint, parse_outlet
from echostep_app.team.inbox import ListenerThread
from echostep_app.team.messages.shared_drawings import MOST_BYTES, checked_drawing, drawing_topic
from echostep_app.team.mqtt.publisher import Listener
from echostep_app.team.wearer_plan import plan_file
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import demo_scenario
from page.browser import PLAN, demo_walk
from team.team_broker import Broker, needs_broker
from walks import errors_of

PORTION = 500
LEAST_M = 60.0  # of wall in the drawing of the demo's walk


def length_m(plan: Plan) -> float:
    walls = np.concatenate([level.walls for level in plan.levels])
    return float(np.hypot(*(walls[:, 2:] - walls[:, :2]).T).sum())


class Kept:
    """What the broker keeps of a wearer's drawing."""

    def __init__(self, url: str, name: str) -> None:
        self.plan: Plan | None = None
        broker = parse_endpoint(url)
        self.receiver = ListenerThread(Listener(broker, [drawing_topic("red", name)], self._put, MOST_BYTES), print)

    def is_drawn(self) -> bool:
        return self.plan is not None and length_m(self.plan) > LEAST_M

    def _put(self, _topic: str | None, payload: bytes, _retained: bool) -> None:
        self.plan = checked_drawing(payload)


def walk_then_wait(chunks: list[Chunk], kept: Kept) -> Iterator[Portion]:
    """A walk, and portions without bytes until the broker has its drawing."""
    for begin in range(0, len(chunks), PORTION):
        yield portion_of(chunks[begin : begin + PORTION])
    while not kept.is_drawn():
        yield portion_of([])
        time.sleep(0.01)


def draw(broker: Broker, folder: Path, page: Address | None) -> None:
    """Anna's live run without a plan along the demo's way, until the broker has the drawing."""
    start, chunks = demo_walk(beacons=False)
    outlet, kept = parse_outlet([broker.url], "anna", "red"), Kept(broker.url, "anna")
    output = OutputOptions(folder, terminal=False, page=page, outlet=outlet)
    with Session(Tracker(NO_PLAN, start, seed=1), "anna", "live", output) as session:
        session.track(walk_then_wait(chunks, kept))
    kept.receiver.close()


@pytest.mark.long
@needs_broker
def test_what_one_walk_has_drawn_tracks_a_teammate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bo walks the demo's way too, by other feet, on what anna has drawn; the file replays it."""
    monkeypatch.setattr(teammate_feed, "SHARE_S", 0.0)
    with Broker(tmp_path) as broker:
        draw(broker, tmp_path / "anna", None)
        bo = parse_outlet([broker.url], "bo", "red")
        path = plan_file(Path("wearer:anna"), bo.broker, bo.team, tmp_path / "bo", print)
    assert path is not None
    plan = load_plan(path)
    assert plan.name.startswith("drawn by anna, 20")
    assert plan.start == pytest.approx(demo_walk(beacons=False)[0])
    assert 0.0 < (plan.uncertainty_m or 0.0) < 0.2
    scenario = demo_scenario(PLAN, 7, PythonBoard(seed=7))
    wearer = Tracker(plan, plan.start, seed=7)
    estimates = list[Estimate]()
    with start_recording(tmp_path / "bo/walk.mcap", run_metadata(plan, plan.start, 7, "on a drawing")) as recorder:
        chunks = list(scenario.chunks())
        for begin in range(0, len(chunks), PORTION):
            portion = chunks[begin : begin + PORTION]
            for chunk in portion:
                recorder.write(chunk)
            estimates += wearer.take(portion_of(portion))
    assert errors_of(estimates, scenario).horizontal_m.mean() < 0.2
    again = echostep("replay", recorder.path, "--plan", path, "--headless", "--out", tmp_path / "again", ends=0)
    assert "is not the plan" not in again.stdout
    rows = list(csv.DictReader((tmp_path / "again/track.csv").read_text().splitlines()))
    assert float(rows[-1]["x_m"]) == pytest.approx(estimates[-1].x_m, abs=1e-3)


@pytest.mark.long
@needs_broker
def test_what_a_page_draws_is_shared_as_well(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(teammate_feed, "SHARE_S", 0.0)
    with Broker(tmp_path) as broker:
        draw(broker, tmp_path / "anna", Address(port=0))
