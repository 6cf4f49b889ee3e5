# SPDX-License-Identifier: MIT
"""Drawings in many habits become the same plan; what is a door, what is none, and what a door does to the walls."""

from __future__ import annotations

from itertools import count
from pathlib import Path
from typing import Any

import pytest
from ezdxf.filemanagement import readfile

from echostep.plan import Level, Plan
from echostep_app.plan.importers.formats import import_plan
from echostep_app.plan.importers.report import ImportReport
from echostep_app.plan.importers.summary import doors_in_gaps
from echostep_app.plan.places.faces import OUTSIDE
from echostep_app.plan.places.spaces import find_spaces
from echostep_app.plan.questions import with_questions
from plan.drawings import drawn_offices as drawn
from plan.drawings.drawn_doors import DOOR_STYLES, Doors, Layer, Leaf, leaves_alone, nothing
from plan.drawings.drawn_houses import DOOR, OTHER, WALL, corners, house, outlines, sheet, write_house
from plan.drawings.drawn_offices import WALL_STYLES, Walls, write_office
from plan.imported_plans import imported_file

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
    plan = with_questions(import_plan(write_office(tmp_path / "a.dxf", door=nothing)))
    assert plan.levels[0].doors == ()
    (question,) = plan.levels[0].questions
    assert question.text.startswith("7 alike: room ")
    assert question.is_proposed
    assert len(question.lines_m) == 7


def test_double_doors_without_a_swing_are_told(tmp_path: Path) -> None:
    """Single leaves drawn open lie in their gaps, that in the corner too; of two that face each other none fits the gap."""
    plan, report = imported_file(write_office(tmp_path / "a.dxf", door=leaves_alone))
    level = plan.levels[0]
    assert (len(level.doors), doors_in_gaps(level)) == (6, 6)
    assert report.left_out["door in no wall"] == 2
    assert [question.text for question in level.questions] == ["door in no wall, left out: is it a door?"] * 2


def imported(doc: Any, folder: Path) -> tuple[Level, ImportReport]:
    doc.saveas(folder / "a.dxf")
    plan, report = imported_file(folder / "a.dxf")
    return plan.levels[0], report


def test_walls_keep_their_jambs(tmp_path: Path) -> None:
    """A door cuts the walls that are drawn through it, not the ends of the walls beside it."""
    level = import_plan(write_house(tmp_path / "a.dxf")).levels[0]
    ends = [sorted(((w[0], w[1]), (w[2], w[3]))) for w in level.walls.tolist()]
    assert len(level.walls) == 14
    assert [(4.0, 3.0), (4.1, 3.0)] in ends
    assert [(4.0, 3.9), (4.1, 3.9)] in ends


def test_a_leaf_among_the_walls_is_no_wall(tmp_path: Path) -> None:
    doc, space = sheet()
    house(space)
    space.add_arc((4.05, 3), 0.9, 0, 90, dxfattribs=WALL)
    space.add_line((4.05, 3), (4.95, 3), WALL)
    level, _ = imported(doc, tmp_path)
    assert (len(level.doors), len(level.walls)) == (1, 14)


def test_a_door_in_no_wall_is_told_and_not_placed(tmp_path: Path) -> None:
    doc, space = sheet()
    outlines(space, (0, 0, 10, 8))
    space.add_arc((5, 4), 0.9, 0, 90, dxfattribs=DOOR)
    space.add_line((5, 4), (5.9, 4), DOOR)
    level, report = imported(doc, tmp_path)
    assert level.doors == ()
    assert report.left_out["door in no wall"] == 1
    assert "1 door stands in no wall and was left out (x 5.45 y 4.45)" in report.doubts[0]


