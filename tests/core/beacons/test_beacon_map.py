# SPDX-License-Identifier: MIT
"""Beacons in the tracker: a simulated walk with a gateway is tracked, live and replayed alike, and floods of nonsense change nothing."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest

from beacons.beacon_walk import SEED, Walk, beacon_walk, heard, merged
from echostep.elementary import mean_angle
from echostep.localization import Start, digest
from echostep.localization.belief import CloudHypothesis
from echostep.plan import Pose
from echostep.ports.chunks import GATEWAY, Chunk, portion_of
from echostep.tracker import Tracker
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.people.walker import Waypoint
from echostep_simulation.scenario import Scenario
from walks import PLAN


@pytest.fixture(scope="module")
def walk() -> Walk:
    return beacon_walk()


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
    scenario = Scenario(PLAN, path, SEED, PythonBoard(seed=SEED))
    truth = scenario.truth
    places = np.array([(3.0, 7.4, 0.0), (8.5, 7.6, 1.0), (9.5, 10.8, 2.0)])
    after = np.where(np.arange(3)[:, None] == 1, 500.0, places)
    early = truth[:, 0] < min(dies_s, truth[-2, 0])
    tracker = Tracker(PLAN, scenario.start, seed=SEED)
    tracker.take(portion_of(merged(scenario.chunks(), heard(truth[early], places), heard(truth[~early], after))))
    assert tracker.filter
    found = tracker.filter.beacon_map.places(tracker.filter.cloud, truth[-1, 0])
    return {tracker.gateway.numbers[p.slot]: p.state.value for p in found}


@pytest.mark.slow
def test_a_beacon_that_dies_is_noticed_and_one_behind_a_wall_is_not_blamed() -> None:
    there_and_back = ((2.0, 7.5), (9.5, 7.5), (9.5, 10.6), (9.5, 7.5), (4.0, 7.5), (9.0, 7.5), (4.0, 7.5), (6.0, 7.5))
    assert states_at_the_end(there_and_back, 19.0) == {1: "well", 2: "silent", 3: "well"}
    into_the_corner = ((2.0, 7.5), (9.5, 7.5), (9.5, 10.6), (11.6, 9.4, 12.0), (11.7, 9.5))
    assert states_at_the_end(into_the_corner, math.inf) == {1: "well", 2: "well", 3: "well"}


@pytest.mark.slow
def test_nonsense_at_the_gateways_port_changes_no_estimate(walk: Walk) -> None:
    rng = random.Random(SEED)
    noise = [Chunk(GATEWAY, c.t_arrival_ns, rng.randbytes(200) + b"\0") for c in walk.alone[::200]]
    quiet, disturbed = walk.tracker(), walk.tracker()
    assert digest(quiet.take(portion_of(walk.alone))) == digest(disturbed.take(portion_of(merged(walk.alone, noise))))
    assert disturbed.gateway.counts.broken >= len(noise)
