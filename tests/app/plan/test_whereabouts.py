# SPDX-License-Identifier: MIT
"""Positions in words, and positions where nobody can stand: by outlines, by walls, by gaps that no plan lists as doors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from echostep.plan import Level, Plan, Room
from echostep_app.plan.places.gaps import door_gaps
from echostep_app.plan.places.standing import StandingGround
from echostep_app.plan.places.whereabouts import Whereabouts
from plan.imported_plans import seven_floors
from walks import PLAN


@pytest.mark.parametrize(
    ("at", "words"),
    [
        ((6.0, 9.0), "in Office 1"), ((6.4, 9.0), "in Office 2"), ((9.6, 6.0), "in Store"), ((9.8, 6.0), "in Server"),
        ((6.3, 7.5), "in North corridor"), ((6.3, 2.0), "in South corridor"), ((-9.0, 7.5), "outside the building"),
    ],
)  # fmt: skip
def test_rooms_of_the_demo_by_its_walls(at: tuple[float, float], words: str) -> None:
    """In the corridor the nearest name is Store's, 2.6 m away behind a wall."""
    assert Whereabouts(PLAN).words(*at, 0) == words


@pytest.mark.parametrize(
    ("at", "words"),
    [
        ((7.0, 9.0, 2), "in Office 201"), ((7.0, 9.0, 3), "in Office 301"), ((4.0, 7.0, 2), "in Corridor"), ((4.0, 5.0, 6), "in Kitchen"),
        ((18.0, 10.0, 2), "on Stairs A"), ((22.0, 10.0, 0), "in Lift"), ((30.0, 7.0, 1), "outside the building"), ((1.0, 1.0, 7), ""),
        ((float("nan"), 1.0, 0), ""),
    ],
)  # fmt: skip
def test_rooms_of_seven_floors_by_their_outlines(at: tuple[float, float, int], words: str) -> None:
    assert Whereabouts(seven_floors()).words(*at) == words


def without_name(plan: Plan, *names: str) -> Plan:
    level = plan.levels[0]
    return replace(plan, levels=(replace(level, rooms=tuple(r for r in level.rooms if r.name not in names)),))


CORRIDORS = "North corridor", "South corridor"
FIELD = Plan("field", (Level("G", 0.0, np.zeros((0, 4))),), None, "")


@pytest.mark.parametrize(
    ("plan", "at", "words"),
    [
        (without_name(PLAN, *CORRIDORS), (9.5, 7.5), "in the corridor, by the door of Office 2"),
        (without_name(PLAN, *CORRIDORS), (24.0, 5.0), "in the corridor"),
        (without_name(PLAN, "Lab"), (15.7, 11.2), "near North corridor"),  # its door leads to two names
        (without_name(PLAN, *(room.name for room in PLAN.levels[0].rooms)), (24.0, 5.0), "in the corridor"),
        (FIELD, (1.0, 2.0), ""),
    ],
)
def test_places_without_a_name_are_told_by_what_is_near(plan: Plan, at: tuple[float, float], words: str) -> None:
    assert Whereabouts(plan).words(*at, 0) == words


def test_gaps_are_found_once_and_jambs_do_not_hide_them() -> None:
    found = {tuple(np.round(sorted(gap.line[::2]) + sorted(gap.line[1::2]), 2)) for gap in door_gaps(PLAN.levels[0])}
    assert len(found) == len(door_gaps(PLAN.levels[0])) == 7
    assert (12.55, 13.45, 6.5, 6.5) in found


def test_a_wall_that_ends_in_a_corner_makes_a_gap_to_it() -> None:
    walls = np.array([[0, 0, 4, 0], [4, 0, 4, 3], [4, 3, 0, 3], [0, 3, 0, 0], [2, 3, 2, 0.9]], dtype=float)
    (gap,) = door_gaps(Level("G", 0.0, walls))
    assert gap.line == pytest.approx((2.0, 0.9, 2.0, 0.0))


def test_a_wall_just_behind_the_widest_gap_is_not_reached() -> None:
    """Nearer to the line's end than walls are apart by rounding, and not met: the distance to it was no number."""
    walls = np.array([[0, 0, 2, 0], [2, 0, 2, 3], [2, 3, 0, 3], [0, 3, 0, 0], [0, 1, -1, 1], [-2.602, 0, -2.602, 2]])
    assert door_gaps(Level("G", 0.0, walls)) == ()


@pytest.mark.parametrize(("at", "reason", "nearest"), [
    ((100.0, 7.0), "outside the building", (24.7, 7.0)),
    ((5.0, 6.55), "inside a wall", (5.0, 6.8)),
    ((2.0, 1.02), "inside a wall", (2.0, 1.3)),
])  # fmt: skip
def test_no_start_outside_or_in_a_wall_of_the_demo(
    at: tuple[float, float], reason: str, nearest: tuple[float, float]
) -> None:
    objection = StandingGround(PLAN).objection(*at, 0)
    assert objection is not None
    assert reason in objection.reason
    assert objection.nearest_m == pytest.approx(nearest)
    assert StandingGround(PLAN).objection(*nearest, 0) is None


def test_no_start_in_a_thick_wall_or_a_table_of_seven_floors() -> None:
    ground = StandingGround(seven_floors())
    in_wall, in_table, out = (ground.objection(*at, 3) for at in ((8.0, 3.0), (12.0, 10.7), (-2.0, 7.0)))
    assert in_wall is not None
    assert in_table is not None
    assert out is not None
    assert "inside a wall" in in_wall.reason
    assert in_wall.nearest_m in ((7.6, 3.0), (8.4, 3.0))
    assert "inside an obstacle" in in_table.reason
    assert in_table.nearest_m == pytest.approx((12.0, 9.7))
    assert out.nearest_m == pytest.approx((0.4, 7.0))
    for room in seven_floors().levels[3].rooms:
        assert ground.objection(*room.at_m, 3) is None or room.name.startswith("Meeting")  # named on its table
    assert ground.objection(18.0, 10.0, 3) is None  # on the stairs
    assert ground.objection(1.0, 1.0, 7) is not None


def test_where_nothing_encloses_the_hull_of_the_walls_is_the_building() -> None:
    walls = np.array([[0, 0, 20, 0], [0, 2, 20, 2]], dtype=float)
    corridor = Plan("corridor", (Level("G", 0.0, walls, (Room("Corridor", (10.0, 1.0)),)),), None, "")
    ground = StandingGround(corridor)
    assert ground.objection(19.0, 1.0, 0) is None
    assert (outside := ground.objection(10.0, 5.0, 0)) is not None
    assert outside.nearest_m == pytest.approx((10.0, 1.7))
    assert StandingGround(FIELD).objection(1e3, 0.0, 0) is None
