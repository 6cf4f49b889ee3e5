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

Box = tuple[float, float, float, float]
Point = tuple[float, float]
Layer = dict[str, Any]
Walls = Callable[[Any, Box, Layer], None]

WIDE, HIGH, OUTER, INNER = 18.0, 12.0, 0.25, 0.12
LOW, UP = 5.0, 7.0  # the corridor
LOW_GAPS, UP_GAPS, ENTRANCE = (
    ((2.0, 2.9), (8.0, 8.9), (16.85, 17.75)),
    ((3.0, 4.0), (9.0, 10.6), (14.0, 14.8)),
    (5.5, 6.6),
)
ROOMS = {"R1": (3, 2), "R2": (9, 2), "R3": (15, 2), "R4": (3, 9), "R5": (9, 9), "R6": (15, 9), "Corridor": (9, 6)}
DOUBLE_M = 1.3  # wider doors have two leaves
WALL, DOOR, PLAIN = {"layer": "A-WALL"}, {"layer": "A-DOOR"}, {"layer": "0"}


def along(y: float, gaps: Sequence[Point]) -> list[Box]:
    """An inner wall from west to east, above y, with gaps."""
    ends = [OUTER, *(x for gap in gaps for x in gap), WIDE - OUTER]
    return [(a, y, b, y + INNER) for a, b in zip(ends[::2], ends[1::2], strict=True) if b > a]


BOXES: list[Box] = [
    (0, 0, WIDE, OUTER), (0, HIGH - OUTER, WIDE, HIGH), (WIDE - OUTER, OUTER, WIDE, HIGH - OUTER),
    (0, OUTER, OUTER, ENTRANCE[0]), (0, ENTRANCE[1], OUTER, HIGH - OUTER), *along(LOW - INNER, LOW_GAPS), *along(UP, UP_GAPS),
    *((x, OUTER, x + INNER, LOW - INNER) for x in (6.0, 12.0)), *((x, UP + INNER, x + INNER, HIGH - OUTER) for x in (6.0, 12.0)),
]  # fmt: skip


class Leaf:
    """A leaf's own axes: `at(a, b)` is a along the gap from the hinge, and b to the side that it swings to; `thick`: of the wall."""

    def __init__(self, hinge: Point, along: Point, side: Point, width: float, thick: float) -> None:
        self.hinge, self.along, self.side, self.width, self.thick = hinge, along, side, width, thick

    def at(self, a: float, b: float) -> tuple[float, float]:
        (x, y), (u, v), (p, q) = self.hinge, self.along, self.side
        return x + a * u + b * p, y + a * v + b * q

    def turned(self, degrees: float, radius: float | None = None) -> tuple[float, float]:
        """The end of the leaf, opened by an angle."""
        radius, angle = self.width if radius is None else radius, math.radians(degrees)
        return self.at(radius * math.cos(angle), radius * math.sin(angle))

    def across(self) -> Leaf:
        """The same leaf, swinging to the other side."""
        return Leaf(self.hinge, self.along, (-self.side[0], -self.side[1]), self.width, self.thick)


Doors = Callable[[Any, Leaf, Layer], None]


def gaps() -> list[Leaf]:
    """The seven gaps; each leaf hangs at the face of its wall."""
    north, south, east = (0.0, 1.0), (0.0, -1.0), (1.0, 0.0)
    rows = [Leaf((a, LOW), (1.0, 0.0), north, b - a, INNER) for a, b in LOW_GAPS]
    rows += [Leaf((b, UP), (-1.0, 0.0), south, b - a, INNER) for a, b in UP_GAPS]
    return [*rows, Leaf((OUTER, ENTRANCE[0]), north, east, ENTRANCE[1] - ENTRANCE[0], OUTER)]


def leaves(gap: Leaf) -> list[Leaf]:
    """One leaf, or two that meet in the middle of a wide gap."""
    if gap.width < DOUBLE_M:
        return [gap]
    back = (-gap.along[0], -gap.along[1])
    half = gap.width / 2
    return [
        Leaf(gap.hinge, gap.along, gap.side, half, gap.thick),
        Leaf(gap.at(gap.width, 0), back, gap.side, half, gap.thick),
    ]


def corners(box: Box) -> list[Point]:
    x0, y0, x1, y1 = box
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


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


