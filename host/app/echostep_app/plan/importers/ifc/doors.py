# SPDX-License-Identifier: MIT
"""Doors of a model: the line across the opening that a door fills, whichever way its leaf is drawn.

In: an IfcDoor. Out: the door's line and its heights. Owns nothing. The opening's rectangle lies in the wall: the line runs along the wall, in its
middle. A door that fills no opening has its line from its placement (x along the width) when its shape is not a flat leaf, else along its shape.
"""

from __future__ import annotations

import math
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
from shapely.geometry import Polygon

from echostep.arrays import Floats
from echostep_app.plan.importers.drawn_level import opening
from echostep_app.plan.importers.ifc.bodies import Shapes, SolidBody

LEAF_M = 0.4  # a door's shape that is thicker is not closed: a leaf drawn open; assumed
NARROWEST_M, WIDEST_M = 0.4, 12.0  # plausible widths; assumed
Line = tuple[float, float, float, float]


class PlacedDoor(NamedTuple):
    """A door's line from jamb to jamb, the heights between which it is open, whether it fills an opening."""

    line: Line
    z_m: tuple[float, float]
    fills: bool = False


def placed_door(element: Any, shapes: Shapes, scale_m: float) -> PlacedDoor | None:
    """Where a door is; None when neither an opening nor a shape nor a placement with a width gives it."""
    width_m = float(getattr(element, "OverallWidth", None) or 0.0) * scale_m
    for relation in element.FillsVoids:
        hole = shapes.body(relation.RelatingOpeningElement)
        if hole is not None:
            return PlacedDoor(_across(hole, _host(relation.RelatingOpeningElement, shapes), width_m), hole.z_m, True)
    body = shapes.body(element)
    by_placement = _by_placement(element, width_m, scale_m, shapes.origin_m)
    if body is None:
        return by_placement
    corners = np.asarray(body.above().exterior.coords)[:3]
    thin = min(math.dist(corners[0], corners[1]), math.dist(corners[1], corners[2])) < LEAF_M
    if thin or by_placement is None:
        return PlacedDoor(opening(body.above()), body.z_m)
    return PlacedDoor(by_placement.line, body.z_m)


def _host(hole: Any, shapes: Shapes) -> Polygon | None:
    """The rectangle around the wall that an opening is in; None for a wall without a shape."""
    walls = [relation.RelatingBuildingElement for relation in hole.VoidsElements]
    body = shapes.body(walls[0]) if walls else None
    return None if body is None else body.above()


def _across(hole: SolidBody, wall: Polygon | None, width_m: float) -> Line:
    """The line along the middle of an opening: along its wall, else along the side as long as the door is wide, else along the longer side."""
    area = hole.above()
    if wall is not None:
        common = area.intersection(wall)
        area = common if isinstance(common, Polygon) and common.area > 0.0 else area
    box = np.asarray(area.minimum_rotated_rectangle.exterior.coords)[:4, :2]
    sides = [box[1] - box[0], box[2] - box[1]]
    if _along(sides, wall, width_m):
        box = np.roll(box, -1, axis=0)
    ends = np.concatenate(((box[0] + box[3]) / 2, (box[1] + box[2]) / 2)).round(3)
    return float(ends[0]), float(ends[1]), float(ends[2]), float(ends[3])


def _along(sides: list[Floats], wall: Polygon | None, width_m: float) -> int:
    """Which side of an opening's rectangle runs along the door."""
    lengths = [float(np.hypot(*side)) for side in sides]
    if wall is not None:
        box = np.asarray(wall.exterior.coords)[:3, :2]
        walls = sorted((box[1] - box[0], box[2] - box[1]), key=lambda side: float(np.hypot(*side)))
        if np.hypot(*walls[1]) > 2 * np.hypot(*walls[0]):
            return int(
                np.argmax([abs(float(side @ walls[1])) / max(n, 1e-9) for side, n in zip(sides, lengths, strict=True)])
            )
    if width_m > 0.0:
        return int(np.argmin([abs(length - width_m) for length in lengths]))
    return int(np.argmax(lengths))


def _by_placement(element: Any, width_m: float, scale_m: float, origin_m: tuple[float, float]) -> PlacedDoor | None:
    """A door from its placement: its x axis runs along its width [IFC 4, IfcDoor]."""
    if element.ObjectPlacement is None or not NARROWEST_M <= width_m <= WIDEST_M:
        return None
    matrix = np.asarray(import_module("ifcopenshell.util.placement").get_local_placement(element.ObjectPlacement))
    x, y, z = matrix[:3, 3] * scale_m - (*origin_m, 0.0)
    u, v = matrix[:2, 0]
    height_m = float(getattr(element, "OverallHeight", None) or 0.0) * scale_m or 2.0
    line = (x, y, x + width_m * u, y + width_m * v)
    return PlacedDoor(
        (round(line[0], 3), round(line[1], 3), round(line[2], 3), round(line[3], 3)), (float(z), float(z) + height_m)
    )
