# SPDX-License-Identifier: MIT
"""Simulated truths as true paths, without files.

In: a simulated truth. Out: `ScoredPath`. Owns nothing.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from echostep.arrays import Floats
from echostep.plan import Plan
from echostep_app.scorecard.track_columns import ScoredPath


def truth_of(truth: Floats, plan: Plan) -> ScoredPath:
    """A simulated truth (n, 5), t_s, x, y, heading, height of the floor, as a true path: the nearest level is the true one."""
    heights = np.array([level.height_m for level in plan.levels])
    level = np.abs(truth[:, 4:5] - heights).argmin(1).astype(float)
    return ScoredPath(
        Path("truth"), truth[:, 0], truth[:, 1:3], np.zeros(len(truth), bool), {}, height_m=truth[:, 4], level=level
    )
