# SPDX-License-Identifier: MIT
"""No tour of a simulated person meets a wall."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest
import shapely

from echostep.arrays import Floats
from echostep.plan import Connector, Level, Plan, load_plan
from echostep_app.guidance.tours import room_tour, tour
from echostep_app.plan.routing import RoutePlace
from echostep_simulation.people.walker import RATE_HZ, Person, Waypoint, walk
from echostep_simulation.world.tower import tour as tower_tour
from echostep_simulation.world.tower import tower
from echostep_studies.bench import sites
from echostep_studies.floors.storeys import through
from echostep_studies.frame.recordings import DATA
from echostep_studies.noplan import sites as drawn_sites
from echostep_studies.operation.walks import waypoints as operation_waypoints
from needs_data import needs_data

PERSON = Person(corner_m=0.3)  # as in the studies
STOREY_M, INNER_M, OUTER_M = 3.5, 2.0, 3.2  # of a quarter of a winding stair about the origin
TOUR_M = 300.0
WESTPORT = DATA / sites.WESTPORT


def walked(way: Sequence[Waypoint], seed: int) -> Floats:
    """Trunk and height of the floor (n, 3) every 20 ms, as `Scenario` has them."""
    person = walk(way, PERSON, np.random.default_rng([seed, 3]))
    return np.column_stack([person.trunk_m, person.height_m])[:: RATE_HZ // 50]


def in_walls(plan: Plan, path: Floats) -> list[tuple[int, float, float]]:
    """Level, x and y wherever a path (n, 3) meets a wall of the level nearest to its height."""
    heights = np.array([level.height_m for level in plan.levels])
    nearest = np.abs(path[:, 2, None] - heights).argmin(1)
    met: list[tuple[int, float, float]] = []
    for k, level in enumerate(plan.levels):
        at = np.flatnonzero((nearest[1:] == k) & (nearest[:-1] == k))
        steps = shapely.linestrings(np.stack([path[at, :2], path[at + 1, :2]], axis=1))
        walls = shapely.STRtree(shapely.linestrings(level.solid.reshape(-1, 2, 2)))
        steps_met = np.unique(walls.query(steps, predicate="intersects")[0])
        met += [(k, float(x), float(y)) for x, y, _ in path[at[steps_met]].round(2)]
    return met


def winding_stairs() -> Plan:
    """Two levels with a quarter of a ring of stairs between two round walls, in a room of 12 m."""
    turn = np.linspace(0.0, 0.5 * math.pi, 16)
    inner, outer = (r * np.column_stack([np.cos(turn), np.sin(turn)]) for r in (INNER_M, OUTER_M))
    room = np.array([(-6.0, -6.0), (6.0, -6.0), (6.0, 6.0), (-6.0, 6.0), (-6.0, -6.0)])
    walls = np.vstack([np.hstack([line[:-1], line[1:]]) for line in (inner, outer, room)])
    stairs = Connector("stairs", "winding", (0, 1), np.vstack([inner, outer[::-1]]))
    return Plan("winding", (Level("0", 0.0, walls), Level("1", STOREY_M, walls)), None, "", (stairs,))


@pytest.mark.parametrize("levels", [(0, 1), (1, 0)])
def test_winding_stairs_are_walked_between_their_walls(levels: tuple[int, int]) -> None:
    plan = winding_stairs()
    path = walked(tour(plan, [RoutePlace(2.6, -2.0, level) for level in levels]), 1)
    assert path[0, 2] == pytest.approx(STOREY_M * levels[0])
    assert path[-1, 2] == pytest.approx(STOREY_M * levels[1])
    assert not in_walls(plan, path)
    climbing = path[(path[:, 2] > 0.1) & (path[:, 2] < STOREY_M - 0.1)]
    assert shapely.contains_xy(shapely.Polygon(plan.connectors[0].outline_m), *climbing[:, :2].T).all()


OFFICE = load_plan(sites.OFFICE_PLAN)
HIGH_TOWER = tower(sites.STOREYS)


def site_of(made: sites.Site) -> tuple[Plan, Sequence[Waypoint]]:
    return made.built, made.waypoints


# A building and a way through it, by a seed.
TOURS: dict[str, Callable[[int], tuple[Plan, Sequence[Waypoint]]]] = {
    "demo": lambda _: (OFFICE, room_tour(OFFICE)),
    "tower": lambda _: (HIGH_TOWER, tower_tour(sites.STOREYS)),
    "operation": lambda seed: (HIGH_TOWER, operation_waypoints(HIGH_TOWER, seed, TOUR_M)[0]),
    "one floor": lambda seed: site_of(sites.one_floor(seed, seed % sites.STOREYS)),
    **{
        make.__name__: lambda seed, make=make: site_of(make(seed))  # type: ignore[misc]
        for make in (sites.office, sites.three_floors, sites.by_lift, sites.hall, sites.yard)
    },
    "drawn office": lambda seed: site_of(drawn_sites.office(seed, TOUR_M)),
    "drawn corridors": lambda seed: site_of(drawn_sites.corridors(seed, TOUR_M)),
}

WESTPORT_TOURS = {
    "house": (lambda seed: site_of(sites.westport_house(seed, DATA)), (401, 605, 606, 801, 802)),
    "through": (lambda seed: (plan := load_plan(WESTPORT), through(plan, seed)), (1, 2)),
    "rooms": (lambda _: (plan := load_plan(WESTPORT), room_tour(plan)), (1,)),
    "drawn storey": (lambda seed: site_of(drawn_sites.westport(seed, TOUR_M, DATA)), (501,)),
    "drawn storeys": (lambda seed: site_of(drawn_sites.storeys(seed, TOUR_M, DATA)), (501,)),
}  # 605, 606, 801, 802 and both of `through` use the winding stair, or the one with a corner


@pytest.mark.long
@pytest.mark.study
@pytest.mark.parametrize("name", TOURS)
def test_no_tour_meets_a_wall(name: str) -> None:
    for seed in (1, 2):
        plan, way = TOURS[name](seed)
        assert not in_walls(plan, walked(way, seed)), seed


@pytest.mark.long
@pytest.mark.study
@needs_data("maps/westport-house.json")
@pytest.mark.parametrize(
    ("make", "seed"), [pytest.param(make, s, id=f"{name} {s}") for name, (make, seeds) in WESTPORT_TOURS.items() for s in seeds]
)  # fmt: skip
def test_no_tour_of_a_real_building_meets_a_wall(
    make: Callable[[int], tuple[Plan, Sequence[Waypoint]]], seed: int
) -> None:
    plan, way = make(seed)
    assert not in_walls(plan, walked(way, seed))
