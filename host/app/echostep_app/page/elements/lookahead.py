# SPDX-License-Identifier: MIT
"""Look-ahead: the position after a step whose echoes have not been used yet.

In: the last estimate, the path segment at whose end it is, the later segments. Out: an estimate by dead reckoning from there. Owns nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from echostep.elementary import wrap
from echostep.localization import Estimate, TrackStatus
from echostep.particles.ellipse import ellipse95
from echostep.path import PathSegment
from echostep_app.plan.places.bearing import KNOWN_HEADING_RAD

DRIFT_M = 0.05  # standard deviation that is added per segment and axis to the foot's own; assumed


def moves_as_one(estimate: Estimate) -> bool:
    """Whether all particles make the step of the mean: they are at one place and share a heading.

    In a search each has its own heading; the step of their mean would move them through walls.
    """
    return not estimate.hypotheses and estimate.claims_place and estimate.heading_sd_rad <= KNOWN_HEADING_RAD


def extrapolate(estimate: Estimate, segment: PathSegment, later: Sequence[PathSegment]) -> Estimate:
    """The estimate moved along the later segments; its covariance grows by theirs and by the uncertainty of the heading."""
    turn = estimate.heading_rad - segment.heading1_rad
    x, y, xx, xy, yy = estimate.x_m, estimate.y_m, estimate.xx_m2, estimate.xy_m2, estimate.yy_m2
    c, s = math.cos(turn), math.sin(turn)
    for step in later:
        dx, dy = c * step.dx_m - s * step.dy_m, s * step.dx_m + c * step.dy_m
        x, y = x + dx, y + dy
        position_m2, heading_rad2 = (step.sd_m**2 + DRIFT_M**2), estimate.heading_sd_rad**2
        xx, xy, yy = (
            xx + position_m2 + heading_rad2 * dy * dy,
            xy - heading_rad2 * dx * dy,
            yy + position_m2 + heading_rad2 * dx * dx,
        )
    last = later[-1]
    status, before, after = (
        estimate.status,
        TrackStatus.of(estimate.ellipse95.major_m),
        TrackStatus.of(ellipse95(xx, xy, yy).major_m),
    )
    if after is not before:  # otherwise the filter's own status holds, which knows more than the radius
        status = max(status, after, key=list(type(status)).index)
    heading = float(wrap(last.heading1_rad + turn))
    return replace(
        estimate, t_s=last.t1_s, x_m=x, y_m=y, xx_m2=xx, xy_m2=xy, yy_m2=yy, heading_rad=heading, step=last.step, status=status
    )  # fmt: skip
