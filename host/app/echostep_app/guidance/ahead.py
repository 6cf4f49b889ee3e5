# SPDX-License-Identifier: MIT
"""A place against a path (k, 2) in metres: the nearest point of the path, and the turn to a point ahead on it [Fischer 2008, Figure 8].

In: paths, places. Out: distances, angles. Owns nothing. `Guide` and the study of guided returns call the same kernels.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep.jit import kernel
from echostep.walls.polyline import along


@kernel
def nearest(line: Floats, x: float, y: float, from_m: float, to_m: float) -> tuple[float, float]:
    """Distance along a polyline (k, 2) of the point nearest to (x, y), and that point's distance from (x, y).

    Only points between the distances `from_m` and `to_m` along the polyline count.
    """
    best_s, best = from_m, np.inf
    begin = 0.0
    for k in range(len(line) - 1):
        dx, dy = line[k + 1, 0] - line[k, 0], line[k + 1, 1] - line[k, 1]
        length = math.hypot(dx, dy)
        if length > 0.0 and begin <= to_m and begin + length >= from_m:
            s = ((x - line[k, 0]) * dx + (y - line[k, 1]) * dy) / length
            s = min(max(s, 0.0, from_m - begin), length, to_m - begin)
            off = math.hypot(line[k, 0] + s / length * dx - x, line[k, 1] + s / length * dy - y)
            if off < best:
                best_s, best = begin + s, off
        begin += length
    if best == np.inf:
        best = math.hypot(line[0, 0] - x, line[0, 1] - y)
    return best_s, best


@kernel
def turn_ahead(path: Floats, s_m: float, x: float, y: float, heading_rad: float) -> float:
    """Turn (rad) from a heading at (x, y) to the point at the length `s_m` along a path (k, 2)."""
    to_x, to_y, _ = along(path, s_m)
    return math.atan2(to_y - y, to_x - x) - heading_rad
