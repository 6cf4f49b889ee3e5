# SPDX-License-Identifier: MIT
"""Beacons in the tracker: a simulated walk with a gateway is tracked, live and replayed alike, and floods of nonsense change nothing."""

from __future__ import annotations

import heapq
import math
import random
from dataclasses import replace
from importlib.resources import files
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest

from command_line import echostep
from echostep.aiding.beacons.beliefs import BeaconBeliefs, moments
from echostep.angles import mean_angle
from echostep.errors import EchostepError
from echostep.localization import Start, digest
from echostep.localization.belief import CloudHypothesis
from echostep.plan import Plan, Pose, load_plan
from echostep.ports.chunks import GATEWAY, Chunk, portion_of
from echostep.tracker import Tracker
from echostep_app.guidance.guided_run import GuidedRun, destination
from echostep_app.plan.routing import RoutePlace
from echostep_simulation.devices.beacon_gateway import BeaconWorld, gateway_chunks, lay_beacons
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.people.walker import Waypoint
from echostep_simulation.scenario import START_NS, Scenario

SEED = 5


def demo() -> Plan:
    return load_plan(Path(str(files("echostep") / "plans" / "demo.json")))


class Walk:
    def __init__(self) -> None:
        self.plan = demo()
        scenario = Scenario(self.plan, ((2.0, 7.5), (22.0, 7.5)), SEED, PythonBoard(seed=SEED))
        self.start, self.truth = scenario.start, scenario.truth
        self.alone = list(scenario.chunks())
        scenario.close()
        self.places = lay_beacons(self.truth[:, 1:3], 5.0, np.random.default_rng(SEED))
        arrival_ns = START_NS + np.rint(1e9 * self.truth[:, 0]).astype(np.int64)
        world = BeaconWorld(self.places, self.plan.levels[0].walls)
        said = gateway_chunks(world, self.truth[:, 0], self.truth[:, 1:3], arrival_ns, SEED)
        self.chunks = list(heapq.merge(self.alone, said, key=attrgetter("t_arrival_ns")))

    def tracker(self) -> Tracker:
        return Tracker(self.plan, self.start, seed=SEED)


@pytest.fixture(scope="module")
def walk() -> Walk:
    return Walk()


@pytest.mark.long
def test_live_and_replay_agree_bit_for_bit_and_beacons_are_found(walk: Walk) -> None:
    live, replayed = walk.tracker(), walk.tracker()
    one = [e for chunk in walk.chunks for e in live.feed(chunk)]
    rng, two, rest = random.Random(SEED), [], walk.chunks
    while rest:
        cut = rng.randrange(1, 900)
        two += replayed.take(portion_of(rest[:cut]))
        rest = rest[cut:]
    assert digest(one) == digest(two)
    assert live.gateway.counts.words > 100
    assert live.filter is not None
    places = live.filter.beacon_map.places(live.filter.cloud, one[-1].t_s)
    assert len(places) >= 3
    for p in places:
        x, y, _ = walk.places[live.gateway.numbers[p.slot] - 1]
        assert np.hypot(p.x_m - x, p.y_m - y) < 0.8
    end = walk.truth[-1, 1:3]
    assert np.hypot(one[-1].x_m - end[0], one[-1].y_m - end[1]) < 0.3


@pytest.mark.slow
def test_another_cloud_that_is_tracked_from_now_on_locates_the_beacons_anew(walk: Walk) -> None:
    """A search that is followed has placed no beacon, and those of the wrong cloud are not where it put them."""
    tracker = walk.tracker()
    half = len(walk.chunks) // 2
    tracker.take(portion_of(walk.chunks[:half]))
    at, before = tracker.state.estimate, tracker.filter
    assert at is not None
    assert before is not None
    assert tracker.beacon_places(at.t_s)
    near = Start(Pose(at.x_m, at.y_m, at.heading_rad, at.level), 0.2)
    walk_rad = mean_angle(before.cloud.turn_rad, before.cloud.weight)
    before.belief.tracked = CloudHypothesis(before.new_cloud(near, at.heading_rad - walk_rad), 0.0)
    assert tracker.beacon_places(at.t_s) == []
    assert not tracker.own_beacons()
    last = tracker.take(portion_of(walk.chunks[half:]))[-1]
    places = tracker.beacon_places(last.t_s)
    assert places
    for p in places:
        x, y, _ = walk.places[tracker.gateway.numbers[p.slot] - 1]
        assert np.hypot(p.x_m - x, p.y_m - y) < 1.0


