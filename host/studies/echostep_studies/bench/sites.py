# SPDX-License-Identifier: MIT
"""The buildings of the studies, and a walk through each.

In: a seed. Out: `Site`: the building as it stands, and waypoints. Owns nothing.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from importlib.resources import files
from itertools import pairwise
from pathlib import Path

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.plan import Level, Plan, Pose, load_plan
from echostep_app.plan.routing import RoutePlace
from echostep_simulation.people.walker import Waypoint
from echostep_simulation.world.tower import CORRIDOR_Y, LENGTH_M, LIFT_AT, STOREY_M, tower
from echostep_studies.bench.tours import random_tour
from echostep_studies.simulation.sites import hall as hall_site

WESTPORT = Path("maps") / "westport-house.json"  # in the folder of the public recordings
OFFICE_PLAN = Path(str(files("echostep"))) / "plans" / "demo.json"
STOREYS = 3
# Of its rooms along the corridor: number, width, and y of their walls
ROOMS, ROOM_M, CORRIDOR_M, SOUTH_M, NORTH_M = (4, 7.0, 3.0, -4.0, 7.0)
TOUR_M = 90.0  # least length of a tour
OFFICE_DOOR, LOBBY = RoutePlace(2.0, 7.5), RoutePlace(LIFT_AT[0] - 2.0, CORRIDOR_Y)  # from where all places are reached
EXIT_M = 1.2  # width of the door to the yard
WEST_WALL = (1.0, 1.0, 1.0, 8.5)  # of the office, in which that door is


@dataclass(frozen=True, slots=True)
class Site:
    """A building as it stands, and the waypoints of a walk through it."""

    built: Plan
    waypoints: tuple[Waypoint, ...]


def westport_in(data: Path | None) -> Path | None:
    """The plan of westport-house in a folder of public recordings; None without a folder; raises EchostepError where it is not in there."""
    path = None if data is None else data / WESTPORT
    if path is not None and not path.is_file():
        raise EchostepError(f"{path}: not there: without --data its rows are left out")
    return path


def office(seed: int, length_m: float = TOUR_M) -> Site:
    """A tour of the demo office."""
    plan = load_plan(OFFICE_PLAN)
    return Site(plan, random_tour(plan, OFFICE_DOOR, length_m, np.random.default_rng([seed, 70]), anywhere=True))


def three_floors(seed: int) -> Site:
    """A tour of a building of three storeys that are alike but for their doors."""
    plan = tower(STOREYS)
    return Site(plan, random_tour(plan, LOBBY, TOUR_M, np.random.default_rng([seed, 71]), anywhere=True))


def one_floor(seed: int, level: int) -> Site:
    """A tour of one level of that building, which is all there is of it."""
    plan = level_alone(tower(STOREYS), level)
    return Site(plan, random_tour(plan, LOBBY, TOUR_M, np.random.default_rng([seed, 72]), anywhere=True))


def by_lift(seed: int) -> Site:
    """A tour of the lowest level, the lift to the highest, and a tour there."""
    plan, rng = tower(STOREYS), np.random.default_rng([seed, 73])
    before = random_tour(level_alone(plan, 0), LOBBY, 0.5 * TOUR_M, rng)
    after = random_tour(level_alone(plan, STOREYS - 1), LOBBY, TOUR_M, rng)
    z = (STOREYS - 1) * STOREY_M
    ride: list[Waypoint] = [(*LIFT_AT, 0.0, 0.0), (*LIFT_AT, 0.0, z)]
    return Site(plan, (*reversed(before), *ride, *((w[0], w[1], 0.0, z) for w in after)))


def westport_house(seed: int, data: Path) -> Site:
    """A tour of westport-house, a real plan of seven floors; `data`: folder of the public recordings."""
    plan = load_plan(data / WESTPORT)
    stairs = next(c for c in plan.connectors if c.kind == "stairs" and len(c.levels) == len(plan.levels))
    x, y = stairs.outline_m.mean(axis=0).tolist()
    rng = np.random.default_rng([seed, 74])
    begin = RoutePlace(x, y, int(rng.integers(len(plan.levels))))
    return Site(plan, random_tour(plan, begin, TOUR_M, rng, anywhere=True))


def hall(_seed: int) -> Site:
    """A corridor, a hall whose walls are out of range for most of the way, and the corridor again."""
    site = hall_site()
    return Site(plan_of("hall", site.built), tuple((x, y) for x, y in site.route.tolist()))


def yard(seed: int) -> Site:
    """The demo office with a door to the outside: a tour, out for about 50 m, round a corner of the building, in again, a tour."""
    plan, rng = load_plan(OFFICE_PLAN), np.random.default_rng([seed, 75])
    x, low, _, high = WEST_WALL
    y = 7.5
    sides = [[x, low, x, y - 0.5 * EXIT_M], [x, y + 0.5 * EXIT_M, x, high]]
    walls = plan.levels[0].walls
    opened = plan_of("office with a door", np.vstack([walls[(walls != WEST_WALL).any(1)], sides]))
    inside = RoutePlace(3.5, y)
    before, after = (random_tour(plan, inside, share * TOUR_M, rng) for share in (0.4, 0.7))
    out: list[Waypoint] = [(-2.0, y), (-12.0, y), (-12.0, -6.0), (-3.0, -6.0), (-3.0, y)]
    return Site(opened, (*reversed(before), *out, *after))


def room_at(x_m: float, y_m: float) -> Floats:
    """Outline (4, 2) of the room, or of the corridor, of the building of three storeys that holds a place."""
    corridor = 0.0 <= y_m <= CORRIDOR_M
    west, east = (0.0, LENGTH_M)
    if not corridor:
        edges = [0.0, *(ROOM_M * k for k in range(1, ROOMS)), LENGTH_M]
        west, east = next((a, b) for a, b in pairwise(edges) if a <= x_m <= b)
    south, north = (0.0, CORRIDOR_M) if corridor else (SOUTH_M, 0.0) if y_m < 0.0 else (CORRIDOR_M, NORTH_M)
    return np.array([(west, south), (east, south), (east, north), (west, north)])


def level_alone(plan: Plan, level: int) -> Plan:
    """A plan of one of the levels, at height 0, without connectors."""
    return replace(plan, levels=(replace(plan.levels[level], height_m=0.0),), connectors=(), start=None)


def plan_of(name: str, walls: Floats, start: Pose | None = None) -> Plan:
    """A plan of one level from walls (n, 4)."""
    digest = hashlib.sha256(np.ascontiguousarray(walls).tobytes()).hexdigest()
    return Plan(name, (Level("0", 0.0, walls),), start, digest)
