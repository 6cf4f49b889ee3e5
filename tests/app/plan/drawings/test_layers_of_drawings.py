# SPDX-License-Identifier: MIT
"""Layers of drawings: what each entity becomes or is counted as, what is hidden, what looks like walls, what is not in the file."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ezdxf.enums import TextEntityAlignment
from ezdxf.math import Matrix44, Vec3
from ezdxf.render.mesh import MeshBuilder

from echostep.errors import EchostepError
from echostep.plan import Plan
from echostep_app.plan.importers.dxf.layers import LAYERS, meaning, patterns_of
from echostep_app.plan.importers.report import ImportReport
from plan.drawings.drawn_houses import WALL, boxes, corners, house, outlines, sheet
from plan.imported_plans import imported_file


def imported(doc: Any, folder: Path, **hints: Any) -> tuple[Plan, ImportReport]:
    doc.saveas(folder / "a.dxf")
    return imported_file(folder / "a.dxf", **hints)


def length_m(plan: Plan) -> float:
    walls = plan.levels[0].walls
    return float(np.hypot(*(walls[:, 2:] - walls[:, :2]).T).sum())


def body(entity: Any) -> None:
    """The text of a body, which nobody reads: without any the entity is not written."""
    entity.sat = ["400 0 1 0", "nobody reads this"]


def body_of(x: float) -> Any:
    """A wall as faces in space."""
    mesh = MeshBuilder()
    mesh.add_mesh(
        vertices=Vec3.list([(x, 20, 0), (x + 0.2, 20, 0), (x + 0.2, 24, 3), (x, 24, 3)]), faces=[(0, 1, 2, 3)]
    )
    return mesh


def test_every_kind_of_entity_is_a_wall_or_counted(tmp_path: Path) -> None:
    """What goes in against what comes out: each entity on a layer of walls gives lines or a count, each on another layer a count."""
    doc, space = sheet()
    house(space)
    lines: dict[str, Callable[[float], Any]] = {
        "LINE": lambda x: space.add_line((x, 20), (x, 24), WALL),
        "LWPOLYLINE": lambda x: space.add_lwpolyline([(x, 20), (x, 24)], dxfattribs=WALL),
        "POLYLINE": lambda x: space.add_polyline2d([(x, 20), (x, 24)], dxfattribs=WALL),
        "ARC": lambda x: space.add_arc((x, 22), 4, 0, 60, dxfattribs=WALL),
        "CIRCLE": lambda x: space.add_circle((x, 22), 0.4, dxfattribs=WALL),
        "ELLIPSE": lambda x: space.add_ellipse((x, 22), (0, 2), 0.3, dxfattribs=WALL),
        "SPLINE": lambda x: space.add_spline([(x, 20), (x + 0.2, 22), (x, 24)], dxfattribs=WALL),
        "SOLID": lambda x: space.add_solid([(x, 20), (x + 0.2, 20), (x, 24), (x + 0.2, 24)], dxfattribs=WALL),
        "TRACE": lambda x: space.add_trace([(x, 20), (x + 0.2, 20), (x, 24), (x + 0.2, 24)], dxfattribs=WALL),
        "3DFACE": lambda x: space.add_3dface([(x, 20), (x + 0.2, 20), (x + 0.2, 24), (x, 24)], dxfattribs=WALL),
        "MLINE": lambda x: space.add_mline([(x, 20), (x, 24)], dxfattribs=WALL | {"scale_factor": 0.2}),
        "HATCH": lambda x: space.add_hatch(dxfattribs=WALL).paths.add_polyline_path(corners((x, 20, x + 0.2, 24)), is_closed=True),
    }  # fmt: skip
    lines |= {
        "HELIX": lambda x: space.add_helix(0.5, 1, 2, dxfattribs=WALL).transform(Matrix44.translate(x, 22, 0)),
        "MESH": lambda x: body_of(x).render_mesh(space, dxfattribs=WALL),
        "polyface mesh": lambda x: body_of(x).render_polyface(space, dxfattribs=WALL),
        "MPOLYGON": lambda x: space.add_mpolygon(dxfattribs=WALL).paths.add_polyline_path(corners((x, 20, x + 0.2, 24)), is_closed=True),
    }  # fmt: skip
    counted: dict[str, Callable[[], Any]] = {
        "3DSOLID": lambda: body(space.add_3dsolid(dxfattribs=WALL)),
        "REGION": lambda: body(space.add_region(dxfattribs=WALL)),
        "BODY": lambda: body(space.add_body(dxfattribs=WALL)),
        "DIMENSION": lambda: space.add_linear_dim((0, 12), (0, 10), (5, 10), dxfattribs=WALL).render(),
        "LEADER": lambda: space.add_leader([(1, 1), (2, 2), (3, 2)], dxfattribs=WALL),
        "SHAPE": lambda: space.add_shape("X", dxfattribs=WALL),
        "ATTDEF": lambda: space.add_attdef("T", (1, 1), "x", dxfattribs=WALL),
        "IMAGE": lambda: space.add_image(doc.add_image_def("a.png", (9, 9)), (1, 1), (3, 3), dxfattribs=WALL),
        "PDFUNDERLAY": lambda: space.add_underlay(doc.add_underlay_def("a.pdf"), (1, 1), dxfattribs=WALL),
        "INSERT without contents": lambda: space.add_blockref(doc.blocks.new("EMPTY").name, (1, 1), dxfattribs=WALL),
        "TEXT": lambda: space.add_text("W1", dxfattribs=WALL).set_placement((0, -9)),  # outside of any room
        "MTEXT": lambda: space.add_mtext("W2", dxfattribs=WALL),
        "POINT": lambda: space.add_point((1, 1), dxfattribs=WALL),
        "XLINE": lambda: space.add_xline((0, 0), (1, 1), dxfattribs=WALL),
        "RAY": lambda: space.add_ray((0, 0), (1, 1), dxfattribs=WALL),
        "HATCH": lambda: space.add_hatch(dxfattribs=WALL).paths.add_polyline_path(corners((1, 1, 3, 3)), is_closed=True),
    }  # fmt: skip
    for k, draw in enumerate(lines.values()):
        draw(20 + 5 * k)
    for draw_one in counted.values():
        draw_one()
    for _ in range(3):
        space.add_line((1, 1), (2, 2), {"layer": "FURNITURE"})
    space.add_circle((1, 1), 1, {"layer": "FURNITURE"})
    plan, report = imported(doc, tmp_path)
    walls = plan.levels[0].walls
    for k, kind in enumerate(lines):
        x = 20 + 5 * k
        near = (walls[:, 1] > 15) & (walls[:, ::2] > x - 1).all(axis=1) & (walls[:, ::2] < x + 4.01).all(axis=1)
        assert near.any(), kind
    expected = Counter({f"{kind} on A-WALL": 1 for kind in counted}) + Counter(
        {"LINE on FURNITURE": 3, "CIRCLE on FURNITURE": 1}
    )
    assert report.left_out == dict(expected)


def test_a_block_that_is_not_in_the_file_is_counted(tmp_path: Path) -> None:
    doc, space = sheet()
    house(space)
    for _ in range(2):
        space.add_blockref("NOT IN THE FILE", (1, 1), dxfattribs=WALL)
    assert imported(doc, tmp_path)[1].left_out == {"INSERT (damaged)": 2}


def test_a_hatch_with_islands_adds_no_walls(tmp_path: Path) -> None:
    doc, space = sheet()
    house(space)
    plain, _ = imported(doc, tmp_path)
    hatch = space.add_hatch(dxfattribs=WALL)
    for box in boxes()[:3]:
        hatch.paths.add_polyline_path(corners(box), is_closed=True)
    hatched, _ = imported(doc, tmp_path)
    assert len(hatched.levels[0].walls) == len(plain.levels[0].walls) == 14
    assert length_m(hatched) == pytest.approx(length_m(plain))


def test_a_multiline_whose_offsets_are_wrong_has_both_faces(tmp_path: Path) -> None:
    """Some programs write offsets that point along the line."""
    doc, space = sheet()
    for box in boxes()[:4]:
        outlines(space, box)
    for y0, y1 in ((0.3, 3.0), (3.9, 7.7)):
        made = space.add_mline([(4, y0), (4, y1)], dxfattribs=WALL | {"scale_factor": 0.2})
        for vertex in made.vertices:
            vertex.miter_direction = vertex.line_direction
    plan, _ = imported(doc, tmp_path)
    faces = [w for w in plan.levels[0].walls.tolist() if w[0] == w[2] and 3.5 < w[0] < 4.5]
    assert len({w[0] for w in faces}) == 2
    assert {round(y, 3) for w in faces for y in (w[1], w[3])} == {0.3, 3.0, 3.9, 7.7}


@pytest.mark.parametrize("hide", ["freeze", "off"])
def test_hidden_layers_are_left_out_and_told(tmp_path: Path, hide: str) -> None:
    doc, space = sheet()
    house(space)
    getattr(doc.layers.add("A-WALL-OLD"), hide)()
    space.add_lwpolyline(corners((6, 0.3, 6.1, 7.7)), close=True, dxfattribs={"layer": "A-WALL-OLD"})
    block = doc.blocks.new("B")
    block.add_line((7, 0.3), (7, 7), {"layer": "A-WALL-OLD"})
    space.add_blockref("B", (0, 0), WALL)
    space.add_line((8, 0.3), (8, 7), WALL | {"invisible": 1})
    plan, report = imported(doc, tmp_path)
    assert len(plan.levels[0].walls) == 14
    word = "frozen" if hide == "freeze" else "off"
    assert report.left_out == {
        f"LWPOLYLINE on A-WALL-OLD ({word})": 1, f"LINE on A-WALL-OLD ({word})": 1, "LINE on A-WALL (invisible)": 1
    }  # fmt: skip


def test_other_layers_that_look_like_walls_are_told(tmp_path: Path) -> None:
    doc, space = sheet()
    house(space)
    for box in ((6, 0.3, 6.1, 7.7), (8, 0.3, 8.1, 7.7)):
        space.add_lwpolyline(corners(box), close=True, dxfattribs={"layer": "P 12"})
    space.add_lwpolyline(corners((1, 1, 2, 2)), close=True, dxfattribs={"layer": "FURNITURE"})
    _, report = imported(doc, tmp_path)
    assert report.doubts == [
        "what looks like walls was left out: P 12 (30 m); --layer walls=A-WALL --layer walls='P 12' takes it in"
    ]
    plan, report = imported(doc, tmp_path, layers={"walls": ["A-WALL", "P 12"]})
    assert report.doubts == []
    assert len(plan.levels[0].walls) > 14


@pytest.mark.parametrize("layer", ["ENTREE_SORTIE", "FLUCHTWEG", "EINGANG", "Issue de secours", "EVACUATION"])
def test_ways_out_are_no_walls_and_their_texts_no_names(tmp_path: Path, layer: str) -> None:
    doc, space = sheet()
    house(space)
    for y in (1.0, 5.0):
        outlines(space, (9.7, y, 10.0, y + 2.0), layer)
    space.add_text("Hall", dxfattribs={"layer": "A-WALL", "insert": (1, 2), "height": 0.2})
    space.add_text("OUT", dxfattribs={"layer": layer, "insert": (6, 2), "height": 0.3})
    plan, report = imported(doc, tmp_path)
    assert [room.name for room in plan.levels[0].rooms] == ["Hall"]
    assert plan.levels[0].questions == ()
    assert report.left_out == {f"LWPOLYLINE on {layer}": 2, f"TEXT on {layer}": 1}


@pytest.mark.parametrize(
    ("layer", "told", "walls"),
    [
        ("A-WALL", r"named as walls have 12 m.*X-17.*--layer walls=A-WALL --layer walls=X-17", 14),
        ("COLUMNA", "no layer has the name of walls but columns.*X-17.*--layer walls=X-17", 18),
    ],
)
def test_most_walls_on_another_layer_are_asked_for(tmp_path: Path, layer: str, told: str, walls: int) -> None:
    doc, space = sheet()
    house(space, "X-17")
    space.add_lwpolyline(corners((9.2, 2, 9.6, 7.6)), close=True, dxfattribs={"layer": layer})
    with pytest.raises(EchostepError, match=told):
        imported(doc, tmp_path)
    assert len(imported(doc, tmp_path, layers={"walls": ["X-17"]})[0].levels[0].walls) == walls


@pytest.mark.parametrize(
    ("layer", "kind"),
    [
        ("A-WALL-INTR", "walls"), ("TABIQUE", "walls"), ("Стены", "walls"), ("PARED_01", "walls"), ("A-WALL-PATT", None), ("Wand-Schraffur", None),
        ("PUERTA", "doors"), ("S-COLS", "columns"), ("A-GLAZ", "windows"), ("A-FLOR-STRS", "stairs"), ("SCALE-BAR", None), ("A-AREA-IDEN", "rooms"),
        ("A-WALL-ABOV", None), ("A-WALL-OVHD", None), ("A-WALL-CNTR", None), ("A-WALL-HEAD", None), ("A-WALL-LOW", "walls"),
        ("Achsen-Wand", None), ("Wandtapete", None), ("Wallpaper", None), ("A-ROOM-WALLFINISH", None),
        ("A-WALL-OPENINGS", "doors"), ("L00_FP_OPENINGS", "doors"), ("WANDOEFFNUNG", "doors"),
    ],
)  # fmt: skip
def test_names_of_layers(layer: str, kind: str | None) -> None:
    assert meaning(layer, LAYERS) == kind
    assert meaning(layer, patterns_of({"walls": [layer]})) == "walls"


def test_a_reference_that_is_not_in_the_file_is_named(tmp_path: Path) -> None:
    doc, space = sheet()
    doc.add_xref_def("..\\plans\\floor-1.dwg", "FLOOR-1")
    space.add_blockref("FLOOR-1", (0, 0))
    with pytest.raises(EchostepError, match=r"only refers to floor-1.dwg \(external reference\): bind it"):
        imported(doc, tmp_path)
    house(space)
    plan, report = imported(doc, tmp_path)
    assert len(plan.levels[0].walls) == 14
    assert "floor-1.dwg is an external reference" in report.doubts[0]


PARTS_OF_TEXT = {  # in shares of its width and height, from the middle to the point that the alignment is about
    "LEFT": (-0.5, -0.5), "RIGHT": (0.5, -0.5), "TOP_CENTER": (0, 0.5), "MIDDLE": (0, 0), "FIT": (-0.5, -0.5), "MTEXT": (-0.5, 0.5),
}  # fmt: skip


@pytest.mark.parametrize("mirrored", [1, -1])
@pytest.mark.parametrize("align", PARTS_OF_TEXT)
def test_a_room_is_at_the_middle_of_its_name(tmp_path: Path, align: str, mirrored: int) -> None:
    """Whatever the alignment: 0.3 m high, letters 0.8 of it wide; the paragraph is two lines of a column."""
    doc, space = sheet()
    house(space)
    across, up = PARTS_OF_TEXT[align]
    if align == "MTEXT":
        text = space.add_mtext("Storeroom 12", dxfattribs={"layer": "Rooms", "char_height": 0.3, "width": 2.0})
        text.dxf.insert = (5 + 2.0 * across, 4 + 0.8 * up)
    else:
        text = space.add_text("Storeroom 12", height=0.3, dxfattribs={"layer": "Rooms"})
        at = (5 + 2.88 * across, 4 + 0.3 * up)
        text.set_placement(at, (at[0] + 2.88, at[1]), align=TextEntityAlignment[align])
    turned = Matrix44.z_rotate(math.radians(40)) @ Matrix44.scale(1, mirrored, 1)
    for entity in space:
        entity.transform(turned)
    (room,) = imported(doc, tmp_path)[0].levels[0].rooms
    assert room.at_m == pytest.approx(tuple(turned.transform((5, 4, 0)))[:2], abs=0.03)


def test_a_name_without_a_direction_is_where_it_is_inserted(tmp_path: Path) -> None:
    doc, space = sheet()
    house(space)
    text = {"layer": "Rooms", "height": 0.3, "insert": (7, 4), "extrusion": (0, 0, 1e308)}
    space.add_text("Hall", dxfattribs=text)
    assert [room.at_m for room in imported(doc, tmp_path)[0].levels[0].rooms] == [(7, 4)]


@pytest.mark.parametrize("degrees", [0.0, 40.0, 90.0])
def test_lines_beneath_each_other_are_one_name(tmp_path: Path, degrees: float) -> None:
    """Number and name of a room in left or middle alignment; the bare area and smaller letters below are counted, other rooms stay apart."""
    doc, space = sheet()
    house(space)
    left, middle = ("1.01", "Store", "12.50", "Tiles", "Hall"), ("1.02", "Lab", "9.90", "Wood", "Lobby")
    for k, (y, height) in enumerate(((5.0, 0.2), (4.7, 0.2), (4.4, 0.2), (4.1, 0.1), (2.0, 0.2))):
        space.add_text(left[k], height=height, dxfattribs={"layer": "Rooms", "insert": (1, y)})
        text = space.add_text(middle[k], height=height, dxfattribs={"layer": "Rooms"})
        text.set_placement((7, y), align=TextEntityAlignment.MIDDLE_CENTER)
    space.add_mtext("Office\\~2", dxfattribs={"layer": "Rooms", "insert": (5, 7), "char_height": 0.2})
    for entity in space:
        entity.transform(Matrix44.z_rotate(math.radians(degrees)))
    plan, report = imported(doc, tmp_path)
    assert {room.name for room in plan.levels[0].rooms} == {"1.01 Store", "1.02 Lab", "Hall", "Lobby", "Office 2"}
    assert report.left_out == {"TEXT on Rooms": 4}


def test_outlines_of_rooms(tmp_path: Path) -> None:
    """An outline takes the texts inside it, once, but no sizes; without one it is numbered, if not repeated or gross; small ones are symbols."""
    doc, space = sheet()
    house(space)
    for box in (*2 * ((0.3, 0.3, 4, 7.7), (4.1, 0.3, 9.7, 7.7)), (5, 5, 5.5, 5.5), (0, 0, 10, 8)):
        space.add_lwpolyline(corners(box), close=True, dxfattribs={"layer": "Rooms"})
    for text in ("%%uHall", "%%uHall", "23,40 m2", "H=2.70"):
        space.add_text(text, dxfattribs={"layer": "Rooms", "insert": (1, 1), "height": 0.3})
    space.add_text("Outside", dxfattribs={"layer": "Rooms", "insert": (20, 1), "height": 0.3})
    plan, report = imported(doc, tmp_path)
    assert [(room.name, room.outline_m is not None) for room in plan.levels[0].rooms] == [
        ("Outside", False), ("Hall", True), ("room 2", True)
    ]  # fmt: skip
    assert report.left_out == {"LWPOLYLINE on Rooms": 1, "TEXT on Rooms": 2}
