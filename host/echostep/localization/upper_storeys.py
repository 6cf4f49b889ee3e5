# SPDX-License-Identifier: MIT
"""Outside of the building on an upper storey is air: particles that went through its walls lose their weight there.

In: a building's floor and its sheet of levels; places on the sheet. Out: what they lose on a path. Owns the grid of the floor.

Where no wall is near, silence is all that is expected, and every echo is one that no plan shows. So among particles that are spread over a building
those outside of it lose little, and nothing brings them back.
"""

from __future__ import annotations

import numpy as np

from echostep.arrays import Floats
from echostep.walls.floor import Floor
from echostep.walls.indoors import inside_grid
from echostep.walls.level_sheet import LevelSheet, level_of

# By reason:
ABOVE_M = 1.5  # height above the ground, which is at 0 or the lowest level: an entrance over a few steps is none of an upper storey
FALL_PER_M = 1.0  # log-weight lost on a metre of path: a corner that the plan lacks is passed


class UpperStoreys:
    """The floor of a building, and which of its levels are above the ground."""

    def __init__(self, floor: Floor, sheet: LevelSheet) -> None:
        self._sheet = sheet
        self._grid = inside_grid(floor.x_m, floor.y_m)
        self._is_above = sheet.height_m > max(0.0, float(sheet.height_m.min())) + ABOVE_M

    def log_loss(self, x_m: Floats, y_m: Floats, path_m: float) -> Floats | None:
        """What places (n,) on the sheet lose in log-weight on this length of path; None if none is in the air."""
        is_above = self._is_above[level_of(x_m, self._sheet)]
        if not is_above.any():
            return None
        in_air = is_above & ~self._grid.holds(x_m, y_m)
        return np.where(in_air, -FALL_PER_M * path_m, 0.0) if in_air.any() else None
