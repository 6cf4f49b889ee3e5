# SPDX-License-Identifier: MIT
"""A simulated walk with a gateway, and what any gateway hears on a simulated walk."""

from __future__ import annotations

import heapq
from collections.abc import Iterable
from functools import cache
from operator import attrgetter

import numpy as np

from echostep.arrays import Floats
from echostep.ports.chunks import Chunk
from echostep.tracker import Tracker
from echostep_simulation.devices.beacon_gateway import BeaconWorld, gateway_chunks, lay_beacons
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import START_NS, Scenario
from walks import PLAN

SEED = 5


def heard(truth: Floats, places: Floats) -> list[Chunk]:
    """What a gateway hears, on a true path (n, 3 or more) in the demo office, of beacons at these places (k, 3)."""
    arrival_ns = START_NS + np.rint(1e9 * truth[:, 0]).astype(np.int64)
    world = BeaconWorld(places, PLAN.levels[0].walls)
    return list(gateway_chunks(world, truth[:, 0], truth[:, 1:3], arrival_ns, SEED))


def merged(*streams: Iterable[Chunk]) -> list[Chunk]:
    """Chunks in order of arrival."""
    return list(heapq.merge(*streams, key=attrgetter("t_arrival_ns")))


class Walk:
    def __init__(self) -> None:
        self.plan = PLAN
        scenario = Scenario(self.plan, ((2.0, 7.5), (22.0, 7.5)), SEED, PythonBoard(seed=SEED))
        self.start, self.truth = scenario.start, scenario.truth
        self.alone = list(scenario.chunks())
        scenario.close()
        self.places = lay_beacons(self.truth[:, 1:3], 5.0, np.random.default_rng(SEED))
        self.chunks = merged(self.alone, heard(self.truth, self.places))

    def tracker(self) -> Tracker:
        return Tracker(self.plan, self.start, seed=SEED)


@cache
def beacon_walk() -> Walk:
    return Walk()
