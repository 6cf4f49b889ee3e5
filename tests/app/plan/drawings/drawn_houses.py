# SPDX-License-Identifier: MIT
"""A house drawn with ezdxf in the ways that people draw: walls and one door, each in several styles, turned, moved, in any unit.

The house is 10 m by 8 m with a partition of 0.1 m at x 4.0 to 4.1, which has a gap; the outer walls are 0.3 m thick. The hinge is at the gap's lower
jamb.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ezdxf.filemanagement import new
from ezdxf.math import Matrix44

Box = tuple[float, float, float, float]
Walls = Callable[[Any, Box], None]
Doors = Callable[[Any, "Gap"], None]
WALL, DOOR, OTHER = {"layer": "A-WALL"}, {"layer": "A-DOOR"}, {"layer": "A-FINE"}


class Gap:
    """The gap: x of the partition's middle and of its right face, y of both jambs, width."""

    def __init__(self, begin: float = 3.0, end: float = 3.9) -> None:
        self.x, self.face, self.begin, self.end, self.width = 4.05, 4.1, begin, end, end - begin

    @property
    def line(self) -> Box:
        """From jamb to jamb."""
        return self.x, self.begin, self.x, self.end


def boxes(gap: Gap) -> list[Box]:
    """The walls as rectangles."""
    outer = [(0, 0, 10, 0.3), (0, 7.7, 10, 8), (0, 0.3, 0.3, 7.7), (9.7, 0.3, 10, 7.7)]
    partition = [(4, 0.3, 4.1, gap.begin), (4, gap.end, 4.1, 7.7)]
    return [*outer, *((x0, y0, x1, y1) for x0, y0, x1, y1 in partition if y1 > y0)]


def corners(box: Box) -> list[tuple[float, float]]:
    """The corners of a rectangle."""
    x0, y0, x1, y1 = box
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def outlines(space: Any, box: Box) -> None:
    """A closed polyline."""
    space.add_lwpolyline(corners(box), close=True, dxfattribs=WALL)


def faces(space: Any, box: Box) -> None:
    """Both faces as lines, without ends."""
    x0, y0, x1, y1 = box
    sides = [(x0, y0, x1, y0), (x0, y1, x1, y1)] if x1 - x0 > y1 - y0 else [(x0, y0, x0, y1), (x1, y0, x1, y1)]
    for a, b, c, d in sides:
        space.add_line((a, b), (c, d), WALL)


def axes(space: Any, box: Box) -> None:
    """One line along the middle; outer walls meet at their corners."""
    (x0, y0), (x1, y1) = middle(box)
    space.add_line((x0, y0), (x1, y1), WALL)


def middle(box: Box) -> tuple[tuple[float, float], tuple[float, float]]:
    """Both ends of a wall's axis; into the walls that it ends at."""
    x0, y0, x1, y1 = box
    if x1 - x0 > y1 - y0:
        return (x0, (y0 + y1) / 2), (x1, (y0 + y1) / 2)
    low, high = (y - 0.15 if y == 0.3 else y + 0.15 if y == 7.7 else y for y in (y0, y1))
    return ((x0 + x1) / 2, low), ((x0 + x1) / 2, high)


def hatches(space: Any, box: Box) -> None:
    """A solid hatch alone."""
    space.add_hatch(dxfattribs=WALL).paths.add_polyline_path(corners(box), is_closed=True)


def solids(space: Any, box: Box) -> None:
    """A filled quadrilateral."""
    a, b, c, d = corners(box)
    space.add_solid([a, b, d, c], dxfattribs=WALL)


def multilines(space: Any, box: Box) -> None:
    """A multiline of two elements along the middle."""
    x0, y0, x1, y1 = box
    thick = min(x1 - x0, y1 - y0)
    line = middle(box) if thick > 0.2 else (((x0 + x1) / 2, y0), ((x0 + x1) / 2, y1))
    space.add_mline(line, dxfattribs=WALL | {"scale_factor": thick, "justification": 1})


