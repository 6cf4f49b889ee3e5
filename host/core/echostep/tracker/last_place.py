# SPDX-License-Identifier: MIT
"""Where a run ended, as the start of the next one: the battery was changed, or the program was started anew.

In: the newest estimate of a run, what its cloud knew of the heights by pressure, how long ago that was. Out: a `Start`. Owns nothing.

The next run begins as after a pause (`gaps`): the cloud lies about the last place, with any heading, as the walk frame is new; the whole
building is searched beside it, as the wearer may have moved on. Pressure gives the level at once if the barometer is the same: its lag has
drifted by no more than weather and the air in the building allow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from echostep.localization.estimate import Estimate, TrackStatus
from echostep.localization.height.levels import ClimbSettings, drift_m
from echostep.localization.particles.start import Air, Start
from echostep.plan.model import Pose

MOVED_M = 1.0  # standard deviation per axis of the way while a battery is changed on the spot: a stride


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


def start_after(place: LastPlace, away_s: float, climbing: ClimbSettings) -> Start:
    """The start of a run that begins so long after another one ended at a place."""
    air = place.air
    if air is not None:
        air = replace(air, sd_m=math.hypot(air.sd_m, drift_m(climbing, away_s)))
    pose = Pose(place.x_m, place.y_m, 0.0, place.level)
    return Start(pose, math.hypot(place.sd_m, MOVED_M), math.pi, air=air, after_pause=True)
