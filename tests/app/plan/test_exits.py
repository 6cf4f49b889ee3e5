# SPDX-License-Identifier: MIT
"""The way out: which doors of a plan lead into the open, and that the way there is the shortest walk, through no wall."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.plan import Connector, Door, Level, Plan, load_plan
from echostep_app.plan.closures import OpenWays, stroke
from echostep_app.plan.routing import EXIT, RoutePlace, Routes
from echostep_studies.frame.recordings import DATA
from naive.ways import ShortestWalks
from needs_data import needs_data

SOUTH, EAST = (4.0, 0.0, 5.0, 0.0), (20.0, 4.5, 20.0, 5.5)  # doors of the outline
INNER = (10.0, 4.5, 10.0, 5.5)  # of the wall between the two halves
WESTPORT = DATA / "maps/westport-house.json"


def around(*doors: tuple[float, float, float, float]) -> Floats:
    """A house of 20 m by 10 m in two halves, with gaps for doors."""
    sides = [
        (0.0, 0.0, 20.0, 0.0),
        (20.0, 0.0, 20.0, 10.0),
        (20.0, 10.0, 0.0, 10.0),
        (0.0, 10.0, 0.0, 0.0),
        (10.0, 0.0, 10.0, 10.0),
    ]
    lines = [shapely.LineString([s[:2], s[2:]]) for s in sides]
    gaps = shapely.union_all([shapely.LineString([d[:2], d[2:]]).buffer(1e-6) for d in doors])
    parts = shapely.get_parts(shapely.difference(lines, gaps)) if doors else np.array(lines)
    return np.array([np.ravel(part.coords) for part in shapely.get_parts(parts)])


def level(height_m: float, *doors: Door) -> Level:
    return Level(f"{height_m:g}", height_m, around(*(door.line for door in doors)), doors=doors)


def house(*levels: Level, kind: str = "stairs") -> Plan:
    outline = np.array([[15.0, 4.0], [18.0, 4.0], [18.0, 6.0], [15.0, 6.0]])
    joined = (Connector(kind, "A", tuple(range(len(levels))), outline),) if len(levels) > 1 else ()  # type: ignore[arg-type]
    return Plan("house", levels, None, "", joined)


def found(plan: Plan) -> list[tuple[float, float, int]]:
    return [(round(e.x_m, 1), round(e.y_m, 1), e.level) for e in plan.exits]


def test_exits_are_the_doors_of_the_outline_on_the_ground() -> None:
    ground = level(0.0, Door(SOUTH), Door(EAST), Door(INNER))
    plan = house(ground, level(3.5, Door(SOUTH), Door(INNER)))
    assert found(plan) == [(4.5, -0.6, 0), (20.6, 5.0, 0)]
    assert plan.exits[0].heading_rad == pytest.approx(-math.pi / 2)
    assert not house(level(0.0, Door(INNER))).exits


def test_gaps_in_the_outline_are_exits_where_it_has_no_doors() -> None:
    gaps = Level("0", 0.0, around(SOUTH, INNER))
    assert found(house(gaps)) == [(4.5, -0.6, 0)]
    assert found(house(replace(gaps, walls=around(SOUTH, EAST, INNER), doors=(Door(EAST),)))) == [(20.6, 5.0, 0)]


def test_a_door_that_its_source_names_an_exit_is_one_on_any_storey() -> None:
    plan = house(level(0.0, Door(INNER)), level(3.5, Door(SOUTH), Door(EAST, name="Notausgang"), Door(INNER)))
    assert found(plan) == [(20.6, 5.0, 1)]


def test_stairs_are_the_way_to_the_ground_where_the_plan_begins_above_it() -> None:
    storeys = (level(7.0, Door(INNER)), level(10.5, Door(INNER)))
    assert found(house(*storeys)) == [(16.5, 5.0, 0)]
    assert not house(*storeys, kind="lift").exits


def test_a_door_to_a_court_is_no_exit() -> None:
    court = np.array(
        [
            [12.0, 2.0, 14.0, 2.0],
            [14.0, 2.0, 14.0, 4.0],
            [14.0, 4.0, 12.0, 4.0],
            [12.0, 4.0, 12.0, 3.4],
            [12.0, 2.4, 12.0, 2.0],
        ]
    )
    ground = level(0.0, Door(SOUTH), Door(INNER), Door((12.0, 2.4, 12.0, 3.4)))
    ground = replace(ground, walls=np.vstack([ground.walls, court]))
    assert found(house(ground)) == [(4.5, -0.6, 0)]


def test_a_wall_that_is_missing_makes_no_exit_of_a_door_deep_inside() -> None:
    """The east half is open to the outside by a gap that no door could close: its doors lead into the house, not out of it."""
    inner = np.array(
        [
            [12.0, 3.0, 14.0, 3.0],
            [14.0, 3.0, 14.0, 7.0],
            [14.0, 7.0, 12.0, 7.0],
            [12.0, 7.0, 12.0, 5.5],
            [12.0, 4.5, 12.0, 3.0],
        ]
    )
    ground = level(0.0, Door(SOUTH), Door(INNER), Door((12.0, 4.5, 12.0, 5.5)))
    walls = [w for w in ground.walls.tolist() if (w[:2] != [20.0, 0.0] and w[2:] != [20.0, 0.0]) or w[1] == w[3]]
    ground = replace(ground, walls=np.vstack([walls, [[20.0, 0.0, 20.0, 7.0]], inner]))
    assert found(house(ground)) == [(4.5, -0.6, 0)]


def test_the_way_out_is_the_shortest_one_and_takes_no_lift() -> None:
    plan = house(level(0.0, Door(SOUTH), Door(EAST), Door(INNER)), level(3.5, Door(INNER)))
    down = Routes(plan).way(RoutePlace(12.0, 5.0, 1), EXIT)
    assert [stretch.level for stretch in down.stretches] == [1, 0]
    assert down.stretches[-1].line_m[-1] == pytest.approx((20.6, 5.0))
    west = Routes(plan).way(RoutePlace(4.0, 5.0), EXIT)
    assert west.stretches[-1].line_m[-1] == pytest.approx((4.5, -0.6))
    with pytest.raises(EchostepError, match="there is no way out from"):
        Routes(house(*plan.levels, kind="lift")).way(RoutePlace(12.0, 5.0, 1), EXIT)
    with pytest.raises(EchostepError, match="shows no exit"):
        Routes(house(level(0.0, Door(INNER)))).way(RoutePlace(4.0, 5.0), EXIT)


def test_a_passage_that_is_struck_out_is_gone_round() -> None:
    plan = house(level(0.0, Door(SOUTH), Door(EAST), Door(INNER)), level(3.5, Door(INNER)))
    start, ways = RoutePlace(19.0, 5.5), OpenWays(plan)
    assert ways.past(()).way(start, EXIT).length_m < 3.0
    for near_the_door in (RoutePlace(19.4, 4.6), RoutePlace(20.3, 5.2)):
        routes = ways.past((near_the_door,))
        assert routes.way(start, EXIT).stretches[-1].line_m[-1] == pytest.approx((4.5, -0.6))
        assert ways.past((near_the_door,)) is routes
    with pytest.raises(EchostepError, match="there is no way out"):
        ways.past((RoutePlace(20.0, 5.0), RoutePlace(10.0, 5.0))).way(start, EXIT)
    with pytest.raises(EchostepError, match="there is no way out"):
        ways.past((RoutePlace(16.0, 5.0, 1),)).way(RoutePlace(12.0, 5.0, 1), EXIT)  # the stairs


def test_a_stroke_in_a_corridor_reaches_from_wall_to_wall() -> None:
    walls = np.array([[0.0, 0.0, 30.0, 0.0], [0.0, 2.4, 30.0, 2.4], [30.0, 0.0, 30.0, 2.4]])
    closed = stroke(Level("0", 0.0, walls), RoutePlace(12.0, 0.9))
    assert closed.tolist() == [[12.0, 0.9, 12.0, 0.0], [12.0, 0.9, 12.0, 2.4]]
    beside = stroke(Level("0", 0.0, walls[:1]), RoutePlace(12.0, 1.0))
    assert beside.tolist() == [[12.0, 1.0, 12.0, 0.0], [12.0, 1.0, 12.0, 7.0]]


def longer(plan: Plan, starts: int) -> list[float]:
    """How much longer than the shortest walk the ways out from random places are; none may meet a wall."""
    routes, twin, rng = Routes(plan), ShortestWalks(plan, plan.exits), np.random.default_rng(1)
    trees = [shapely.STRtree(shapely.linestrings(lvl.solid.reshape(-1, 2, 2))) for lvl in plan.levels]
    ratios = []
    for k, column, row in rng.permutation(np.argwhere(twin.free))[:starts].tolist():
        x, y = twin.low + (np.array([column, row]) + 0.5) * 0.1
        try:
            way = routes.way(RoutePlace(x, y, k), EXIT)
        except EchostepError:
            assert not np.isfinite(twin.to_nearest_m[k, column, row]), (x, y, k)
            continue
        for stretch in way.stretches:
            if len(stretch.line_m) > 1:
                assert not len(trees[stretch.level].query(shapely.LineString(stretch.line_m), predicate="intersects"))
        heights = [plan.levels[stretch.level].height_m for stretch in way.stretches]
        walked_m = way.length_m + 3.0 * np.abs(np.diff(heights)).sum()
        ratios.append(walked_m / twin.to_nearest_m[k, column, row])
    return ratios


@pytest.mark.slow
@needs_data("maps/westport-house.json")
def test_ways_out_of_a_real_building_are_as_short_as_a_finer_grid_finds_them() -> None:
    ratios = longer(load_plan(WESTPORT), 200)
    print(len(ratios), np.quantile(ratios, [0.0, 0.5, 0.95, 1.0]).round(3))
    assert len(ratios) > 100
    assert np.quantile(ratios, 0.95) < 1.03
