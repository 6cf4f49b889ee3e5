# SPDX-License-Identifier: MIT
"""Zones: the rooms, corridors, stairs and lifts of a plan, by number.

In: a plan, places. Out: the number of the zone around each. Owns the spaces of the plan's levels. A zone is the outline of stairs or a lift, else
the smallest outline of a room, else the space between the walls, all doors closed.
"""

from __future__ import annotations

import math

import numpy as np
import shapely

from echostep.arrays import Floats, Ints
from echostep.plan import Plan
from echostep_app.plan.places.faces import OUTSIDE
from echostep_app.plan.places.spaces import PlanSpaces, Spaces

NO_ZONE = -1


class Zones:
    """Numbers of the zones of a plan, different on different levels."""

    def __init__(self, plan: Plan) -> None:
        self._levels = len(plan.levels)
        self._spaces = PlanSpaces(plan)

    def of(self, xy_m: Floats, level: Floats) -> Ints:
        """Places (n, 2), their levels (n,), NaN where unknown -> (n,) number of the zone, or NO_ZONE."""
        number = np.full(len(xy_m), NO_ZONE, dtype=np.int64)
        for k in range(self._levels):
            here = np.flatnonzero(level == k)
            spaces = self._spaces.on(k) if len(here) else None
            if spaces is not None:
                zone = _zones(spaces, xy_m[here])
                number[here] = np.where(zone == NO_ZONE, NO_ZONE, zone * self._levels + k)
        return number


def _zones(spaces: Spaces, xy_m: Floats) -> Ints:
    """Number of the zone around each place of one level: ways first, then outlines of rooms, then faces."""
    face = spaces.faces.indices_of(xy_m)
    areas = (*spaces.way_areas, *spaces.outlines)
    zone = np.where(face == OUTSIDE, NO_ZONE, face + len(areas)).astype(np.int64)
    size = np.full(len(xy_m), math.inf)
    for k, area in enumerate(areas):
        smaller = 0.0 if k < len(spaces.way_areas) else float(area.area)
        inside = shapely.contains_xy(area, *xy_m.T) & (smaller < size)
        zone[inside], size[inside] = k, smaller
    return zone
