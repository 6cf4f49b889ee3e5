# SPDX-License-Identifier: MIT
"""Back without a plan: along the own way, loops cut where they close; simulated people who obey with errors come back (simulated)."""

from __future__ import annotations

import math
from collections import deque
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.localization import Estimate, TrackStatus
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan import NO_PLAN
from echostep.tracker import Tracker
from echostep_app.guidance.cues import Cue, CueKind
from echostep_app.guidance.guided_return import JOIN_M, STEP_M, GuidedReturn, OwnWay
from echostep_app.guidance.guided_run import guidance_of
from echostep_app.plan.polyline import way_m

MEASURED = MeasuredSegment(PathSegment(0.0, 1.0, 0.4, 0.0, 0.0, 0.0, 0.02, 0.0, 1), *np.empty((3, 0)))
CORNERS = np.array([(0.0, 0.0), (0.0, 20.0), (15.0, 20.0), (15.0, 35.0)])  # of a way in, m


def along(corners: Floats, step_m: float = 0.4) -> Floats:
    """Positions (n, 2) on a polyline."""
    pieces = [
        a + np.arange(0.0, np.hypot(*(b - a)), step_m)[:, None] * (b - a) / np.hypot(*(b - a))
        for a, b in zip(corners[:-1], corners[1:], strict=True)
    ]
    return np.concatenate([*pieces, corners[-1:]])


def guided(
    way_in: Floats, way_back: Floats, sd_m: float = 0.1, status: TrackStatus = TrackStatus.TRACKING
) -> list[Cue]:
    """The cues at the positions of the way back, one a second, the heading along the way."""
    tracker = SimpleNamespace(watchers=[], state=SimpleNamespace(beacon_heard_s=None))
    run, places = GuidedReturn(cast("Tracker", tracker), is_wanted=False), np.concatenate([way_in, way_back])
    headings = np.arctan2(*np.diff(places, axis=0, append=places[-1:]).T[::-1])
    for k, ((x, y), heading) in enumerate(zip(places.tolist(), headings.tolist(), strict=True)):
        run.is_wanted = k >= len(way_in)
        run._watch(MEASURED, Estimate(float(k), x, y, sd_m**2, 0.0, sd_m**2, heading, 0.05, k, status))
        assert run.is_wanted or not run.cues
    return run.cues


@pytest.mark.parametrize("drift_m", [0.0, 1.5])
def test_the_way_back_is_told_from_when_it_is_wanted_to_the_start(drift_m: float) -> None:
    """The way back is seen beside the way in: the track has drifted."""
    way_in, way_back = along(CORNERS), along(CORNERS[::-1])
    way_back[:, 0] += np.linspace(0.0, drift_m, len(way_back))
    back = guided(way_in, way_back, sd_m=0.1 + 0.3 * drift_m)
    assert back[0].spoken
    assert back[0].left_m == pytest.approx(50.0, abs=1.0)
    assert any(cue.kind is CueKind.TURN for cue in back)
    arrived = next(k for k, cue in enumerate(back) if cue.kind is CueKind.ARRIVED)
    assert all(abs(cue.arrow_rad or 0.0) < math.radians(100.0) for cue in back[5:arrived])
    assert (np.diff([cue.left_m for cue in back[:arrived]]) < 0.5).all()
    assert len(back) - arrived < 6


def test_a_long_way_leads_back_although_its_drift_is_great() -> None:
    """Ten metres of standard deviation since the start: the position is lost, the way back is not."""
    cues = guided(along(CORNERS), along(CORNERS[::-1]), sd_m=10.0, status=TrackStatus.LOST)
    assert any(cue.kind is CueKind.TURN for cue in cues)
    assert any(cue.kind is CueKind.ARRIVED for cue in cues)


def test_who_goes_on_in_is_told_to_come_back() -> None:
    cues = guided(along(CORNERS), along(np.array([CORNERS[-1], (15.0, 55.0)])))
    assert {cue.kind for cue in cues[20:]} <= {CueKind.TURN, CueKind.OFF}
    assert cues[-1].left_m == pytest.approx(70.0, abs=3.0)


def test_a_loop_is_cut_where_it_closes() -> None:
    way = OwnWay()
    for x, y in along(np.array([(0, 0), (0, 10), (10, 10), (10, 20), (0, 20), (0, 10.3), (-5, 10.3)], float)).tolist():
        way.add(x, y)
    assert way_m(way.line_m()) == pytest.approx(15.0, abs=1.5)


def test_another_storey_is_another_place() -> None:
    way = OwnWay()
    for k in range(21):
        way.add(0.5 * k, 0.0, 0.0)
    for k in range(21):
        way.add(10.0 - 0.5 * k, 0.1, 3.0)
    assert way_m(way.line_m()) > 19.0


