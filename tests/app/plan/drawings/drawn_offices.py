# SPDX-License-Identifier: MIT
"""An office drawn with ezdxf in the habits of many drawing offices: entities of walls, symbols of doors, layers, blocks, frames.

18 m by 12 m, six rooms along a corridor, seven doors: one in a corner, one double (1.6 m), the entrance in a wall of 0.25 m; inner walls are 0.12 m.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ezdxf.filemanagement import new
from ezdxf.math import Matrix44

from plan.drawings.drawn_doors import PLAIN, Box, Doors, Layer, Leaf, Point, usual
from plan.drawings.drawn_houses import corners

Walls = Callable[[Any, Box, Layer], None]

WIDE, HIGH, OUTER, INNER = 18.0, 12.0, 0.25, 0.12
LOW, UP = 5.0, 7.0  # the corridor
LOW_GAPS, UP_GAPS, ENTRANCE = (
    ((2.0, 2.9), (8.0, 8.9), (16.85, 17.75)),
    ((3.0, 4.0), (9.0, 10.6), (14.0, 14.8)),
    (5.5, 6.6),
)
ROOMS = {"R1": (3, 2), "R2": (9, 2), "R3": (15, 2), "R4": (3, 9), "R5": (9, 9), "R6": (15, 9), "Corridor": (9, 6)}


def along(y: float, gaps: Sequence[Point]) -> list[Box]:
    """An inner wall from west to east, above y, with gaps."""
    ends = [OUTER, *(x for gap in gaps for x in gap), WIDE - OUTER]
    return [(a, y, b, y + INNER) for a, b in zip(ends[::2], ends[1::2], strict=True) if b > a]


BOXES: list[Box] = [
    (0, 0, WIDE, OUTER), (0, HIGH - OUTER, WIDE, HIGH), (WIDE - OUTER, OUTER, WIDE, HIGH - OUTER),
    (0, OUTER, OUTER, ENTRANCE[0]), (0, ENTRANCE[1], OUTER, HIGH - OUTER), *along(LOW - INNER, LOW_GAPS), *along(UP, UP_GAPS),
    *((x, OUTER, x + INNER, LOW - INNER) for x in (6.0, 12.0)), *((x, UP + INNER, x + INNER, HIGH - OUTER) for x in (6.0, 12.0)),
]  # fmt: skip


def gaps() -> list[Leaf]:
    """The seven gaps; each leaf hangs at the face of its wall."""
    north, south, east = (0.0, 1.0), (0.0, -1.0), (1.0, 0.0)
    rows = [Leaf((a, LOW), (1.0, 0.0), north, b - a, INNER) for a, b in LOW_GAPS]
    rows += [Leaf((b, UP), (-1.0, 0.0), south, b - a, INNER) for a, b in UP_GAPS]
    return [*rows, Leaf((OUTER, ENTRANCE[0]), north, east, ENTRANCE[1] - ENTRANCE[0], OUTER)]


def axis(box: Box) -> tuple[Point, Point, float]:
    """Both ends of a wall's axis, and its thickness."""
    x0, y0, x1, y1 = box
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    return ((x0, y), (x1, y), y1 - y0) if x1 - x0 > y1 - y0 else ((x, y0), (x, y1), x1 - x0)


def outlines(space: Any, box: Box, layer: Layer) -> None:
    space.add_lwpolyline(corners(box), close=True, dxfattribs=layer)


def old_polylines(space: Any, box: Box, layer: Layer) -> None:
    space.add_polyline2d(corners(box), close=True, dxfattribs=layer)


def polylines_at_a_height(space: Any, box: Box, layer: Layer) -> None:
    space.add_polyline3d([(x, y, 2.7) for x, y in (*corners(box), corners(box)[0])], dxfattribs=layer)


def sides(box: Box) -> list[tuple[Point, Point]]:
    points = corners(box)
    return list(zip(points, [*points[1:], points[0]], strict=True))


def four_lines(space: Any, box: Box, layer: Layer) -> None:
    for a, b in sides(box):
        space.add_line(a, b, layer)


def two_faces(space: Any, box: Box, layer: Layer) -> None:
    """Without the wall's ends."""
    for a, b in sorted(sides(box), key=lambda pair: -math.dist(*pair))[:2]:
        space.add_line(a, b, layer)


def short_pieces(space: Any, box: Box, layer: Layer) -> None:
    for (x, y), (p, q) in sides(box):
        count = max(1, int(math.dist((x, y), (p, q)) / 0.6))
        points = [(x + (p - x) * k / count, y + (q - y) * k / count) for k in range(count + 1)]
        for a, b in zip(points, points[1:], strict=False):
            space.add_line(a, b, layer)


def drawn_twice(space: Any, box: Box, layer: Layer) -> None:
    four_lines(space, box, layer)
    outlines(space, box, layer)


