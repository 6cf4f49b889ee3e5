# SPDX-License-Identifier: MIT
"""Our estimates and simulated truths as tracks to be scored, without files.

In: estimates, a simulated truth. Out: `ScoredPath`s. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from echostep.arrays import Floats
from echostep.localization.estimate import Estimate, TrackStatus
from echostep.plan.model import Plan
from echostep.scorecard.track_columns import ScoredPath


def track_of(estimates: Sequence[Estimate], name: str = "estimates") -> ScoredPath:
    """Estimates as a track."""
    moments = [(e.xx_m2, e.xy_m2, e.yy_m2) for e in estimates]
    return ScoredPath(
        Path(name), np.array([e.t_s for e in estimates]), np.array([(e.x_m, e.y_m) for e in estimates]).reshape(-1, 2),
        np.array([e.status is TrackStatus.LOST for e in estimates], dtype=bool), {},
        height_m=np.array([e.z_m for e in estimates]), level=np.array([float(e.level) for e in estimates]),
        covariance_m2=np.array(moments).reshape(-1, 3), radius95_m=np.array([e.ellipse95.major_m for e in estimates]),
        protection_m=np.array([e.protection_m for e in estimates]),
    )  # fmt: skip


def truth_of(truth: Floats, plan: Plan) -> ScoredPath:
    """A simulated truth (n, 5), t_s, x, y, heading, height of the floor, as a true path: the nearest level is the true one."""
    heights = np.array([level.height_m for level in plan.levels])
    level = np.abs(truth[:, 4:5] - heights).argmin(1).astype(float)
    return ScoredPath(
        Path("truth"), truth[:, 0], truth[:, 1:3], np.zeros(len(truth), bool), {}, height_m=truth[:, 4], level=level
    )
