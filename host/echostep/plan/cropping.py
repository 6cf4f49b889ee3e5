"""The walls of a part of a level, for pictures and pages that show a city by tiles.

In: segments (n, 4), a rectangle. Out: those that may be seen in it. Owns nothing.
"""

from __future__ import annotations

import numpy as np

from echostep.arrays import Floats

Bounds = tuple[float, float, float, float]  # x0, y0, x1, y1 in metres


def within(segments: Floats, bounds: Bounds, least_m: float = 0.0) -> Floats:
    """Segments whose own rectangle touches this one, without those shorter than `least_m` both ways (less than a pixel). 10 ms for a million."""
    x0, y0, x1, y1 = bounds
    ax, ay, bx, by = segments.T
    seen = (
        (np.maximum(ax, bx) >= x0)
        & (np.minimum(ax, bx) <= x1)
        & (np.maximum(ay, by) >= y0)
        & (np.minimum(ay, by) <= y1)
    )
    if least_m > 0.0:
        seen &= (np.abs(bx - ax) >= least_m) | (np.abs(by - ay) >= least_m)
    return segments[seen]


def extent(segments: Floats) -> Bounds:
    """The rectangle about all segments; 10 m by 10 m when there is none."""
    if not len(segments):
        return 0.0, 0.0, 10.0, 10.0
    x0, y0 = segments.reshape(-1, 2).min(axis=0)
    x1, y1 = segments.reshape(-1, 2).max(axis=0)
    return float(x0), float(y0), float(x1), float(y1)
