"""The narrowest way out of a room that should be enclosed.

In: the walls and doors about a place. Out: where it is and about how wide. Found by making the walls thicker until the room closes.
"""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Point, Polygon
from shapely.geometry.base import BaseGeometry

REACH_M = 25.0
WIDTHS_M = (0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)


def leak(segments: NDArray[np.float64], at_m: tuple[float, float]) -> tuple[float, float, float] | None:
    """X and y of the narrowest way out, and its width at most, in metres; None when it is wider than 6 m, or the room than 25 m."""
    x, y = at_m
    window = shapely.box(x - REACH_M, y - REACH_M, x + REACH_M, y + REACH_M)
    lines = shapely.linestrings(segments.reshape(-1, 2, 2))
    walls = shapely.union_all(lines[shapely.intersects(lines, window)])
    if walls.is_empty or walls.distance(Point(at_m)) < WIDTHS_M[0]:
        return None
    for width in WIDTHS_M:
        free = _free(window, walls, at_m, width)
        if free is None:
            return None
        room, outside = free
        if not room.intersects(window.boundary):
            way = shapely.shortest_line(room, outside)  # shorter where an opening has closed than through a wall
            return None if way.intersects(walls) else (float(way.centroid.x), float(way.centroid.y), width)
    return None


def _free(
    window: Polygon, walls: BaseGeometry, at_m: tuple[float, float], width_m: float
) -> tuple[Polygon, BaseGeometry] | None:
    """The piece of free space with the place, and all pieces that reach the window's edge; None when walls so thick bury the place."""
    parts = shapely.get_parts(window.difference(walls.buffer(width_m / 2, quad_segs=4)))
    inside = parts[shapely.intersects(parts, Point(at_m))]
    outside = shapely.union_all(parts[shapely.intersects(parts, window.boundary)])
    return (inside[0], outside) if len(inside) and not outside.is_empty else None
