# SPDX-License-Identifier: MIT
"""The narrowest opening of a room that should be enclosed.

In: walls and doors around a point. Out: position and width of the opening. The walls are made thicker until the room is closed; the width is found by
bisection.
"""

from __future__ import annotations

import shapely
from shapely.geometry import Point, Polygon
from shapely.geometry.base import BaseGeometry

from echostep.arrays import Floats
from echostep_app.plan.cropping import within

REACH_M = 20.0  # half the side of the square that is searched
WIDTHS_M = (0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)


def narrowest_opening(segments: Floats, at_m: tuple[float, float]) -> tuple[float, float, float] | None:
    """x, y and an upper bound of the width of the narrowest opening, in metres; None when it is wider than 6 m or further than 20 m."""
    x, y = at_m
    window = shapely.box(x - REACH_M, y - REACH_M, x + REACH_M, y + REACH_M)
    walls = shapely.union_all(shapely.linestrings(within(segments, window.bounds).reshape(-1, 2, 2)))
    if walls.is_empty or walls.distance(Point(at_m)) < WIDTHS_M[0]:
        return None
    low, high, opening = 0, len(WIDTHS_M) - 1, None
    while low <= high:  # bisection for the smallest thickness that closes the room
        middle = (low + high) // 2
        free = _free(window, walls, at_m, WIDTHS_M[middle])
        if free is not None and free[0].intersects(window.boundary):
            low = middle + 1
        else:
            high = middle - 1
            opening = (free, WIDTHS_M[middle])
    if opening is None or opening[0] is None:
        return None
    across = shapely.shortest_line(
        *opening[0]
    )  # from the room to the outside: through the opening that the thickness has closed
    return None if across.intersects(walls) else (float(across.centroid.x), float(across.centroid.y), opening[1])


def _free(
    window: Polygon, walls: BaseGeometry, at_m: tuple[float, float], width_m: float
) -> tuple[Polygon, BaseGeometry] | None:
    """Free space with walls `width_m` thick: the part around the point, and all parts at the window's edge; None when the point is covered."""
    thick = shapely.union_all(shapely.buffer(shapely.get_parts(walls), width_m / 2, quad_segs=4))
    parts = shapely.get_parts(window.difference(thick))
    inside = parts[shapely.intersects(parts, Point(at_m))]
    outside = shapely.union_all(parts[shapely.intersects(parts, window.boundary)])
    return (inside[0], outside) if len(inside) and not outside.is_empty else None
