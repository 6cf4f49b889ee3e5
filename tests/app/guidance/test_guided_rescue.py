# SPDX-License-Identifier: MIT
"""A rescuer is guided to another wearer: over floors, when that wearer moves, and the same in a replay."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from board_runs import ROOT
from echostep.errors import EchostepError
from echostep.localization import Estimate, TrackStatus
from echostep.plan import Plan, Pose, load_plan
from echostep.ports.chunks import TEAM, Chunk, portion_of
from echostep.tracker import Tracker
from echostep_app.guidance.cues import CueKind
from echostep_app.guidance.guided_rescue import GuidedRescue
from echostep_app.guidance.guided_run import guidance_of
from echostep_app.plan.routing import Route
from echostep_app.ports.teammate import Teammate, parse_teammate
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import Scenario
from echostep_simulation.world.tower import tower

TOWER = tower(3)
DEMO = load_plan(ROOT / "host/core/echostep/plans/demo.json")


def rescuer(plan: Plan) -> tuple[Tracker, GuidedRescue]:
    tracker = Tracker(plan, Pose(12.0, 2.5, 0.0))
    guided = guidance_of(tracker, "wearer:Kim")
    assert isinstance(guided, GuidedRescue)
    return tracker, guided


def stands(tracker: Tracker, t_s: float, x_m: float, y_m: float, level: int, heading_rad: float = 0.0) -> None:
    """An estimate as the tracker publishes it."""
    levels = tuple(float(k == level) for k in range(len(tracker.plan.levels)))
    at = Estimate(t_s, x_m, y_m, 0.01, 0.0, 0.01, heading_rad, 0.1, 1, TrackStatus.TRACKING, level, levels)
    for watch in tracker.watchers:
        watch(None, at)


def tell(tracker: Tracker, kim: Teammate) -> None:
    tracker.feed(Chunk(TEAM, 0, kim.encode()))


def along(route: Route) -> Iterator[tuple[float, float, int, float]]:
    """Places half a metre apart on a route, with the direction to the next."""
    for stretch in route.stretches:
        line = stretch.line_m
        for (x0, y0), (x1, y1) in zip(line.tolist(), line[1:].tolist(), strict=False):
            for share in np.arange(0.0, 1.0, 0.5 / max(math.hypot(x1 - x0, y1 - y0), 0.5)).tolist():
                yield x0 + share * (x1 - x0), y0 + share * (y1 - y0), stretch.level, math.atan2(y1 - y0, x1 - x0)
        yield float(line[-1, 0]), float(line[-1, 1]), stretch.level, 0.0


def test_a_rescuer_is_led_over_the_stairs_to_the_other_wearer() -> None:
    tracker, guided = rescuer(TOWER)
    stands(tracker, 0.0, 12.0, 2.5, 0)
    assert (guided.cues[-1].kind, guided.cues[-1].spoken) == (CueKind.STOP, "Stop. The place of Kim is not known yet.")
    tell(tracker, Teammate("Kim", 14.0, 2.5, 2, 0.4, "on 2, in corridor"))
    stands(tracker, 1.0, 12.0, 2.5, 0)
    assert guided.cues[-1].spoken.startswith("Kim is on 2, in corridor. ")
    assert guided.route
    assert [stretch.level for stretch in guided.route.stretches] in ([0, 1, 2], [0, 2])  # stairs, or the lift
    for k, (x, y, level, heading) in enumerate(along(guided.route)):
        stands(tracker, 2.0 + 0.5 * k, x, y, level, heading)
    kinds = [cue.kind for cue in guided.cues]
    assert CueKind.CHANGE in kinds
    assert CueKind.OFF not in kinds
    assert (guided.cues[-1].kind, guided.cues[-1].text) == (CueKind.ARRIVED, "Kim is here")


def test_a_wearer_who_moves_is_followed_and_it_is_said() -> None:
    tracker, guided = rescuer(DEMO)
    tell(tracker, Teammate("Kim", 12.0, 7.5, 0, 0.4))
    stands(tracker, 0.0, 2.0, 7.5, 0)
    tell(tracker, Teammate("Kim", 12.5, 7.5, 0, 0.4))
    stands(tracker, 5.0, 2.5, 7.5, 0)
    assert not any("moved" in cue.spoken for cue in guided.cues)  # half a metre
    tell(tracker, Teammate("Kim", 20.0, 7.5, 0, 3.0))
    stands(tracker, 10.0, 3.0, 7.5, 0)
    assert guided.cues[-1].spoken.startswith("Kim has moved.")
    assert guided.route
    assert guided.route.stretches[-1].line_m[-1].tolist() == pytest.approx([20.0, 7.5], abs=0.3)
    stands(tracker, 20.0, 19.8, 7.5, 0)
    assert guided.cues[-1].text == "Kim is here: within 3 m of you"


@given(st.binary(max_size=600) | st.sampled_from([
    Teammate("Eve", 1.0, 1.0, 0, 1.0).encode(), Teammate("Kim", 1.0, 1.0, 7, 1.0).encode(),
    b'{"name":"Kim","x_m":1e999,"y_m":0,"level":0,"radius_m":1}', b"[" * 500,
]))  # fmt: skip
def test_hostile_places_are_counted_and_lead_nowhere(payload: bytes) -> None:
    tracker, guided = _SHARED
    before = guided.bad
    tracker.feed(Chunk(TEAM, 0, payload))
    if payload:
        assert guided.bad == before + 1
    stands(tracker, 0.0, 12.0, 2.5, 0)
    assert guided.cues[-1].kind is CueKind.STOP


_SHARED = rescuer(DEMO)


def test_a_place_comes_back_from_its_bytes() -> None:
    kim = Teammate("Kim", 1.25, -2.5, 3, 0.4, "on 3, near stairs B")
    assert parse_teammate(kim.encode()) == kim


def test_a_rescue_needs_a_name_and_a_plan() -> None:
    with pytest.raises(EchostepError, match="wearer:NAME"):
        guidance_of(Tracker(DEMO), "wearer:")


@pytest.mark.slow
def test_a_replay_gives_the_same_cues() -> None:
    scenario = Scenario(DEMO, ((2.0, 7.5), (9.5, 7.5), (9.5, 10.8)), 5, PythonBoard(seed=5))
    chunks = list(scenario.chunks())
    for k, kim in enumerate((Teammate("Kim", 9.5, 10.8, 0, 0.4), Teammate("Kim", 20.0, 7.5, 0, 0.4))):
        at = (k + 1) * len(chunks) // 3
        chunks.insert(at, Chunk(TEAM, chunks[at].t_arrival_ns, kim.encode()))
    runs = []
    for size in (20, 5000):
        tracker = Tracker(DEMO, scenario.start, seed=1)
        guided = GuidedRescue(tracker, "Kim")
        for k in range(0, len(chunks), size):
            tracker.take(portion_of(chunks[k : k + size]))
        runs.append([replace(cue, left_m=0.0 if math.isnan(cue.left_m) else cue.left_m) for cue in guided.cues])
        assert tracker.front_end.counts.unknown_ports == 0
    assert runs[0] == runs[1]
    assert any(cue.spoken.startswith("Kim has moved.") for cue in runs[0])