def arc(space: Any, leaf: Leaf, layer: Layer, degrees: float = 90) -> None:
    """The swing from the closed leaf to the opened one."""
    x, y = leaf.hinge
    begin, end = (math.degrees(math.atan2(q - y, p - x)) for p, q in (leaf.at(1, 0), leaf.turned(degrees, 1)))
    begin, end = (begin, end) if (end - begin) % 360 < 180 else (end, begin)
    space.add_arc((x, y), leaf.width, begin, end, dxfattribs=layer)


def usual(space: Any, gap: Leaf, layer: Layer) -> None:
    for leaf in leaves(gap):
        arc(space, leaf, layer)
        space.add_line(leaf.hinge, leaf.turned(90), layer)


def in_the_middle_of_the_wall(space: Any, gap: Leaf, layer: Layer) -> None:
    for leaf in leaves(gap):
        usual(space, Leaf(leaf.at(0, -leaf.thick / 2), leaf.along, leaf.side, leaf.width, leaf.thick), layer)


def in_a_frame(space: Any, gap: Leaf, layer: Layer) -> None:
    """Frames of 5 cm at both jambs; the leaf is as much smaller."""
    for a in (0, gap.width - 0.05):
        panel(space, gap, layer, (a, -gap.thick, a + 0.05, 0))
    inner = Leaf(gap.at(0.05, 0), gap.along, gap.side, gap.width - 0.1, gap.thick)
    thick_leaf(space, inner, layer)


def swing_alone(space: Any, gap: Leaf, layer: Layer) -> None:
    for leaf in leaves(gap):
        arc(space, leaf, layer)


def swing_on_another_layer(space: Any, gap: Leaf, _layer: Layer) -> None:
    swing_alone(space, gap, {"layer": "A-FINE"})


def on_the_wall_layer(space: Any, gap: Leaf, _layer: Layer) -> None:
    usual(space, gap, WALL)


def swing_on_the_wall_layer(space: Any, gap: Leaf, _layer: Layer) -> None:
    swing_alone(space, gap, WALL)


def bulge(space: Any, gap: Leaf, layer: Layer) -> None:
    """Leaf and swing as one polyline with a round piece."""
    for leaf in leaves(gap):
        (u, v), (p, q) = leaf.along, leaf.side
        round_ = math.copysign(math.tan(math.pi / 8), v * p - u * q)
        points = [(*leaf.hinge, 0.0), (*leaf.turned(90), round_), (*leaf.turned(0), 0.0)]
        space.add_lwpolyline(points, format="xyb", dxfattribs=layer)


def spline(space: Any, gap: Leaf, layer: Layer) -> None:
    for leaf in leaves(gap):
        space.add_spline([leaf.turned(15 * k) for k in range(7)], dxfattribs=layer)
        space.add_line(leaf.hinge, leaf.turned(90), layer)


def ellipse(space: Any, gap: Leaf, layer: Layer) -> None:
    for leaf in leaves(gap):
        (x, y), ends = leaf.hinge, (leaf.turned(0), leaf.turned(90))
        (a, b), (c, d) = ((p - x, q - y) for p, q in ends)
        begin = ends[0] if a * d - b * c > 0 else ends[1]
        space.add_ellipse((x, y), (begin[0] - x, begin[1] - y), 1.0, 0, math.pi / 2, dxfattribs=layer)
        space.add_line((x, y), leaf.turned(90), layer)


def closed(space: Any, gap: Leaf, layer: Layer) -> None:
    middle = -gap.thick / 2
    space.add_line(gap.at(0, middle), gap.at(gap.width, middle), layer)


def on_layer_0(space: Any, gap: Leaf, _layer: Layer) -> None:
    usual(space, gap, PLAIN)


def thick_leaf(space: Any, gap: Leaf, layer: Layer) -> None:
    for leaf in leaves(gap):
        arc(space, leaf, layer)
        box = [leaf.at(a, b) for a, b in ((0, 0), (0.04, 0), (0.04, leaf.width), (0, leaf.width))]
        space.add_lwpolyline(box, close=True, dxfattribs=layer)


def opened_a_little(space: Any, gap: Leaf, layer: Layer) -> None:
    for leaf in leaves(gap):
        arc(space, leaf, layer, 30)
        space.add_line(leaf.hinge, leaf.turned(30), layer)


