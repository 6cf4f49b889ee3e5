# SPDX-License-Identifier: MIT
"""Importing drawings: what each entity becomes, units, layers, doors, and what a damaged one gets."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from ezdxf.filemanagement import new

from echostep.errors import EchostepError
from echostep.plan import Plan
from echostep_app.plan.importers.dxf import entities as dxf_entities
from echostep_app.plan.importers.formats import import_plan
from echostep_app.plan.importers.report import Hints


def drawing(insunits: int = 6) -> tuple[Any, Any]:
    doc = new("R2010")
    doc.header["$INSUNITS"] = insunits
    for layer in ("A-WALL", "A-GLAZ", "A-DOOR", "Stairs", "A-ROOM", "Furniture"):
        doc.layers.add(layer)
    return doc, doc.modelspace()


def imported(doc: Any, folder: Path, **hints: Any) -> Plan:
    doc.saveas(folder / "ground.dxf")
    return import_plan(folder / "ground.dxf", Hints(**hints))


def walls_of(plan: Plan) -> set[tuple[tuple[float, ...], ...]]:
    return {tuple(sorted((tuple(w[:2]), tuple(w[2:])))) for w in plan.levels[0].walls.tolist()}


def test_pieces_of_one_wall_are_one(tmp_path: Path) -> None:
    doc, space = drawing()
    for x in range(10):
        space.add_line((x, 0), (x + 1, 0), {"layer": "A-WALL"})
        space.add_line((x + 1, 0), (x, 0), {"layer": "A-WALL"})
    space.add_line((3, 0), (3, 4), {"layer": "A-WALL"})
    assert walls_of(imported(doc, tmp_path)) == {((0, 0), (10, 0)), ((3, 0), (3, 4))}


def with_gap() -> tuple[Any, Any]:
    doc, space = drawing()
    space.add_line((0, 0), (4, 0), {"layer": "A-WALL"})
    space.add_line((5, 0), (9, 0), {"layer": "A-WALL"})
    return doc, space


def test_hostile_drawings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dxf_entities, "MOST_PARTS", 3000)
    doc, space = drawing()
    space.add_line((0, 0), (5, 0), {"layer": "A-WALL"})
    space.add_line((0, 0), (5e8, 0), {"layer": "A-WALL"})
    with pytest.raises(EchostepError, match=r"ground.dxf: layer 'A-WALL': LINE is 100 km away"):
        imported(doc, tmp_path)
    doc, space = drawing()
    names = [f"B{i}" for i in range(8)]
    doc.blocks.new(names[0]).add_line((0, 0), (1, 0))
    for inner, outer in zip(names, names[1:], strict=False):
        block = doc.blocks.new(outer)
        for i in range(10):
            block.add_blockref(inner, (i, 0))
    space.add_blockref(names[-1], (0, 0), {"layer": "A-WALL"})
    with pytest.raises(EchostepError, match="more than 3000 parts"):
        imported(doc, tmp_path)
    doc, space = drawing()
    doc.blocks.new("GRID").add_line((0, 0), (1, 0))
    space.add_blockref(
        "GRID",
        (0, 0),
        {"layer": "A-WALL", "row_count": 30000, "column_count": 30000, "row_spacing": 1, "column_spacing": 1},
    )
    with pytest.raises(EchostepError, match="repeated"):
        imported(doc, tmp_path)


@pytest.mark.parametrize(("deep", "walls"), [(16, 5), (17, 4)])
def test_blocks_in_blocks_are_read_to_a_depth(tmp_path: Path, deep: int, walls: int) -> None:
    doc, space = drawing()
    for a, b in (((0, 0), (4, 0)), ((4, 0), (4, 4)), ((4, 4), (0, 4)), ((0, 4), (0, 0))):
        space.add_line(a, b, {"layer": "A-WALL"})
    doc.blocks.new("B1").add_line((2, 0), (2, 3), {"layer": "A-WALL"})
    for k in range(2, deep + 1):
        doc.blocks.new(f"B{k}").add_blockref(f"B{k - 1}", (0, 0), {"layer": "A-WALL"})
    space.add_blockref(f"B{deep}", (0, 0), {"layer": "A-WALL"})
    assert len(walls_of(imported(doc, tmp_path))) == walls


def test_room_numbers_of_blocks(tmp_path: Path) -> None:
    """Room tags are often attributes of a block."""
    doc, space = with_gap()
    doc.blocks.new("TAG")
    layer = {"layer": "A-ROOM", "height": 0.2}
    space.add_blockref("TAG", (2, 2), {"layer": "A-ROOM"}).add_attrib("NUMBER", "2.14", (2, 2), layer)
    assert [(room.name, room.at_m) for room in imported(doc, tmp_path).levels[0].rooms] == [("2.14", (2.32, 2.1))]
    beside = space.add_blockref("TAG", (6, 2), {"layer": "A-ROOM"})
    texts = {"NUMBER": "101", "ROOM_NAME": "Office", "DEPT": "Sales", "FINISH": "Carpet", "OCC": "Ann"}
    for k, (tag, text) in enumerate(texts.items()):
        beside.add_attrib(tag, text, (6 + 0.5 * (k % 2), 2 - 0.6 * k), layer)
    assert [room.name for room in imported(doc, tmp_path).levels[0].rooms] == ["2.14", "101 Office"]
    tag = space.add_blockref("TAG", (8, 2), {"layer": "A-ROOM"}).add_attrib("ROOM_NAME", "Meeting", (8, 2), layer)
    tag.embed_mtext(space.add_mtext("Meeting\\PNorth"))
    doc.dxfversion = "R2018"
    assert [room.name for room in imported(doc, tmp_path).levels[0].rooms] == ["2.14", "101 Office", "Meeting North"]
