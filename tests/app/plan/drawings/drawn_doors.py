# SPDX-License-Identifier: MIT
"""Doors drawn with ezdxf in the habits of many drawing offices: leaves, swings, panels, blocks, on layers of their own or of others."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

Box = tuple[float, float, float, float]
Point = tuple[float, float]
Layer = dict[str, Any]
WALL, PLAIN = {"layer": "A-WALL"}, {"layer": "0"}
DOUBLE_M = 1.3  # wider doors have two leaves


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


DOOR_STYLES: Sequence[Doors] = (
    usual, on_layer_0, thick_leaf, opened_a_little, coarse, both_ways, single_blocks, sliding, pocket, two_panels, thresholds, folding,
    in_the_middle_of_the_wall, in_a_frame, swing_alone, swing_on_another_layer, on_the_wall_layer, swing_on_the_wall_layer, bulge, spline, ellipse,
    closed,
)  # fmt: skip
