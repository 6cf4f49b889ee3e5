# SPDX-License-Identifier: MIT
"""The walk of one operation, and the tracker's estimates of it.

In: a seed. Out: `OperationWalk`. Owns the manners of moving. Simulated; the whole tracker runs, from the bytes of the simulated board and MTx.

[ISO/IEC 18305:2016, annex on scenarios] has people walk, run, climb stairs, ride lifts, walk backward, sidestep and crawl. Strides are assumed from
indoor habits: runs at 3 m/s, crawls at 0.5 m/s. The simulated body stays upright and its foot stands in every stride: a run has a stance of
0.3 s, a crawl is a walk in very short strides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats, spans
from echostep.localization import Estimate, Start
from echostep.plan import Plan
from echostep.tracker import Tracker
from echostep_app.plan.routing import RoutePlace
from echostep_app.session.last_place import start_after
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.people.walker import Manner, Person, Waypoint
from echostep_simulation.scenario import START_NS, Scenario
from echostep_simulation.world.tower import STOREY_M, tower
from echostep_studies.bench.sites import LOBBY
from echostep_studies.bench.tours import random_tour
from echostep_studies.bench.walks import CORNER_M, tracked

STOREYS = 3
HALF_M = 400.0  # length of the way before the change of the battery, and of that after it: twenty minutes in all
CHANGE_S = 60.0  # without any byte, while the wearer stands
WALK = Manner("walk", 1.3, 1.1)
MANNERS = (
    WALK, Manner("run", 2.2, 0.74), WALK, Manner("backward", 0.9, 1.2, math.pi), WALK,
    Manner("sidestep", 0.6, 1.1, 0.5 * math.pi), WALK, Manner("crawl", 0.65, 1.3),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class OperationWalk:
    """Estimates before and after the change of the battery, which ends at `restart_s`; `truth` (n, 5): t_s, x, y, heading, height of the floor.

    `after`: of a new tracker that knows nothing; `resumed`: of one that begins where the first ended, as with `--start last`.
    `manners`: when each piece of the way begins, and how it is moved along.
    """

    plan: Plan
    truth: Floats
    before: list[Estimate]
    after: list[Estimate]
    resumed: list[Estimate]
    restart_s: float
    manners: tuple[tuple[float, str], ...]


def operation(seed: int, half_m: float = HALF_M) -> OperationWalk:
    """An operation from a known start; after the change of the battery one new tracker knows nothing, another one the last place."""
    plan = tower(STOREYS)
    way, stop = waypoints(plan, seed, half_m)
    person = Person(corner_m=CORNER_M, manners=MANNERS)
    scenario = Scenario(plan, way, seed, PythonBoard(seed), person)
    chunks = list(scenario.chunks())
    change_s = _standing_s(scenario.truth, way[stop])
    change_ns = [START_NS + int(1e9 * (change_s + s)) for s in (0.0, CHANGE_S)]
    early = [c for c in chunks if c.t_arrival_ns < change_ns[0]]
    late = [c for c in chunks if c.t_arrival_ns >= change_ns[1]]
    first = Tracker(plan, scenario.start, seed=seed)
    before, last = tracked(first, early), first.last_place()
    start = Start() if last is None else start_after(last, CHANGE_S, first.settings.climb)
    return OperationWalk(
        plan, scenario.truth, before, tracked(Tracker(plan, Start(), seed=seed), late),
        tracked(Tracker(plan, start, seed=seed), late), change_s + CHANGE_S, scenario.walk.manners,
    )  # fmt: skip


def waypoints(plan: Plan, seed: int, half_m: float) -> tuple[list[Waypoint], int]:
    """Two tours with a stop in between, and the number of that stop."""
    rng = np.random.default_rng([seed, 80])
    first = random_tour(plan, LOBBY, half_m, rng, anywhere=True)
    x, y, _, z = (*first[-1], 0.0, 0.0)[:4]
    second = random_tour(plan, RoutePlace(x, y, round(z / STOREY_M)), half_m, rng)
    return [*first[:-1], (x, y, CHANGE_S + 4.0, z), *second[1:]], len(first) - 1


def _standing_s(truth: Floats, stop: Waypoint) -> float:
    """Two seconds after the wearer has come to rest at a stop."""
    still = np.hypot(truth[:, 1] - stop[0], truth[:, 2] - stop[1]) < 0.2
    begin, _ = max(spans(still), key=lambda stay: stay[1] - stay[0])
    return float(truth[begin, 0]) + 2.0
