# SPDX-License-Identifier: MIT
"""Our estimates as a track to be scored, without a file.

In: estimates. Out: `ScoredPath`. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from echostep.localization import Estimate, TrackStatus
from echostep_app.scorecard.track_columns import ScoredPath


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
