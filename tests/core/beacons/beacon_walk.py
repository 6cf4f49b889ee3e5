# SPDX-License-Identifier: MIT
"""A simulated walk with a gateway."""

from __future__ import annotations

import heapq
from functools import cache
from importlib.resources import files
from operator import attrgetter
from pathlib import Path

import numpy as np

from echostep.plan import Plan, load_plan
from echostep.tracker import Tracker
from echostep_simulation.devices.beacon_gateway import BeaconWorld, gateway_chunks, lay_beacons
from echostep_simulation.devices.board import PythonBoard
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


@cache
def beacon_walk() -> Walk:
    return Walk()
