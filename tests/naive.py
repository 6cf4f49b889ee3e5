"""Slow, obviously right twins of the kernels."""

from __future__ import annotations

import math

import numpy as np
import shapely
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def crosses(ax: float, ay: float, bx: float, by: float, walls: Floats) -> bool:
    """Whether a move meets any wall."""
    move = shapely.LineString([(ax, ay), (bx, by)])
    return any(move.intersects(shapely.LineString(w.reshape(2, 2))) for w in walls)


def facing_wall(
    px: float, py: float, axis_rad: float, walls: Floats, cone_rad: float, reach_m: float
) -> tuple[float, float]:
    """Distance and off-axis angle of the nearest unhidden perpendicular in the cone; (inf, 0) when there is none."""
    here = shapely.Point(px, py)
    lines = [shapely.LineString(w.reshape(2, 2)) for w in walls]
    found = []
    for line in lines:
        (ax, ay), (bx, by) = line.coords
        along = ((px - ax) * (bx - ax) + (py - ay) * (by - ay)) / line.length
        if not 0.0 <= along <= line.length:
            continue
        foot = line.interpolate(along)
        distance = here.distance(foot)
        if distance > reach_m:
            continue
        angle = math.remainder(math.atan2(foot.y - py, foot.x - px) - axis_rad, 2 * math.pi)
        sight = shapely.LineString([(px, py), (px + (foot.x - px) * 0.9999, py + (foot.y - py) * 0.9999)])
        if abs(angle) <= cone_rad and not any(sight.intersects(other) for other in lines):
            found.append((distance, abs(angle)))
    return min(found, default=(math.inf, 0.0))
