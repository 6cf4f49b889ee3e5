# SPDX-License-Identifier: MIT
"""The way out: which doors of a plan lead into the open, and that the way there is the shortest walk, through no wall."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

from echostep.errors import EchostepError
from echostep.plan import Connector, Door, Level, Plan, load_plan
from echostep_app.plan.closures import OpenWays, stroke
from echostep_app.plan.cropping import is_clear
from echostep_app.plan.pictures.drawing import draw_plan
from echostep_app.plan.pictures.symbols import level_lines
from echostep_app.plan.routing import CLIMB, EXIT, Goal, Route, RoutePlace, Routes
from echostep_studies.frame.recordings import DATA
from naive.ways import CELL_M, shortest_walks
from needs_data import needs_data

SOUTH, EAST = (4.0, 0.0, 5.0, 0.0), (20.0, 4.5, 20.0, 5.5)  # doors of the outline
INNER = (10.0, 4.5, 10.0, 5.5)  # of the wall between the two halves


OUTLINE = (shapely.box(0.0, 0.0, 20.0, 10.0).exterior, shapely.LineString([(10.0, 0.0), (10.0, 10.0)]))


def level(height_m: float, *doors: Door, walls: Sequence[Any] = OUTLINE, more: Sequence[Any] = ()) -> Level:
    """A house of 20 m by 10 m in two halves, with gaps for its doors; `more`: its other walls."""
    gaps = shapely.union_all([shapely.LineString([d.line[:2], d.line[2:]]).buffer(1e-6) for d in doors])
    lines = [shapely.get_coordinates(part) for part in shapely.get_parts(shapely.difference([*walls, *more], gaps))]
    return Level(f"{height_m:g}", height_m, np.vstack([np.hstack([at[:-1], at[1:]]) for at in lines]), doors=doors)


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


def test_a_sign_leads_from_each_exit_of_its_level(tmp_path: Path) -> None:
    """As a line of the pages, and with its word in the picture of `plan show`."""
    plan = house(level(0.0, Door(SOUTH), Door(EAST), Door(INNER)), level(3.5, Door(INNER)))
    assert level_lines(plan, 0)["exit"].round(2).tolist() == [[4.5, 0.0, 4.5, -1.6], [20.0, 5.0, 21.6, 5.0]]
    assert not len(level_lines(plan, 1)["exit"])
    draw_plan(plan, tmp_path / "house.svg", [0, 1])
    assert (tmp_path / "house.svg").read_text().count("<!-- EXIT -->") == 2


def test_gaps_in_the_outline_are_exits_where_it_has_no_doors() -> None:
    gaps = level(0.0, Door(SOUTH), Door(EAST), Door(INNER))
    assert sorted(found(house(replace(gaps, doors=())))) == [(4.5, -0.6, 0), (20.6, 5.0, 0)]
    assert found(house(replace(gaps, doors=(Door(EAST),)))) == [(20.6, 5.0, 0)]


def test_a_door_that_its_source_names_an_exit_is_one_on_any_storey() -> None:
    plan = house(level(0.0, Door(INNER)), level(3.5, Door(SOUTH), Door(EAST, name="Notausgang"), Door(INNER)))
    assert found(plan) == [(20.6, 5.0, 1)]


def test_stairs_are_the_way_to_the_ground_where_the_plan_begins_above_it() -> None:
    storeys = (level(7.0, Door(INNER)), level(10.5, Door(INNER)))
    assert found(house(*storeys)) == [(16.5, 5.0, 0)]
    assert not house(*storeys, kind="lift").exits


def test_a_door_to_a_court_is_no_exit() -> None:
    doors = Door(SOUTH), Door(INNER), Door((12.0, 2.4, 12.0, 3.4))
    assert found(house(level(0.0, *doors, more=[shapely.box(12.0, 2.0, 14.0, 4.0).exterior]))) == [(4.5, -0.6, 0)]


def test_a_wall_that_is_missing_makes_no_exit_of_a_door_deep_inside() -> None:
    """The east half is open to the outside by a gap that no door could close: its doors lead into the house, not out of it."""
    doors = Door(SOUTH), Door(INNER), Door((12.0, 4.5, 12.0, 5.5))
    open_ = shapely.LineString([(20.0, 7.0), (20.0, 0.0), (0.0, 0.0), (0.0, 10.0), (20.0, 10.0)]), OUTLINE[1]
    assert found(house(level(0.0, *doors, walls=open_, more=[shapely.box(12.0, 3.0, 14.0, 7.0).exterior]))) == [
        (4.5, -0.6, 0)
    ]


def test_the_way_out_is_the_shortest_one_and_takes_no_lift() -> None:
    plan = house(level(0.0, Door(SOUTH), Door(EAST), Door(INNER)), level(3.5, Door(INNER)))
    down = Routes(plan).way(RoutePlace(12.0, 5.0, 1), EXIT)
    assert [stretch.level for stretch in down.stretches] == [1, 0]
    assert down.stretches[-1].line_m[-1] == pytest.approx((20.6, 5.0))
    west = Routes(plan).way(RoutePlace(4.0, 5.0), EXIT)
    assert west.stretches[-1].line_m[-1] == pytest.approx((4.5, -0.6))
    with pytest.raises(EchostepError, match="to an exit: is a door missing"):
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
    with pytest.raises(EchostepError, match="to an exit: is a door missing"):
        ways.past((RoutePlace(20.0, 5.0), RoutePlace(10.0, 5.0))).way(start, EXIT)
    with pytest.raises(EchostepError, match="to an exit: is a door missing"):
        ways.past((RoutePlace(16.0, 5.0, 1),)).way(RoutePlace(12.0, 5.0, 1), EXIT)  # the stairs


def test_a_stroke_in_a_corridor_reaches_from_wall_to_wall() -> None:
    walls = np.array([[0.0, 0.0, 30.0, 0.0], [0.0, 2.4, 30.0, 2.4], [30.0, 0.0, 30.0, 2.4]])
    ends = [stroke(Level("0", 0.0, lines), RoutePlace(12.0, 0.9))[:, 3].tolist() for lines in (walls, walls[:1])]
    assert ends == [[0.0, 2.4], [0.0, 6.9]]  # without the other wall as far as a stroke goes


def longer(plan: Plan, starts: int) -> list[float]:
    """How much longer than the shortest walk the ways out from random places are; neither these nor ways between the places may meet a wall."""
    routes, (low, walked_m), ratios, before = Routes(plan), shortest_walks(plan, plan.exits), [], None
    for k, column, row in np.random.default_rng(1).permutation(np.argwhere(~np.isnan(walked_m)))[:starts].tolist():
        x, y = low + (np.array([column, row]) + 0.5) * CELL_M
        here = RoutePlace(x, y, k)
        out, between = (way_or_none(routes, here, to) for to in (EXIT, before or here))
        for stretch in (stretch for way in (out, between) if way for stretch in way.stretches):
            walls, line = plan.levels[stretch.level].solid, stretch.line_m.tolist()
            assert all(is_clear(walls, a, b) for a, b in pairwise(line)), (here, before)
        before = here
        assert out or not np.isfinite(walked_m[k, column, row]), here
        if out:
            rise_m = np.abs(np.diff([plan.levels[stretch.level].height_m for stretch in out.stretches])).sum()
            ratios.append((out.length_m + CLIMB * rise_m) / walked_m[k, column, row])
    return ratios


def way_or_none(routes: Routes, here: RoutePlace, to: Goal) -> Route | None:
    try:
        return routes.way(here, to)
    except EchostepError:
        return None


def test_ways_out_of_a_small_house_are_the_shortest() -> None:
    ratios = longer(house(level(0.0, Door(SOUTH), Door(EAST), Door(INNER)), level(3.5, Door(INNER))), 60)
    assert len(ratios) > 40  # all but those beside the house on the upper floor
    assert np.quantile(ratios, 0.95) < 1.03


@pytest.mark.long
@needs_data("maps/westport-house.json")
def test_ways_out_of_a_real_building_are_the_shortest() -> None:
    ratios = longer(load_plan(DATA / "maps/westport-house.json"), 200)
    print(f"{len(ratios)} of 200 places: {np.quantile(ratios, [0.0, 0.5, 0.95, 1.0]).round(3)} of the shortest")
    assert len(ratios) > 100
    assert np.quantile(ratios, 0.95) < 1.03