def states_at_the_end(path: tuple[Waypoint, ...], dies_s: float) -> dict[int, str]:
    """The states of the beacons about a walk in the corridor, of which number 2 dies."""
    plan = demo()
    scenario = Scenario(plan, path, SEED, PythonBoard(seed=SEED))
    t_s, xy_m = scenario.truth[:, 0], scenario.truth[:, 1:3]
    places = np.array([(3.0, 7.4, 0.0), (8.5, 7.6, 1.0), (9.5, 10.8, 2.0)])
    after = np.where(np.arange(3)[:, None] == 1, 500.0, places)
    arrival_ns = START_NS + np.rint(1e9 * t_s).astype(np.int64)
    walls, early = plan.levels[0].walls, t_s < min(dies_s, t_s[-2])
    said = [
        *gateway_chunks(BeaconWorld(places, walls), t_s[early], xy_m[early], arrival_ns[early], SEED),
        *gateway_chunks(BeaconWorld(after, walls), t_s[~early], xy_m[~early], arrival_ns[~early], SEED),
    ]
    tracker = Tracker(plan, scenario.start, seed=SEED)
    tracker.take(portion_of(list(heapq.merge(scenario.chunks(), said, key=attrgetter("t_arrival_ns")))))
    assert tracker.filter
    found = tracker.filter.beacon_map.places(tracker.filter.cloud, t_s[-1])
    return {tracker.gateway.numbers[p.slot]: p.state.value for p in found}


@pytest.mark.slow
def test_a_beacon_that_dies_is_noticed_and_one_behind_a_wall_is_not_blamed() -> None:
    there_and_back = ((2.0, 7.5), (9.5, 7.5), (9.5, 10.6), (9.5, 7.5), (4.0, 7.5), (9.0, 7.5), (4.0, 7.5), (6.0, 7.5))
    assert states_at_the_end(there_and_back, 19.0) == {1: "well", 2: "silent", 3: "well"}
    into_the_corner = ((2.0, 7.5), (9.5, 7.5), (9.5, 10.6), (11.6, 9.4, 12.0), (11.7, 9.5))
    assert states_at_the_end(into_the_corner, math.inf) == {1: "well", 2: "well", 3: "well"}


def test_moments_are_those_of_the_mixture() -> None:
    rng = np.random.default_rng(SEED)
    n, b = 500, 3
    beliefs = BeaconBeliefs(rng.normal(40.0, 2.0, (n, b, 3)), rng.uniform(0.1, 1.0, (n, b, 6)), np.zeros((n, b)))
    weight = rng.uniform(size=n)
    weight /= weight.sum()
    for k, (x, y, sd, axis) in enumerate(moments(beliefs, weight)):
        m, c = beliefs.mean[:, k], beliefs.cov[:, k]
        assert (x, y) == pytest.approx((weight @ m[:, 0], weight @ m[:, 1]))
        assert 2.0 * sd**2 == pytest.approx(weight @ ((m[:, 0] - x) ** 2 + (m[:, 1] - y) ** 2 + c[:, 0] + c[:, 3]))
        assert axis == pytest.approx(math.atan2(weight @ np.sin(m[:, 2]), weight @ np.cos(m[:, 2])))


@pytest.mark.slow
def test_nonsense_at_the_gateways_port_changes_no_estimate(walk: Walk) -> None:
    rng = random.Random(SEED)
    noise = [Chunk(GATEWAY, c.t_arrival_ns, rng.randbytes(200) + b"\0") for c in walk.alone[::200]]
    noisy = list(heapq.merge(walk.alone, noise, key=attrgetter("t_arrival_ns")))
    quiet, disturbed = walk.tracker(), walk.tracker()
    assert digest(quiet.take(portion_of(walk.alone))) == digest(disturbed.take(portion_of(noisy)))
    assert disturbed.gateway.counts.broken >= len(noise)


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
    plan = demo()
    assert destination("office 2", plan) == RoutePlace(9.4, 12.2)
    assert destination("3,2", plan) == RoutePlace(3.0, 2.0)
    assert destination("start", plan) == RoutePlace(2.0, 7.5)
    for wrong in ("kitchen", "1,2,9", "nan,1", "1,2,3,4"):
        with pytest.raises(EchostepError, match="Office 1"):
            destination(wrong, plan)


def test_simulated_gateway_speaks_to_a_port_that_nobody_listens_to(walk: Walk, tmp_path: Path) -> None:
    np.savetxt(tmp_path / "truth.csv", walk.truth[:200], delimiter=",", header="t_s,x,y,heading_rad,z", comments="")
    plan = Path(str(files("echostep") / "plans" / "demo.json"))
    arguments = [
        "beacons",
        "simulate",
        "--plan",
        str(plan),
        "--truth",
        "truth.csv",
        "--pace",
        "100",
    ]
    run = echostep(*arguments, "--to", "udp://127.0.0.1:9", cwd=tmp_path, ends=0)
    assert "bytes sent" in run.stdout
    run = echostep(*arguments, "--to", "/dev/nowhere", cwd=tmp_path, ends=2)
    assert run.stderr.startswith("echostep: /dev/nowhere")