def blocks(space: Any, box: Box) -> None:
    """A block in a block, on layer 0 inside."""
    name = f"W{len(space.doc.blocks)}"
    space.doc.blocks.new(name).add_lwpolyline(corners(box), close=True, dxfattribs={"layer": "0"})
    space.doc.blocks.new(name + "-OUTER").add_blockref(name, (0, 0), {"layer": "0"})
    space.add_blockref(name + "-OUTER", (0, 0), WALL)


def arc(target: Any, x: float, y: float, radius: float, sweep: float = 90, layer: dict[str, str] = DOOR) -> None:
    """A swing from the open leaf (along x) to the jamb above."""
    target.add_arc((x, y), radius, 90 - sweep, 90, dxfattribs=layer)


def leaf(target: Any, x: float, y: float, radius: float, angle: float = 0.0) -> None:
    """A leaf as a line."""
    a = math.radians(angle)
    target.add_line((x, y), (x + radius * math.cos(a), y + radius * math.sin(a)), DOOR)


def loose(space: Any, gap: Gap) -> None:
    arc(space, gap.x, gap.begin, gap.width)
    leaf(space, gap.x, gap.begin, gap.width)


def at_the_face(space: Any, gap: Gap) -> None:
    arc(space, gap.face, gap.begin, gap.width)
    leaf(space, gap.face, gap.begin, gap.width)


def in_a_frame(space: Any, gap: Gap) -> None:
    """Frames of 5 cm at both jambs; the leaf is as much smaller, and a rectangle."""
    for y in (gap.begin, gap.end - 0.05):
        space.add_lwpolyline(corners((4.0, y, 4.1, y + 0.05)), close=True, dxfattribs=DOOR)
    arc(space, gap.face, gap.begin + 0.05, gap.width - 0.1)
    space.add_lwpolyline(
        corners((gap.face, gap.begin + 0.05, gap.face + gap.width - 0.1, gap.begin + 0.09)), close=True, dxfattribs=DOOR
    )


def half_open(space: Any, gap: Gap) -> None:
    arc(space, gap.x, gap.begin, gap.width, 45)
    leaf(space, gap.x, gap.begin, gap.width, 45)


def arc_alone(space: Any, gap: Gap) -> None:
    arc(space, gap.x, gap.begin, gap.width)


def leaf_alone(space: Any, gap: Gap) -> None:
    leaf(space, gap.x, gap.begin, gap.width)


def threshold(space: Any, gap: Gap) -> None:
    loose(space, gap)
    for x in (4.0, 4.1):
        space.add_line((x, gap.begin), (x, gap.end), DOOR)


def bulge(space: Any, gap: Gap) -> None:
    points = [(gap.x, gap.begin, 0.0), (gap.x + gap.width, gap.begin, math.tan(math.pi / 8)), (gap.x, gap.end, 0.0)]
    space.add_lwpolyline(points, format="xyb", dxfattribs=DOOR)


def chain(space: Any, gap: Gap) -> None:
    turns = [math.radians(5 * k) for k in range(19)]
    arc_points = [(gap.x + gap.width * math.cos(a), gap.begin + gap.width * math.sin(a)) for a in turns]
    space.add_lwpolyline([(gap.x, gap.begin), *arc_points], dxfattribs=DOOR)


def spline(space: Any, gap: Gap) -> None:
    turns = [math.radians(15 * k) for k in range(7)]
    space.add_spline(
        [(gap.x + gap.width * math.cos(a), gap.begin + gap.width * math.sin(a)) for a in turns], dxfattribs=DOOR
    )
    leaf(space, gap.x, gap.begin, gap.width)


def ellipse(space: Any, gap: Gap) -> None:
    space.add_ellipse((gap.x, gap.begin), (gap.width, 0), 1.0, 0, math.pi / 2, dxfattribs=DOOR)
    leaf(space, gap.x, gap.begin, gap.width)


def block(space: Any, gap: Gap) -> None:
    """A block drawn for 1 m along x, mirrored, turned and scaled into the gap."""
    made = space.doc.blocks.new("DOOR")
    made.add_arc((0, 0), 1, 270, 360, dxfattribs={"layer": "0"})
    made.add_line((0, 0), (0, -1), {"layer": "0"})
    space.add_blockref("DOOR", (gap.x, gap.begin), DOOR | {"rotation": 90, "xscale": gap.width, "yscale": gap.width})


