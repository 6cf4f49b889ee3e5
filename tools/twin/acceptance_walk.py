# SPDX-License-Identifier: GPL-3.0-or-later
"""A simulated wearer who walks the protocol of `echostep acceptance`: where the way leads, and when a point is reached.

In: the protocol's points and visits; a simulated walk. Out: waypoints; the time of each visit. Owns how long the wearer stands on a point.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from echostep.plan.model import Plan
from echostep.session.acceptance.protocol import Point, Visit
from echostep.simulation.people.walker import Walk, Waypoint

STOP_S = 1.5  # on a point that is visited standing; assumed
NEAR_M, SAME_M = 0.5, 0.02  # a point is about here; the trunk is as near to it as it comes


def waypoints(points: Sequence[Point], visits: Sequence[Visit], plan: Plan) -> list[Waypoint]:
    """The way from visit to visit."""
    way: list[Waypoint] = []
    for visit in visits:
        point = points[visit.point]
        way.append((point.x_m, point.y_m, STOP_S if visit.standing else 0.0, plan.levels[point.level].height_m))
    return way


def times_s(walk: Walk, points: Sequence[Point], visits: Sequence[Visit]) -> list[float]:
    """When the trunk is nearest to the point of each visit, in their order: in the middle of the time for which it stays there."""
    times, begin = [], 0
    for visit in visits:
        point = points[visit.point]
        away_m = np.hypot(*(walk.trunk_m[begin:] - (point.x_m, point.y_m)).T)
        arrives = int((away_m < NEAR_M).argmax())
        leaves = arrives + int((away_m[arrives:] >= NEAR_M).argmax() or len(away_m) - arrives)
        nearest = arrives + np.flatnonzero(away_m[arrives:leaves] <= away_m[arrives:leaves].min() + SAME_M)
        times.append(float(walk.t_s[begin + int(nearest[len(nearest) // 2])]))
        begin += leaves
    return times
