# SPDX-License-Identifier: MIT
"""Two wearers who walk the same corridor, with what the first one tells of its beacons."""

from __future__ import annotations

import random
from dataclasses import dataclass
from functools import cache

import numpy as np

from beacons.beacon_walk import SEED, heard, merged
from echostep.aiding import AidedFilter
from echostep.localization import Building, Estimate, Start
from echostep.localization.belief import Belief
from echostep.plan import Pose
from echostep.ports.chunks import Chunk, portion_of
from echostep.ports.people.team_beacons import TEAM_BEACONS, SharedBeacon, TeamBeacons
from echostep.tracker import Tracker
from echostep.walls.level_sheet import lay_out_levels
from echostep_simulation.devices.beacon_gateway import lay_beacons
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import Scenario
from walks import PLAN

LAID_OUT = lay_out_levels(PLAN)
BUILDING = Building(LAID_OUT.walls, LAID_OUT.sheet)


def told(*beacons: SharedBeacon, name: str = "kim") -> TeamBeacons:
    return TeamBeacons(1, name, "0000beac", PLAN.digest, beacons)


def filter_at(x_m: float, y_m: float, sd_m: float = 0.15, right: float = 0.99) -> AidedFilter:
    """A filter whose cloud is about a place, and right with this probability."""
    made = AidedFilter(BUILDING, Start(Pose(x_m, y_m, 0.0), sd_m), 0.0, np.random.default_rng(3))
    made.belief = Belief(made.belief.tracked.cloud, right, 1.0)
    return made


@dataclass
class Two:
    """Two wearers who walk the same corridor: the first one lays beacons, the second one hears them."""

    beacons: tuple[SharedBeacon, ...]
    true_places: list[tuple[float, float]]
    chunks: list[Chunk]
    start: Pose

    def run(self, message: TeamBeacons | None, size: int = 5000) -> tuple[Tracker, list[Estimate]]:
        """The second wearer, whose start is known to 1 m, with the message at the beginning."""
        tracker = Tracker(PLAN, Start(self.start, 1.0), seed=SEED)
        first = [] if message is None else [Chunk(TEAM_BEACONS, self.chunks[0].t_arrival_ns, message.encode())]
        chunks, found, rng = first + self.chunks, [], random.Random(SEED)
        while chunks:
            cut = rng.randrange(1, size)
            found += tracker.take(portion_of(chunks[:cut]))
            chunks = chunks[cut:]
        return tracker, found


@cache
def two_wearers() -> Two:
    scenario = Scenario(PLAN, ((2.0, 7.5), (16.0, 7.5)), SEED, PythonBoard(seed=SEED))
    truth = scenario.truth
    places = lay_beacons(truth[:, 1:3], 5.0, np.random.default_rng(SEED))
    chunks = merged(scenario.chunks(), heard(truth, places))
    placing = Tracker(PLAN, scenario.start, seed=1)
    placing.take(portion_of(chunks))
    beacons = placing.own_beacons()
    assert beacons is not None
    return Two(beacons, [(x, y) for x, y, _ in places.tolist()], chunks, scenario.start)