def wide_polylines(space: Any, box: Box, layer: Layer) -> None:
    a, b, thick = axis(box)
    even = a[0] == b[0]
    ends: list[Any] = [a, b] if even else [(*a, thick, thick), (*b, 0, 0)]
    space.add_lwpolyline(ends, format="xyse", dxfattribs=layer | ({"const_width": thick} if even else {}))


def multilines(space: Any, box: Box, layer: Layer) -> None:
    a, b, thick = axis(box)
    space.add_mline([a, b], dxfattribs=layer | {"scale_factor": thick, "justification": 1})


def hatches(space: Any, box: Box, layer: Layer) -> None:
    path = space.add_hatch(dxfattribs=layer).paths.add_edge_path()
    for a, b in sides(box):
        path.add_line(a, b)


def faces_of_bodies(space: Any, box: Box, layer: Layer) -> None:
    space.add_3dface(corners(box), dxfattribs=layer)


def filled(space: Any, box: Box, layer: Layer) -> None:
    a, b, c, d = corners(box)
    space.add_trace([a, b, d, c], dxfattribs=layer)


def along_the_middle(space: Any, box: Box, layer: Layer) -> None:
    """One line; walls end at the axes of those that they meet."""
    (x, y), (p, q), _ = axis(box)
    reach = OUTER / 2 + INNER / 2
    if y == q:
        x, p = x - reach * (x == OUTER), p + reach * (p == WIDE - OUTER)
    else:
        y, q = y - reach * (y in (OUTER, UP + INNER)), q + reach * (q in (HIGH - OUTER, LOW - INNER))
    space.add_line((x, y), (p, q), layer)


def mirrored_axes(space: Any, box: Box, layer: Layer) -> None:
    """As MIRROR leaves them: the entity's own axes look down."""
    points = [(-x, y) for x, y in corners(box)]
    space.add_lwpolyline(points, close=True, dxfattribs=layer | {"extrusion": (0, 0, -1)})


def scaled_blocks(space: Any, box: Box, layer: Layer) -> None:
    """A unit square, mirrored inside another block, stretched to the wall."""
    x0, y0, x1, y1 = box
    name = f"W{len(space.doc.blocks)}"
    outlines(space.doc.blocks.new(name), (0, 0, 1, 1), PLAIN)
    space.doc.blocks.new(name + "-OUTER").add_blockref(name, (0, 0), PLAIN | {"xscale": -1})
    space.add_blockref(name + "-OUTER", (x1, y0), layer | {"xscale": x1 - x0, "yscale": y1 - y0})


def furnished(space: Any) -> None:
    """Basins, chairs, desks, the axes of the building, a frame around the sheet, hatching of the walls."""
    for x in (1.0, 1.6, 2.2):
        space.add_ellipse((x, 0.6), (0.25, 0), 0.7, dxfattribs={"layer": "A-FLOR-FIXT"})
    for x in (13.0, 14.0, 15.0):
        outlines(space, (x, 8, x + 0.8, 8.8), {"layer": "FURNITURE"})
        space.add_arc((x + 0.4, 9), 0.25, 0, 180, dxfattribs={"layer": "FURNITURE"})
    for x in (0.0, 6.0, 12.0, 18.0):
        space.add_line((x, -2), (x, 14), {"layer": "GRID"})
    outlines(space, (-5, -5, 37, 24.7), {"layer": "FRAME"})
    for box in BOXES:
        hatch = space.add_hatch(dxfattribs={"layer": "A-WALL-PATT"})
        hatch.set_pattern_fill("ANSI31", scale=0.05)
        hatch.paths.add_polyline_path(corners(box), is_closed=True)


WALL_STYLES: Sequence[Walls] = (
    outlines, old_polylines, polylines_at_a_height, four_lines, two_faces, short_pieces, drawn_twice, wide_polylines, multilines, hatches,
    faces_of_bodies, filled, mirrored_axes, scaled_blocks, along_the_middle,
)  # fmt: skip


def write_office(
    path: Path,
    walls: Walls = outlines,
    door: Doors = usual,
    *,
    layers: tuple[str, str] = ("A-WALL", "A-DOOR"),
    turn: float = 0.0,
    mirrored: bool = False,
    extra: Callable[[Any], None] | None = None,
) -> Path:
    """The office as a file in metres, turned by degrees; mirrored: one block, inserted with a negative scale."""
    doc = new("R2010")
    doc.header["$INSUNITS"] = 6
    space = doc.blocks.new("OFFICE") if mirrored else doc.modelspace()
    for box in BOXES:
        walls(space, box, {"layer": layers[0]})
    for gap in gaps():
        door(space, gap, {"layer": layers[1]})
    for name, at in ROOMS.items():
        space.add_text(name, height=0.25, dxfattribs={"layer": "A-AREA-IDEN"}).set_placement(at)
    if extra is not None:
        extra(space)
    if mirrored:
        doc.modelspace().add_blockref("OFFICE", (WIDE, 0), {"xscale": -1})
    for entity in list(doc.modelspace()):
        entity.transform(Matrix44.z_rotate(math.radians(turn)))
    doc.saveas(path)
    return path
