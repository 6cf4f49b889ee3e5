# SPDX-License-Identifier: MIT
"""Where a plan's origin lies when its file's own coordinates are those of a national grid.

In: points in metres. Out: the origin. Owns what counts as far.
"""

from __future__ import annotations

import numpy as np

from echostep.arrays import Floats

FAR_M, EARTH_M = 1e4, 1e8  # larger coordinates are in a national grid; beyond that in none: twice around the Earth
IN_GRID = "{} lies in a national grid: the plan's origin is x {:.0f} m, y {:.0f} m there"


def grid_origin(points_m: Floats) -> tuple[float, float]:
    """The median of points (n, 2) in whole metres, so that a stray one does not count; 0, 0 where that is near, or in no grid."""
    x, y = np.floor(np.median(points_m, axis=0)) if len(points_m) else (0.0, 0.0)
    return (float(x), float(y)) if FAR_M < max(abs(x), abs(y)) <= EARTH_M else (0.0, 0.0)
