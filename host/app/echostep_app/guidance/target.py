# SPDX-License-Identifier: MIT
"""The target ahead on a path, and the turn to it [Fischer 2008, Figure 8].

In: a polyline, a place, a heading. Out: an angle. Owns nothing. `Guide` and the study of guided returns call the same kernel.
"""

from __future__ import annotations

import math

from echostep.arrays import Floats
from echostep.jit import kernel
from echostep_app.plan.polyline import along


@kernel
def turn_ahead(path: Floats, s_m: float, x: float, y: float, heading_rad: float) -> float:
    """Turn (rad) from a heading at (x, y) to the point at the length `s_m` along a path (k, 2)."""
    to_x, to_y, _ = along(path, s_m)
    return math.atan2(to_y - y, to_x - x) - heading_rad
