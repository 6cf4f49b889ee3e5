# SPDX-License-Identifier: MIT
"""Polylines (k, 2) in metres: their length, and the point at a distance along them.

In: polylines, distances. Out: lengths, points. Owns nothing.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep.jit import kernel


def way_m(line: Floats) -> float:
    """Length of a polyline (k, 2)."""
    pieces = line[1:] - line[:-1]
    return float(np.hypot(pieces[:, 0], pieces[:, 1]).sum())


@kernel
def along(line: Floats, s_m: float) -> tuple[float, float, float]:
    """x, y (m) and heading (rad) at the distance `s_m` along a polyline (k, 2); beyond its ends: at the end."""
    rest = max(s_m, 0.0)
    x, y, heading = line[0, 0], line[0, 1], 0.0
    for k in range(len(line) - 1):
        dx, dy = line[k + 1, 0] - line[k, 0], line[k + 1, 1] - line[k, 1]
        length = math.hypot(dx, dy)
        if length <= 0.0:
            continue
        share = min(rest / length, 1.0)
        x, y, heading = line[k, 0] + share * dx, line[k, 1] + share * dy, math.atan2(dy, dx)
        if rest <= length:
            break
        rest -= length
    return x, y, heading
