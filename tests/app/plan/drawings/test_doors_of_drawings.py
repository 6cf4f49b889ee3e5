# SPDX-License-Identifier: MIT
"""Doors of drawings lie in the gaps of the walls, however walls and doors are drawn; a door in no wall is told, not placed."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from ezdxf.filemanagement import new, readfile

from echostep.plan import Level
from echostep_app.plan.importers.formats import import_plan
from echostep_app.plan.importers.report import ImportReport
from echostep_app.plan.importers.summary import doors_in_gaps
from plan.drawings.drawn_houses import (
    DOOR,
    DOOR_STYLES,
    DOUBLE_STYLES,
    OTHER,
    WALL,
    WALL_STYLES,
    Doors,
    Gap,
    Walls,
    all_on_the_wall_layer,
    corners,
    double_on_the_wall_layer,
    outlines,
    placed,
    write_house,
)

WITHIN_M = 0.15  # issue 44: 95 % of the doors are so near to a gap; here all are
AXIS_M = 0.15  # walls drawn as one line end at the axis of the next wall, half its thickness beyond the gap
TURN, SHIFT = 30.0, (200.0, -50.0)


def error_m(level: Level, gap: Gap, turn: float, shift: tuple[float, float]) -> float:
    """Greatest distance of a jamb from the only door's end, without regard to its direction; infinite for any other number of doors."""
    if len(level.doors) != 1:
        return math.inf
    line = level.doors[0].line
    jambs = [placed(point, turn, shift) for point in (gap.line[:2], gap.line[2:])]
    ways = [(line[:2], line[2:]), (line[2:], line[:2])]
    return min(max(math.dist(a, b) for a, b in zip(way, jambs, strict=True)) for way in ways)


def failures(
    path: Path, walls: Walls, doors: list[tuple[Doors, Gap]], turn: float, shift: tuple[float, float]
) -> list[str]:
    failed = []
    for door, gap in doors:
        level = import_plan(write_house(path, walls, door, gap, turn, shift)).levels[0]
        allowed = WITHIN_M + (AXIS_M if walls.__name__ == "axes" else 0.0)
        if not error_m(level, gap, turn, shift) < allowed or doors_in_gaps(level) != 1:
            failed.append(f"{door.__name__} in the gap {gap.begin} to {gap.end}: {[one.line for one in level.doors]}")
    return failed


@pytest.mark.parametrize("walls", WALL_STYLES, ids=lambda walls: str(walls.__name__))
def test_every_door_lies_in_its_gap(tmp_path: Path, walls: Walls) -> None:
    """18 ways to draw a door and 3 of double doors, in the middle of a wall."""
    doors = [*((door, Gap()) for door in DOOR_STYLES), *((door, Gap(3.0, 4.8)) for door in DOUBLE_STYLES)]
    assert failures(tmp_path / "a.dxf", walls, doors, TURN, SHIFT) == []


@pytest.mark.parametrize("walls", WALL_STYLES, ids=lambda walls: str(walls.__name__))
@pytest.mark.parametrize("begin", [0.3, 6.8])
def test_doors_in_a_corner(tmp_path: Path, walls: Walls, begin: float) -> None:
    """The gap reaches from the partition to the outer wall, and a leaf lies open against that wall."""
    doors = [(door, Gap(begin, begin + 0.9)) for door in DOOR_STYLES]
    assert failures(tmp_path / "a.dxf", walls, doors, 0.0, (0.0, 0.0)) == []


def test_walls_keep_their_jambs(tmp_path: Path) -> None:
    """A door cuts the walls that are drawn through it, not the ends of the walls beside it."""
    level = import_plan(write_house(tmp_path / "a.dxf", outlines, DOOR_STYLES[0], Gap())).levels[0]
    ends = [sorted(((w[0], w[1]), (w[2], w[3]))) for w in level.walls.tolist()]
    assert len(level.walls) == 14
    assert [(4.0, 3.0), (4.1, 3.0)] in ends
    assert [(4.0, 3.9), (4.1, 3.9)] in ends


def test_a_leaf_among_the_walls_is_no_wall(tmp_path: Path) -> None:
    for door, gap in ((all_on_the_wall_layer, Gap()), (double_on_the_wall_layer, Gap(3.0, 4.8))):
        level = import_plan(write_house(tmp_path / "a.dxf", outlines, door, gap)).levels[0]
        assert len(level.doors) == 1
        assert len(level.walls) == 14


