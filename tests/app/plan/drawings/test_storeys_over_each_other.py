# SPDX-License-Identifier: MIT
"""Storeys that lie over each other in one drawing are levels, by the names of layers and blocks or the heights of walls; or they are told."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from echostep.plan import Plan
from echostep_app.plan.importers.storey_names import in_order, storey_of
from plan.drawings.drawn_houses import WALL, boxes, corners, house, outlines, sheet
from plan.drawings.test_layers_of_drawings import imported


def gaps_m(plan: Plan) -> list[float]:
    """Where the gap in the partition of each level begins."""
    ends = [level.walls.reshape(-1, 2) for level in plan.levels]
    return [min(y for x, y in rows if 3.9 < x < 4.2 and 1.0 < y < 6.0) for rows in ends]


@pytest.mark.parametrize(
    ("low", "high", "names"),
    [
        ("EG_Wand", "OG1_Wand", ["EG", "OG1"]), ("A-WALL-L1", "A-WALL-L2", ["L1", "L2"]), ("L00_FP_WALLS", "L01_FP_WALLS", ["L00", "L01"]),
        ("KG-Wand", "1.OG-Wand", ["KG", "1.OG"]), ("GF-WALL", "FF-WALL", ["GF", "FF"]), ("MUR RDC", "MUR R+1", ["RDC", "R+1"]),
        ("MURO_PB", "MURO_P1", ["PB", "P1"]), ("Wall", "Wall_OG", ["Wall", "OG"]), ("A-WALL-B1", "A-WALL-First floor", ["B1", "First floor"]),
    ],
)  # fmt: skip
@pytest.mark.parametrize("is_turned", [False, True])
def test_layers_that_name_storeys(tmp_path: Path, low: str, high: str, names: list[str], *, is_turned: bool) -> None:
    doc, space = sheet()
    for layer, begin in ((high, 5.0), (low, 3.0)) if is_turned else ((low, 3.0), (high, 5.0)):
        house(space, layer, begin=begin)
    space.add_text("wall", dxfattribs={"layer": "A-WALL-L9", "insert": (1, 1)})
    plan, report = imported(doc, tmp_path)
    assert [level.name for level in plan.levels] == names
    assert gaps_m(plan) == [3.0, 5.0]
    assert (
        f"by the names of layers or blocks it has the storeys {', '.join(names)}, over each other" in report.doubts[0]
    )
    one, _ = imported(doc, tmp_path, windows=[(-1, -1, 11, 9)])
    assert len(one.levels) == 1


def test_blocks_that_name_storeys(tmp_path: Path) -> None:
    doc, space = sheet()
    for name, begin in (("Grundriss OG", 5.0), ("Grundriss EG", 3.0)):
        house(doc.blocks.new(name), begin=begin, door=True)
        space.add_blockref(name, (0, 0))
    plan, _ = imported(doc, tmp_path)
    assert [(level.name, len(level.doors)) for level in plan.levels] == [("EG", 1), ("OG", 1)]
    assert gaps_m(plan) == [3.0, 5.0]


def lifted(space: Any, begin: float, z: float) -> None:
    """The house on a floor at this height, with a name in it."""
    before = len(space)
    house(space, begin=begin, door=True)
    space.add_text(f"Hall {z:g}", dxfattribs={"layer": "ROOM", "insert": (2, 2), "height": 0.3})
    for entity in list(space)[before:]:
        entity.translate(0, 0, z)


def test_heights_of_walls(tmp_path: Path) -> None:
    """Doors and names follow; the plan's heights are those of the drawing."""
    doc, space = sheet()
    lifted(space, 5.0, 115.2)
    lifted(space, 3.0, 112.0)
    plan, report = imported(doc, tmp_path)
    assert [(level.height_m, len(level.doors)) for level in plan.levels] == [(0.0, 1), (3.2, 1)]
    assert [[room.name for room in level.rooms] for level in plan.levels] == [["Hall 112"], ["Hall 115.2"]]
    assert gaps_m(plan) == [3.0, 5.0]
    assert "by the heights of walls it has the storeys 112 m, 115.2 m, over each other" in report.doubts[0]