@given(st.lists(st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)), min_size=2, max_size=40))
def test_the_way_back_is_the_shortest_through_the_positions(moves: list[tuple[float, float]]) -> None:
    """Against all joins that there were, relaxed until nothing changes, each position through earlier ones only."""
    way, kept = OwnWay(), [(0.0, 0.0)]
    way.add(0.0, 0.0)
    for x, y in np.cumsum(moves, axis=0).tolist():
        if math.dist(kept[-1], (x, y)) >= STEP_M:
            kept.append((x, y))
        way.add(x, y)
    back = [0.0] * len(kept)
    for k in range(1, len(kept)):
        joined = [j for j in range(k) if j == k - 1 or math.dist(kept[j], kept[k]) < JOIN_M]
        back[k] = min(back[j] + math.dist(kept[j], kept[k]) for j in joined)
    line = way.line_m()
    assert line[0] == pytest.approx(kept[-1])
    assert line[-1] == pytest.approx(kept[0])
    assert way_m(line) == pytest.approx(back[-1])


def test_without_a_plan_the_way_out_is_the_way_back() -> None:
    tracker: Any = Tracker(NO_PLAN)
    assert isinstance(guidance_of(tracker, "exit"), GuidedReturn)
    with pytest.raises(EchostepError, match="--guide Kitchen: without a plan the only destination is: exit"):
        guidance_of(tracker, "Kitchen")


RETURNS = 100
SPEED_M_S, PERIOD_S = 0.8, 0.5
OBEYS_RAD, DELAY = math.radians(15.0), 2  # error of a turn; periods until a cue is followed

# A metre of drift, per root of a metre, of the lengths
BIAS_RAD_M, NOISE_RAD, SCALE = (math.radians(0.02), math.radians(0.1), 0.007)
CLOSE_M = 2.0  # from the door
MOST_TIMES = 3  # the length of the way in that a return may take


class Walker:
    """A walker with a true pose and the track's, which drifts, both from the origin."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.true, self.track = np.zeros(2), np.zeros(2)
        self.heading_rad = self.drift_rad = 0.0
        self.bias_rad_m, self.scale = BIAS_RAD_M * rng.standard_normal(), 1.0 + SCALE * rng.standard_normal()
        self.t_s = self.gone_m = 0.0
        tracker = SimpleNamespace(watchers=[], state=SimpleNamespace(beacon_heard_s=None))
        self.guided = GuidedReturn(cast("Tracker", tracker))

    def step(self, heading_rad: float) -> None:
        """Walk for a period in a true direction; the track and the guidance follow."""
        length = SPEED_M_S * PERIOD_S
        self.heading_rad = heading_rad
        self.drift_rad += self.bias_rad_m * length + NOISE_RAD * math.sqrt(length) * self.rng.standard_normal()
        seen_rad = heading_rad + self.drift_rad
        self.true += length * np.array([math.cos(heading_rad), math.sin(heading_rad)])
        self.track += self.scale * length * np.array([math.cos(seen_rad), math.sin(seen_rad)])
        self.t_s += PERIOD_S
        self.gone_m += length
        variance = (0.1 + 0.01 * self.gone_m) ** 2
        x, y = self.track.tolist()
        e = Estimate(self.t_s, x, y, variance, 0.0, variance, seen_rad, 0.1, 1, TrackStatus.UNCERTAIN)
        self.guided._watch(MEASURED, e)


def walk_in(walker: Walker) -> None:
    """Five to ten corridors of 4 to 16 m, at right angles."""
    rng = walker.rng
    heading_rad = 0.0
    for _ in range(int(rng.integers(5, 11))):
        for _ in range(int(rng.uniform(4.0, 16.0) / (SPEED_M_S * PERIOD_S))):
            walker.step(heading_rad + 0.05 * rng.standard_normal())
        heading_rad += 0.5 * math.pi * float(rng.choice([-1.0, 1.0]))


def comes_back(seed: int) -> bool:
    """Whether a walker who turns round, and then does what the arrow shows, comes to the door."""
    walker = Walker(np.random.default_rng([seed, 17]))
    walk_in(walker)
    most_s = walker.t_s + MOST_TIMES * walker.t_s
    heading_rad = walker.heading_rad + math.pi
    arrows: deque[float] = deque()
    while walker.t_s < most_s:
        walker.step(heading_rad)
        if np.hypot(*walker.true) < CLOSE_M:
            return True
        if (arrow_rad := walker.guided.cues[-1].arrow_rad) is not None:
            arrows.append(heading_rad + arrow_rad)
        if len(arrows) > DELAY:
            heading_rad = arrows.popleft() + OBEYS_RAD * walker.rng.standard_normal()
    return False


@pytest.mark.slow
def test_nearly_all_come_back_to_the_door() -> None:
    assert sum(comes_back(seed) for seed in range(RETURNS)) >= 0.97 * RETURNS
