# SPDX-License-Identifier: MIT
"""Where a run ended.

In: the newest estimate of a run, its cloud's calibration of the heights by pressure. Out: a `LastPlace`. Owns nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from echostep.height.levels import Air
from echostep.localization import Estimate, TrackStatus


@dataclass(frozen=True, slots=True)
class LastPlace:
    """A place (m) on a level that the tracker was sure of, `sd_m` its standard deviation per axis; `air`: of the barometer that was worn."""

    x_m: float
    y_m: float
    sd_m: float
    level: int
    air: Air | None = None


def last_place(estimate: Estimate | None, air: Air | None) -> LastPlace | None:
    """The place of an estimate; None unless its status is `tracking`."""
    if estimate is None or estimate.status is not TrackStatus.TRACKING:
        return None
    sd_m = math.sqrt(0.5 * (estimate.xx_m2 + estimate.yy_m2))
    return LastPlace(estimate.x_m, estimate.y_m, sd_m, estimate.level, air)
