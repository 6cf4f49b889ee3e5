# SPDX-License-Identifier: MIT
"""Drawings in many habits become the same plan: seven doors in their gaps, seven spaces with their names; or the import says what it did not read."""

from __future__ import annotations

from itertools import count
from pathlib import Path
from typing import Any

import pytest

from echostep.plan import Plan
from echostep_app.plan.importers.formats import import_plan
from echostep_app.plan.importers.report import ImportReport
from echostep_app.plan.importers.summary import doors_in_gaps
from echostep_app.plan.places.faces import OUTSIDE
from echostep_app.plan.places.spaces import find_spaces
from echostep_app.plan.questions import with_questions
from plan.drawings import drawn_offices as drawn
from plan.drawings.drawn_offices import DOOR_STYLES, WALL_STYLES, Doors, Layer, Leaf, Walls, write_office

TURN = 33.0
ROOM_M2 = 5.88 * 4.63  # R2, between its walls


def facts(plan: Plan) -> tuple[int, int, int, float]:
    """Doors, doors in gaps, different spaces that have a room's name, area of R2."""
    level, spaces = plan.levels[0], find_spaces(plan, 0)
    assert spaces is not None
    homes = {room.name: spaces.face_at(*room.at_m) for room in level.rooms}
    area = spaces.faces.areas[homes["R2"]].area if homes["R2"] != OUTSIDE else 0.0
    return len(level.doors), doors_in_gaps(level), len(set(homes.values()) - {OUTSIDE}), float(area)


def is_right(plan: Plan, walls: Walls = drawn.outlines) -> bool:
    doors, in_gaps, spaces, area = facts(plan)
    right = ROOM_M2 if walls is not drawn.along_the_middle else 6.0 * 4.815
    return (doors, in_gaps, spaces) == (7, 7, 7) and abs(area - right) < 0.6


@pytest.mark.parametrize("walls", WALL_STYLES, ids=lambda walls: str(walls.__name__))
def test_walls_of_all_habits(tmp_path: Path, walls: Walls) -> None:
    plan = import_plan(write_office(tmp_path / "a.dxf", walls))
    assert is_right(plan, walls), facts(plan)


@pytest.mark.parametrize("part", range(4))
@pytest.mark.parametrize("walls", WALL_STYLES, ids=lambda walls: str(walls.__name__))
def test_doors_of_all_habits_in_walls_of_all_habits(tmp_path: Path, walls: Walls, part: int) -> None:
    """Each of the seven doors of a file in another habit; the parts have all of them."""
    styles = count(WALL_STYLES.index(walls) + 7 * part)

    def door(space: Any, gap: Leaf, layer: Layer) -> None:
        DOOR_STYLES[next(styles) % len(DOOR_STYLES)](space, gap, layer)

    plan = import_plan(write_office(tmp_path / "a.dxf", walls, door, turn=TURN))
    assert is_right(plan, walls), facts(plan)


@pytest.mark.parametrize("turn", [0.0, TURN])
@pytest.mark.parametrize("door", DOOR_STYLES, ids=lambda door: str(door.__name__))
def test_doors_of_all_habits(tmp_path: Path, door: Doors, turn: float) -> None:
    plan = import_plan(write_office(tmp_path / "a.dxf", door=door, turn=turn))
    assert is_right(plan), facts(plan)


def test_what_stands_beside_the_walls(tmp_path: Path) -> None:
    plan = import_plan(write_office(tmp_path / "a.dxf", extra=drawn.furnished))
    assert is_right(plan), facts(plan)


def test_rooms_behind_gaps_are_asked_about_at_once(tmp_path: Path) -> None:
    """One question for seven doors, of each the gap in one face of its wall."""
    plan = with_questions(import_plan(write_office(tmp_path / "a.dxf", door=drawn.nothing)))
    assert plan.levels[0].doors == ()
    (question,) = plan.levels[0].questions
    assert question.text.startswith("7 alike: room ")
    assert question.is_proposed
    assert len(question.lines_m) == 7


def test_double_doors_without_a_swing_are_told(tmp_path: Path) -> None:
    """Single leaves drawn open lie in their gaps, that in the corner too; of two that face each other none fits the gap."""
    report = ImportReport()
    level = import_plan(write_office(tmp_path / "a.dxf", door=drawn.leaves_alone), report=report).levels[0]
    assert (len(level.doors), doors_in_gaps(level)) == (6, 6)
    assert report.left_out["door in no wall"] == 2
    assert [question.text for question in level.questions] == ["door in no wall, left out: is it a door?"] * 2
