# SPDX-License-Identifier: MIT
"""A small house drawn with ezdxf: outlines of walls and one door.

The house is 10 m by 8 m with a partition of 0.1 m at x 4.0 to 4.1, which has a gap; the outer walls are 0.3 m thick. The hinge is at the gap's lower
jamb.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ezdxf.filemanagement import new

Box = tuple[float, float, float, float]
WALL, DOOR, OTHER = {"layer": "A-WALL"}, {"layer": "A-DOOR"}, {"layer": "A-FINE"}


def sheet(insunits: int = 6) -> tuple[Any, Any]:
    """An empty drawing in metres, or in another unit by its code, and its model space."""
    doc = new("R2010")
    doc.header["$INSUNITS"] = insunits
    return doc, doc.modelspace()


def boxes(begin: float = 3.0) -> list[Box]:
    """The walls as rectangles; the gap begins at this y."""
    outer = [(0, 0, 10, 0.3), (0, 7.7, 10, 8), (0, 0.3, 0.3, 7.7), (9.7, 0.3, 10, 7.7)]
    return [*outer, (4, 0.3, 4.1, begin), (4, begin + 0.9, 4.1, 7.7)]


def corners(box: Box) -> list[tuple[float, float]]:
    """The corners of a rectangle."""
    x0, y0, x1, y1 = box
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def outlines(space: Any, box: Box, layer: str = "A-WALL") -> None:
    """A closed polyline."""
    space.add_lwpolyline(corners(box), close=True, dxfattribs={"layer": layer})


def house(
    space: Any,
    layer: str = "A-WALL",
    x: float = 0.0,
    y: float = 0.0,
    one: float = 1.0,
    begin: float = 3.0,
    *,
    door: bool = False,
) -> None:
    """The walls with their lower left corner at x, y metres, in units of which `one` are a metre; with leaf and swing of the door, or without."""
    for box in boxes(begin):
        outlines(space, tuple(one * (v + (x, y)[k % 2]) for k, v in enumerate(box)), layer)  # type: ignore[arg-type]
    if door:
        hinge = one * (4.05 + x), one * (begin + y)
        space.add_arc(hinge, 0.9 * one, 0, 90, dxfattribs=DOOR)
        space.add_line(hinge, (hinge[0] + 0.9 * one, hinge[1]), DOOR)


def write_house(path: Path) -> Path:
    """The house with its door as a file."""
    doc, space = sheet()
    house(space, door=True)
    doc.saveas(path)
    return path