def coarse(space: Any, gap: Leaf, layer: Layer) -> None:
    """Leaf and swing as one polyline, the swing in three pieces."""
    for leaf in leaves(gap):
        space.add_lwpolyline([leaf.hinge, *(leaf.turned(angle) for angle in (90, 60, 30, 0))], dxfattribs=layer)


def both_ways(space: Any, gap: Leaf, layer: Layer) -> None:
    """Drawn closed, with a swing to each side."""
    for leaf in leaves(gap):
        arc(space, leaf, layer)
        arc(space, leaf.across(), layer)
        space.add_line(leaf.hinge, leaf.at(leaf.width, 0), layer)


def single_blocks(space: Any, gap: Leaf, layer: Layer) -> None:
    """A block for each leaf, mirrored and scaled, with threshold, frame and a text."""
    name = "LEAF"
    if name not in space.doc.blocks:
        block = space.doc.blocks.new(name)
        block.add_arc((0.05, 0), 0.8, 0, 90, dxfattribs=PLAIN)
        block.add_lwpolyline([(0.05, 0), (0.09, 0), (0.09, 0.8), (0.05, 0.8)], close=True, dxfattribs=PLAIN)
        for a in (0, 0.85):
            block.add_lwpolyline(
                [(a, 0.02), (a + 0.05, 0.02), (a + 0.05, -0.1), (a, -0.1)], close=True, dxfattribs=PLAIN
            )
        block.add_line((0.05, -0.08), (0.85, -0.08), PLAIN)
        block.add_text("T30", height=0.15, dxfattribs=PLAIN)
    for leaf in leaves(gap):
        (u, v), (p, q) = leaf.along, leaf.side
        scale = leaf.width / 0.9
        about = {
            "rotation": math.degrees(math.atan2(v, u)),
            "xscale": scale,
            "yscale": math.copysign(scale, u * q - v * p),
        }
        space.add_blockref(name, leaf.hinge, layer | about)


def leaves_alone(space: Any, gap: Leaf, layer: Layer) -> None:
    for leaf in leaves(gap):
        space.add_line(leaf.hinge, leaf.turned(45), layer)


def panel(space: Any, gap: Leaf, layer: Layer, box: Box) -> None:
    a, b, c, d = box
    space.add_lwpolyline([gap.at(*point) for point in ((a, b), (c, b), (c, d), (a, d))], close=True, dxfattribs=layer)


def sliding(space: Any, gap: Leaf, layer: Layer) -> None:
    """A panel before the wall."""
    panel(space, gap, layer, (-0.05, 0.02, gap.width + 0.05, 0.06))


def pocket(space: Any, gap: Leaf, layer: Layer) -> None:
    """A panel half inside the wall."""
    middle = -gap.thick / 2
    panel(space, gap, layer, (-gap.width / 2, middle - 0.02, gap.width / 2, middle + 0.02))


def two_panels(space: Any, gap: Leaf, layer: Layer) -> None:
    middle, width = -gap.thick / 2, gap.width
    panel(space, gap, layer, (0, middle, 0.55 * width, middle + 0.04))
    panel(space, gap, layer, (0.45 * width, middle - 0.04, width, middle))


def thresholds(space: Any, gap: Leaf, layer: Layer) -> None:
    for b in (0.0, -gap.thick):
        space.add_line(gap.at(0, b), gap.at(gap.width, b), layer)


def folding(space: Any, gap: Leaf, layer: Layer) -> None:
    """Two pairs of panels, half folded."""
    q = gap.width / 4
    for a, s in ((0.0, 1), (gap.width, -1)):
        space.add_lwpolyline(
            [gap.at(a, 0), gap.at(a + s * 0.6 * q, 0.8 * q), gap.at(a + s * 1.2 * q, 0)], dxfattribs=layer
        )


def nothing(_space: Any, _gap: Leaf, _layer: Layer) -> None:
    """A gap alone."""


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
DOOR_STYLES: Sequence[Doors] = (
    usual, on_layer_0, thick_leaf, opened_a_little, coarse, both_ways, single_blocks, sliding, pocket, two_panels, thresholds, folding,
    in_the_middle_of_the_wall, in_a_frame, swing_alone, swing_on_another_layer, on_the_wall_layer, swing_on_the_wall_layer, bulge, spline, ellipse,
    closed,
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