def mirrored_block(space: Any, gap: Gap) -> None:
    made = space.doc.blocks.new("DOOR")
    made.add_arc((0, 0), 1, 0, 90, dxfattribs={"layer": "0"})
    made.add_line((0, 0), (0, 1), {"layer": "0"})
    space.add_blockref("DOOR", (gap.x, gap.begin), DOOR | {"rotation": 90, "xscale": gap.width, "yscale": -gap.width})


def arc_elsewhere(space: Any, gap: Gap) -> None:
    """The swing on a layer that is not of doors, nothing else."""
    arc(space, gap.x, gap.begin, gap.width, layer=OTHER)


def arc_on_the_wall_layer(space: Any, gap: Gap) -> None:
    arc(space, gap.x, gap.begin, gap.width, layer=WALL)


def all_on_the_wall_layer(space: Any, gap: Gap) -> None:
    arc(space, gap.x, gap.begin, gap.width, layer=WALL)
    space.add_line((gap.x, gap.begin), (gap.x + gap.width, gap.begin), WALL)


def closed(space: Any, gap: Gap) -> None:
    space.add_line((gap.x, gap.begin), (gap.x, gap.end), DOOR)


def sliding(space: Any, gap: Gap) -> None:
    """A panel beside the wall that reaches over both jambs."""
    space.add_lwpolyline(corners((4.12, gap.begin - 0.05, 4.16, gap.end + 0.05)), close=True, dxfattribs=DOOR)


def double(space: Any, gap: Gap) -> None:
    half = gap.width / 2
    loose(space, Gap(gap.begin, gap.begin + half))
    space.add_arc((gap.x, gap.end), half, 270, 360, dxfattribs=DOOR)
    space.add_line((gap.x, gap.end), (gap.x + half, gap.end), DOOR)


def unequal_double(space: Any, gap: Gap) -> None:
    """Leaves of two thirds and one third, arcs alone."""
    one, other = gap.width * 2 / 3, gap.width / 3
    arc(space, gap.x, gap.begin, one)
    space.add_arc((gap.x, gap.end), other, 270, 360, dxfattribs=DOOR)


def double_on_the_wall_layer(space: Any, gap: Gap) -> None:
    half = gap.width / 2
    arc(space, gap.x, gap.begin, half, layer=WALL)
    space.add_arc((gap.x, gap.end), half, 270, 360, dxfattribs=WALL)
    for y in (gap.begin, gap.end):
        space.add_line((gap.x, y), (gap.x + half, y), WALL)


WALL_STYLES: Sequence[Walls] = (outlines, faces, axes, hatches, solids, multilines, blocks)
DOOR_STYLES: Sequence[Doors] = (
    loose, at_the_face, in_a_frame, half_open, arc_alone, leaf_alone, threshold, bulge, chain, spline, ellipse, block, mirrored_block, arc_elsewhere,
    arc_on_the_wall_layer, all_on_the_wall_layer, closed, sliding,
)  # fmt: skip
DOUBLE_STYLES: Sequence[Doors] = (double, unequal_double, double_on_the_wall_layer)


def placed(point: tuple[float, float], turn: float, shift: tuple[float, float]) -> tuple[float, float]:
    """Where a point of the house is, turned by degrees and moved."""
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    return c * point[0] - s * point[1] + shift[0], s * point[0] + c * point[1] + shift[1]


def write_house(
    path: Path,
    walls: Walls,
    door: Doors,
    gap: Gap,
    turn: float = 0.0,
    shift: tuple[float, float] = (0.0, 0.0),
    metre: float = 1.0,
) -> Path:
    """The house as a file: turned by degrees, moved by metres, in units of which `metre` are a metre."""
    doc = new("R2010")
    doc.header["$INSUNITS"] = {1.0: 6, 100.0: 5, 1000.0: 4}[metre]
    space = doc.modelspace()
    for box in boxes(gap):
        walls(space, box)
    door(space, gap)
    move = Matrix44.chain(Matrix44.z_rotate(math.radians(turn)), Matrix44.translate(*shift, 0), Matrix44.scale(metre))
    for entity in list(space):
        entity.transform(move)
    doc.saveas(path)
    return path