def test_marks_beside_doors_are_no_doors(tmp_path: Path) -> None:
    """Frames of the doors' numbers, and jambs apart from the leaf."""
    doc = readfile(write_house(tmp_path / "a.dxf"))
    space = doc.modelspace()
    space.add_circle((7, 4), 0.3, dxfattribs=DOOR)
    space.add_lwpolyline(corners((7.8, 5, 7.85, 5.1)), close=True, dxfattribs=DOOR)
    space.add_circle((7, 6), 0.3, dxfattribs={"layer": "A-DOOR-IDEN"})
    level, report = imported(doc, tmp_path)
    assert len(level.doors) == 1
    assert report.doubts == []
    assert report.left_out == {"mark on a layer of doors": 2, "CIRCLE on A-DOOR-IDEN": 1}


def test_a_door_beside_a_window_that_is_not_recognised(tmp_path: Path) -> None:
    """The hole is 3 m wide; the leaf is drawn, so the other end of its arc is the jamb."""
    doc, space = sheet()
    for box in ((0, 0, 2, 0.3), (5, 0, 10, 0.3), (0, 7.7, 10, 8), (0, 0.3, 0.3, 7.7), (9.7, 0.3, 10, 7.7)):
        outlines(space, box)
    space.add_arc((2, 0.15), 0.8, 0, 90, dxfattribs=DOOR)
    space.add_line((2, 0.15), (2, 0.95), DOOR)
    outlines(space, (2.8, 0.1, 5, 0.2), "X-17")
    level, report = imported(doc, tmp_path)
    assert [door.line for door in level.doors] == [pytest.approx((2, 0.15, 2.8, 0.15), abs=0.01)]
    assert report.left_out == {"LWPOLYLINE on X-17": 1}


def test_a_wall_drawn_through_a_door_is_cut_on_both_faces(tmp_path: Path) -> None:
    doc, space = sheet()
    for y in (0.0, 0.3):
        space.add_line((0, y), (9, y), WALL)
    space.add_line((4, 0), (5, 0), DOOR)
    level, report = imported(doc, tmp_path)
    assert sorted(level.walls.tolist()) == [[0, 0, 4, 0], [0, 0.3, 4, 0.3], [5, 0, 9, 0], [5, 0.3, 9, 0.3]]
    assert "1 door lies where a wall is drawn through" in report.doubts[0]


def test_round_things_are_no_doors(tmp_path: Path) -> None:
    """A basin, a round corner of a wall, and a table between two walls."""
    doc, space = sheet()
    space.add_lwpolyline(
        [(0, 0, 0), (9, 0, 0.414), (10, 1, 0), (10, 8, 0), (0, 8, 0)], format="xyb", close=True, dxfattribs=WALL
    )
    space.add_arc((0, 4), 0.4, 270, 90, dxfattribs=OTHER)
    space.add_circle((5, 4), 0.6, dxfattribs=OTHER)
    level, report = imported(doc, tmp_path)
    assert level.doors == ()
    assert report.left_out == {"ARC on A-FINE": 1, "CIRCLE on A-FINE": 1}
    assert len(level.walls) > 8


@pytest.mark.parametrize("is_leaf", [True, False])
@pytest.mark.parametrize("layer", ["A-WALL", "EXIT", "ENTREE_SORTIE", "0", "A-GLAZ"])
def test_a_swing_on_any_layer_at_a_wall_drawn_through_is_a_door_or_a_question(
    tmp_path: Path, layer: str, *, is_leaf: bool
) -> None:
    doc, space = sheet()
    for box in ((0, 0, 10, 0.3), (0, 7.7, 10, 8), (0, 0.3, 0.3, 7.7), (9.7, 0.3, 10, 7.7)):
        outlines(space, box)
    space.add_arc((4, 0.3), 0.9, 0, 90, dxfattribs={"layer": layer})
    if is_leaf:
        space.add_line((4, 0.3), (4, 1.2), {"layer": layer})
    level, report = imported(doc, tmp_path)
    (question,) = level.questions
    assert question.lines_m == ((4.0, 0.3, 4.9, 0.3),)
    assert question.is_proposed is not is_leaf
    assert len(level.doors) == is_leaf
    assert "drawn through" in report.doubts[0]
    assert (report.left_out == {}) is (is_leaf or layer in ("A-WALL", "A-GLAZ"))