@pytest.mark.parametrize("tall", [0.0, 2.7, 3.0])
def test_polylines_with_elevation_and_thickness(tmp_path: Path, tall: float) -> None:
    doc, space = sheet()
    for z, begin in ((0.0, 3.0), (3.0, 5.0)):
        for box in boxes(begin):
            about = WALL | {"elevation": z, "thickness": tall}
            space.add_lwpolyline(corners(box), close=True, dxfattribs=about)
    plan, _ = imported(doc, tmp_path)
    assert gaps_m(plan) == [3.0, 5.0]


def test_one_storey_at_several_heights(tmp_path: Path) -> None:
    """Feet, heads and edges of walls; a roof; a line far away."""
    doc, space = sheet()
    for box in boxes():
        for z in (0.0, 2.8):
            ring = corners(box)
            space.add_polyline3d([(*at, z) for at in (*ring, ring[0])], dxfattribs=WALL)
        for x, y in corners(box):
            space.add_line((x, y, 0), (x, y, 2.8), WALL)
    space.add_line((0, 0, 6), (10, 8, 6), WALL)
    space.add_line((1, 1, 1e9), (1, 3, 1e9), WALL)
    plan, report = imported(doc, tmp_path)
    assert len(plan.levels) == 1
    assert not any("storeys" in doubt for doubt in report.doubts)


def test_kinds_of_partitions_are_no_storeys(tmp_path: Path) -> None:
    doc, space = sheet()
    for k, box in enumerate(boxes()):
        outlines(space, box, "A-WALL-P1" if k < 4 else "A-WALL-P2")
    plan, report = imported(doc, tmp_path)
    assert len(plan.levels) == 1
    assert "storeys P1, P2, but they do not lie over each other" in report.doubts[0]


@pytest.mark.parametrize("other", ["A-WALL-X", "X-17"])
def test_storeys_that_nothing_names_are_told_and_not_advised(tmp_path: Path, other: str) -> None:
    doc, space = sheet()
    house(space, begin=2.0)
    house(space, other, begin=5.0)
    _, report = imported(doc, tmp_path)
    told = [doubt for doubt in report.doubts if "another storey? End the names of its layers with _L1" in doubt]
    assert len(told) == 1
    assert other in told[0]
    assert not any("takes it in" in doubt for doubt in report.doubts)


def test_cells_beside_each_other_are_no_storeys(tmp_path: Path) -> None:
    doc, space = sheet()
    for k in range(32):
        outlines(space, (6.0 * (k // 2), 8.0 * (k % 2), 6.0 * (k // 2) + 3.0, 8.0 * (k % 2) + 4.0))
    _, report = imported(doc, tmp_path)
    assert not any("storeys" in doubt for doubt in report.doubts)


@pytest.mark.parametrize(
    ("name", "number"),
    [
        ("1.OG_Wand_115", 1), ("Wand OG 1", 1), ("Level -1", -1), ("Level \u22122", -2), ("LEVEL-1", 1), ("2nd Floor", 2), ("Ground floor", 0),
        ("Rez-de-chaussée", 0), ("1er étage", 1), ("Sous-sol 2", -2), ("UG2", -2), ("R-1", -1), ("primo piano", 1), ("Planta baja", 0), ("B1F", -1),
        ("Erdgeschoß", 0), ("Dachgeschoss", 99), ("og 9999999999", 1), ("Wand_115", None), ("A-WALL-E30", None), ("EG_OG_Treppe", None), ("", None),
        ("STAIRWELL", None), ("A-WALL", None), ("9" * 9999, None),
    ],
)  # fmt: skip
def test_names_of_storeys(name: str, number: int | None) -> None:
    assert (None if (storey := storey_of(name)) is None else storey.number) == number


def test_the_order_of_storeys() -> None:
    assert in_order(["OG", "b", "EG"]) == ["OG", "b", "EG"]
    assert in_order(["1.OG", "L0", "KG"]) == ["KG", "L0", "1.OG"]
