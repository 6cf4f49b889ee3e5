# SPDX-License-Identifier: MIT
"""Cues on a walk with beacons, live and replayed alike; the simulated gateway's command."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from beacons.beacon_walk import SEED, Walk, beacon_walk
from command_line import echostep
from echostep.errors import EchostepError
from echostep.ports.chunks import GATEWAY, portion_of
from echostep.tracker import Tracker
from echostep_app.guidance.guided_run import GuidedRun, destination
from echostep_app.plan.routing import EXIT, RoutePlace
from walks import DEMO, PLAN


@pytest.fixture(scope="module")
def walk() -> Walk:
    return beacon_walk()


@pytest.mark.slow
def test_guided_walk_gives_cues_and_writes_them(walk: Walk, tmp_path: Path) -> None:
    tracker = walk.tracker()
    guided = GuidedRun(tracker, RoutePlace(*walk.truth[-1, 1:3].tolist()))
    tracker.take(portion_of(walk.chunks))
    assert [c.kind.value for c in guided.cues[-1:]] == ["arrived"]
    assert "ahead" in {c.kind.value for c in guided.cues}
    guided.write(tmp_path / "cues.csv")
    assert len((tmp_path / "cues.csv").read_text().splitlines()) == len(guided.cues) + 1
    assert guided.news() == guided.cues
    assert not guided.news()


@pytest.mark.long
def test_cues_of_a_run_and_of_its_replay_are_the_same(walk: Walk) -> None:
    """The gateway is silent in the middle: who waits for the end of a portion does not see that."""
    first_ns = walk.chunks[0].t_arrival_ns
    quiet = [c for c in walk.chunks if c.port != GATEWAY or not 6e9 < c.t_arrival_ns - first_ns < 14e9]
    told = []
    for size in (1, 700, len(quiet)):
        tracker = walk.tracker()
        guided = GuidedRun(tracker, RoutePlace(*walk.truth[-1, 1:3].tolist()))
        for begin in range(0, len(quiet), size):
            tracker.take(portion_of(quiet[begin : begin + size]))
        told.append([(c.t_s, c.kind.value, c.text, c.arrow_rad, c.spoken) for c in guided.cues])
    assert told[0] == told[1] == told[2]
    assert {"return", "ahead", "arrived"} <= {kind for _, kind, *_ in told[0]}


def test_a_place_that_no_way_leads_to_is_told(walk: Walk) -> None:
    room = np.array([[4.0, 14.0, 6.0, 14.0], [6.0, 14.0, 6.0, 18.0], [6.0, 18.0, 4.0, 18.0], [4.0, 18.0, 4.0, 14.0]])
    level = walk.plan.levels[0]
    closed = replace(walk.plan, levels=(replace(level, walls=np.concatenate([level.walls, room])),))
    tracker = Tracker(closed, walk.start, seed=SEED)
    guided = GuidedRun(tracker, RoutePlace(5.0, 16.0))
    tracker.take(portion_of(walk.chunks[: len(walk.chunks) // 3]))
    assert {(c.kind.value, c.arrow_rad) for c in guided.cues} == {("stop", None)}
    assert [c.spoken for c in guided.cues if c.spoken] == ["Stop. No way leads there from here."]


def test_destinations_are_rooms_or_places() -> None:
    assert destination("office 2", PLAN) == RoutePlace(9.4, 12.2)
    assert destination("3,2", PLAN) == RoutePlace(3.0, 2.0)
    assert destination("exit", PLAN) == EXIT
    for wrong in ("kitchen", "1,2,9", "nan,1", "1,2,3,4"):
        with pytest.raises(EchostepError, match="Office 1"):
            destination(wrong, PLAN)


def test_simulated_gateway_speaks_to_a_port_that_nobody_listens_to(walk: Walk, tmp_path: Path) -> None:
    np.savetxt(tmp_path / "truth.csv", walk.truth[:200], delimiter=",", header="t_s,x,y,heading_rad,z", comments="")
    arguments = ["beacons", "simulate", "--plan", str(DEMO), "--truth", "truth.csv", "--pace", "100"]
    run = echostep(*arguments, "--to", "udp://127.0.0.1:9", cwd=tmp_path, ends=0)
    assert "bytes sent" in run.stdout
    run = echostep(*arguments, "--to", "/dev/nowhere", cwd=tmp_path, ends=2)
    assert run.stderr.startswith("echostep: /dev/nowhere")
