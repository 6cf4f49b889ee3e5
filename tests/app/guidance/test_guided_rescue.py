# SPDX-License-Identifier: MIT
"""A rescuer is guided to another wearer, over floors, the same in a replay; no tour of a simulated person meets a wall."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from board_runs import ROOT
from echostep.arrays import Floats
from echostep.localization import Estimate, TrackStatus
from echostep.plan import Connector, Level, Plan, Pose, load_plan
from echostep.ports.chunks import TEAM, Chunk, portion_of
from echostep.tracker import Tracker
from echostep_app.guidance.cues import CueKind
from echostep_app.guidance.guided_run import GuidedRescue, guidance_of
from echostep_app.guidance.tours import room_tour, tour
from echostep_app.plan.routing import Route, RoutePlace
from echostep_app.ports.teammate import Teammate, parse_teammate
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.people.walker import RATE_HZ, Person, Waypoint, walk
from echostep_simulation.scenario import Scenario
from echostep_simulation.world.tower import tour as tower_tour
from echostep_simulation.world.tower import tower
from echostep_studies.bench import sites
from echostep_studies.floors.storeys import through
from echostep_studies.frame.recordings import DATA
from echostep_studies.noplan import sites as drawn_sites
from echostep_studies.operation.walks import waypoints as operation_waypoints
from needs_data import needs_data

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
