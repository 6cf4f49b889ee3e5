# SPDX-License-Identifier: MIT
"""The house as drawings (DXF), a file for each storey."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ezdxf.filemanagement import new
from ezdxf.math import Matrix44
from ezdxf.xclip import XClip

from plan.drawings.drawn_doors import Doors, Layer, Leaf, arc, leaves, usual
from plan.drawings.drawn_offices import Walls, outlines
from plan.habits.house import ROOMS, STAIRS, STOREYS, Line, Move, boxes, doors_on

PLAIN = {"layer": "0"}


def leaf(door: Line, thick: float) -> Leaf:
    """The leaf of a door, hung at the face of its wall."""
    x0, y0, x1, y1 = door
    if x0 == x1:
        return Leaf((x0 + thick / 2, y0), (0.0, 1.0), (1.0, 0.0), y1 - y0, thick)
    return Leaf((x0, y0 + thick / 2), (1.0, 0.0), (0.0, 1.0), x1 - x0, thick)


def draw(space: Any, storey: int, thick: float, walls: Walls, door: Doors, layers: tuple[str, str], names: str) -> None:
    """A storey in metres."""
    for box in boxes(storey, thick):
        walls(space, box, {"layer": layers[0]})
    for line in doors_on(storey):
        door(space, leaf(line, thick), {"layer": layers[1]})
    for name, box in ROOMS.items():
        space.add_text(name, height=0.25, dxfattribs={"layer": names}).set_placement((box[0] + 2, 2))
    x0, y0, x1, y1 = STAIRS
    for k in range(11):
        space.add_line((x0 + 0.2 * k, y0), (x0 + 0.2 * k, y1), {"layer": "A-STRS"})
    for y in (y0, y1):
        space.add_line((x0, y), (x1, y), {"layer": "A-STRS"})


def files(
    folder: Path, move: Move, *, thick: float = 0.2, walls: Walls = outlines, door: Doors = usual, layers: tuple[str, str] = ("A-WALL", "A-DOOR"),
    names: str = "A-AREA-IDEN", units: int = 6, unit: float = 1.0, fmt: str = "asc", change: Callable[[Any], Any] = id,
) -> list[Path]:  # fmt: skip
    """A file for each storey, in units of `unit` metres; `change` alters a drawing before it is moved."""
    paths = [folder / f"f{k}.dxf" for k in STOREYS]
    for k, path in enumerate(paths):
        doc = new("R2010", units=units)
        space: Any = doc.modelspace()
        draw(space, k, thick, walls, door, layers, names)
        change(doc)
        entities = move.ordered(list(space))
        for entity in entities:
            space.unlink_entity(entity)
            space.add_entity(entity)
            entity.transform(
                Matrix44.z_rotate(move.turn) @ Matrix44.translate(move.x, move.y, 0) @ Matrix44.scale(1 / unit)
            )
        doc.saveas(path, fmt=fmt)
    return paths


def blocked(
    doc: Any, *, about: Layer | None = None, scale: float = 1.0, mirror: bool = False, clip: bool = False
) -> None:
    """All of a drawing in a block, in an anonymous block, clipped to the house: the block has more; drawn larger or mirrored."""
    space, block = doc.modelspace(), doc.blocks.new("HOUSE")
    for entity in list(space):
        space.unlink_entity(entity)
        block.add_entity(entity)
        entity.transform(Matrix44.scale(-1 / scale if mirror else 1 / scale, 1 / scale, 1 / scale))
    outer = doc.blocks.new_anonymous_block()
    insert = outer.add_blockref(
        "HOUSE", (0, 0), PLAIN | {"xscale": -scale if mirror else scale, "yscale": scale} | (about or {})
    )
    if clip:
        block.add_lwpolyline([(20, 0), (26, 0), (26, 5)], dxfattribs={"layer": "A-WALL"})
        XClip(insert).set_block_clipping_path([(-1, -1), (13, 9)])
    space.add_blockref(outer.name, (0, 0), PLAIN)


def hidden(doc: Any, state: str) -> None:
    """A wall across the office that is not shown."""
    about: Layer = {"layer": "A-WALL-OLD"}
    layer = doc.layers.add("A-WALL-OLD")
    if state == "invisible":
        about["invisible"] = 1
    else:
        getattr(layer, state)()
    doc.modelspace().add_line((2, 0), (2, 8), about)


def sheet(doc: Any, parts: str) -> None:
    """A frame, the title block at its corner, a north arrow: on the layer of the walls."""
    shapes: dict[str, list[Any]] = {
        "frame": [[(-8, -12), (34, -12), (34, 17.7), (-8, 17.7), (-8, -12)]],
        "title": [[(16, -12), (34, -12), (34, -6), (16, -6), (16, -12)], *([(16, y), (34, y)] for y in (-10, -8))],
        "arrow": [[(20, 4), (21, 7), (22, 4), (21, 4.6), (20, 4)]],
    }
    for part in parts.split():
        for points in shapes[part]:
            doc.modelspace().add_lwpolyline(points, dxfattribs={"layer": "A-WALL"})


def titles(doc: Any) -> None:
    """Words beside the house, on the layer of the rooms' names."""
    for k, words in enumerate(("Ground floor", "Scale 1:100", "N")):
        doc.modelspace().add_text(words, dxfattribs={"layer": "A-AREA-IDEN", "height": 0.3}).set_placement((14, 2 + k))


def drawn_through(doc: Any) -> None:
    """The faces of the partition, through its door."""
    for x in (4.9, 5.1):
        doc.modelspace().add_line((x, 2), (x, 5), {"layer": "A-WALL"})


def on_paper(doc: Any) -> None:
    """All of it on a layout."""
    for entity in list(doc.modelspace()):
        doc.modelspace().unlink_entity(entity)
        doc.layout("Layout1").add_entity(entity)


def on_paper_beside_a_point(doc: Any) -> None:
    on_paper(doc)
    doc.modelspace().add_point((0, 0))


def exits(doc: Any) -> None:
    """The entrance on a layer of its own."""
    for entity in doc.modelspace().query('ARC LINE[layer=="A-DOOR"]'):
        at = entity.dxf.center if entity.dxftype() == "ARC" else entity.dxf.start
        if at.x > 6:
            entity.dxf.layer = "EXITS"


def shut(space: Any, gap: Leaf, layer: Layer) -> None:
    """The leaf drawn closed, beside its swing."""
    for one in leaves(gap):
        arc(space, one, layer)
        space.add_line(one.hinge, one.at(one.width, 0), layer)


def two_leaves(space: Any, gap: Leaf, layer: Layer, first: float = 0.6) -> None:
    """One wide leaf and one narrow one."""
    back = (-gap.along[0], -gap.along[1])
    for hinge, along, width in ((gap.hinge, gap.along, first), (gap.at(gap.width, 0), back, gap.width - first)):
        usual(space, Leaf(hinge, along, gap.side, width, gap.thick), layer)
