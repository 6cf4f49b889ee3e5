# SPDX-License-Identifier: MIT
"""How well places of a drawing are known in the building: the drawing's own error, added to the error of a place on it.

In: the levels of a plan. Out: standard deviations. Owns the distance in which walls count. A shift of the drawing about a wearer makes no echo fit
worse, so no echo reveals it: it widens the claimed errors, and a start that was known in the building. Plans that state none are taken as exact.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from echostep.arrays import Floats
from echostep.localization.particles.start import Start
from echostep.plan import ANY_LEVEL, Level

HEARD_M = 5.0  # of a wall, within which it places the wearer: the rangers' reach without a second reflection


class DrawnPlaces:
    """The stated places of each level."""

    def __init__(self, levels: Sequence[Level] = ()) -> None:
        self._places = tuple(level.place_sd for level in levels)
        self.are_stated = any(len(rows) for rows in self._places)

    def sd_m(self, x_m: float, y_m: float, level: int) -> float:
        """Standard deviation per axis of the drawing about a place: the largest of the walls in range there, or the nearest one's."""
        rows = self._places[level] if 0 <= level < len(self._places) else np.zeros((0, 3))
        if not len(rows):
            return 0.0
        away_m: Floats = np.hypot(rows[:, 0] - x_m, rows[:, 1] - y_m)
        near = away_m < max(HEARD_M, float(away_m.min()) + 1e-9)
        return float(rows[near, 2].max())

    def widened(self, start: Start) -> Start:
        """A start that is known in the building, as a start on the drawing."""
        if not self.are_stated or start.pose is None or start.pose.level == ANY_LEVEL:
            return start
        sd_m = self.sd_m(start.pose.x_m, start.pose.y_m, start.pose.level)
        return replace(start, sd_m=math.hypot(start.sd_m, sd_m)) if sd_m else start