def test_a_door_in_no_wall_is_told_and_not_placed(tmp_path: Path) -> None:
    doc = new("R2010")
    doc.header["$INSUNITS"] = 6
    space = doc.modelspace()
    space.add_lwpolyline(corners((0, 0, 10, 8)), close=True, dxfattribs=WALL)
    space.add_arc((5, 4), 0.9, 0, 90, dxfattribs=DOOR)
    space.add_line((5, 4), (5.9, 4), DOOR)
    doc.saveas(tmp_path / "a.dxf")
    report = ImportReport()
    assert import_plan(tmp_path / "a.dxf", report=report).levels[0].doors == ()
    assert report.left_out["door in no wall"] == 1
    assert "1 door stands in no wall and was left out (x 5.45 y 4.45)" in report.doubts[0]


def test_marks_beside_doors_are_no_doors(tmp_path: Path) -> None:
    """Frames of the doors' numbers, and jambs apart from the leaf."""
    path = write_house(tmp_path / "a.dxf", outlines, DOOR_STYLES[0], Gap())
    doc = readfile(path)
    space = doc.modelspace()
    space.add_circle((7, 4), 0.3, dxfattribs=DOOR)
    space.add_lwpolyline(corners((7.8, 5, 7.85, 5.1)), close=True, dxfattribs=DOOR)
    space.add_circle((7, 6), 0.3, dxfattribs={"layer": "A-DOOR-IDEN"})
    doc.saveas(path)
    report = ImportReport()
    assert len(import_plan(path, report=report).levels[0].doors) == 1
    assert report.doubts == []
    assert report.left_out == {"mark on a layer of doors": 2, "CIRCLE on A-DOOR-IDEN": 1}


def test_a_door_beside_a_window_that_is_not_recognised(tmp_path: Path) -> None:
    """The hole is 3 m wide; the leaf is drawn, so the other end of its arc is the jamb."""
    doc = new("R2010")
    doc.header["$INSUNITS"] = 6
    space = doc.modelspace()
    for box in ((0, 0, 2, 0.3), (5, 0, 10, 0.3), (0, 7.7, 10, 8), (0, 0.3, 0.3, 7.7), (9.7, 0.3, 10, 7.7)):
        outlines(space, box)
    space.add_arc((2, 0.15), 0.8, 0, 90, dxfattribs=DOOR)
    space.add_line((2, 0.15), (2, 0.95), DOOR)
    space.add_lwpolyline(corners((2.8, 0.1, 5, 0.2)), close=True, dxfattribs={"layer": "X-17"})
    doc.saveas(tmp_path / "a.dxf")
    report = ImportReport()
    doors = import_plan(tmp_path / "a.dxf", report=report).levels[0].doors
    assert [door.line for door in doors] == [pytest.approx((2, 0.15, 2.8, 0.15), abs=0.01)]
    assert report.left_out == {"LWPOLYLINE on X-17": 1}


def test_a_wall_drawn_through_a_door_is_cut_on_both_faces(tmp_path: Path) -> None:
    doc = new("R2010")
    doc.header["$INSUNITS"] = 6
    space = doc.modelspace()
    for y in (0.0, 0.3):
        space.add_line((0, y), (9, y), WALL)
    space.add_line((4, 0), (5, 0), DOOR)
    doc.saveas(tmp_path / "a.dxf")
    report = ImportReport()
    level = import_plan(tmp_path / "a.dxf", report=report).levels[0]
    assert sorted(level.walls.tolist()) == [[0, 0, 4, 0], [0, 0.3, 4, 0.3], [5, 0, 9, 0], [5, 0.3, 9, 0.3]]
    assert "1 door lies where a wall is drawn through" in report.doubts[0]


def test_round_things_are_no_doors(tmp_path: Path) -> None:
    """A basin, a round corner of a wall, and a table between two walls."""
    doc = new("R2010")
    doc.header["$INSUNITS"] = 6
    space = doc.modelspace()
    space.add_lwpolyline(
        [(0, 0, 0), (9, 0, 0.414), (10, 1, 0), (10, 8, 0), (0, 8, 0)], format="xyb", close=True, dxfattribs=WALL
    )
    space.add_arc((0, 4), 0.4, 270, 90, dxfattribs=OTHER)
    space.add_circle((5, 4), 0.6, dxfattribs=OTHER)
    doc.saveas(tmp_path / "a.dxf")
    report = ImportReport()
    level = import_plan(tmp_path / "a.dxf", report=report).levels[0]
    assert level.doors == ()
    assert report.left_out == {"ARC on A-FINE": 1, "CIRCLE on A-FINE": 1}
    assert len(level.walls) > 8
