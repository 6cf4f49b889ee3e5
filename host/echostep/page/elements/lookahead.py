"""Ahead: where a step has led that the foot has just told, before its echoes are in.

In: the last estimate, the leg that it belongs to, the legs since. Out: an estimate by dead reckoning from there. Owns nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from echostep.angles import wrap
from echostep.localization.estimate import Estimate, ellipse95, trust
from echostep.path import PathSegment

DRIFT_M = 0.05  # of a step, per axis, beside what the foot says


def ahead(told: Estimate, leg: PathSegment, since: Sequence[PathSegment]) -> Estimate:
    """An estimate moved by further legs, its ellipse grown by theirs and by what the heading may be off."""
    turn = told.heading_rad - leg.heading1_rad
    x, y, xx, xy, yy = told.x_m, told.y_m, told.xx_m2, told.xy_m2, told.yy_m2
    c, s = math.cos(turn), math.sin(turn)
    for step in since:
        dx, dy = c * step.dx_m - s * step.dy_m, s * step.dx_m + c * step.dy_m
        x, y = x + dx, y + dy
        along, across = (step.sd_m**2 + DRIFT_M**2), told.heading_sd_rad**2
        xx, xy, yy = xx + along + across * dy * dy, xy - across * dx * dy, yy + along + across * dx * dx
    last = since[-1]
    status = max(told.status, trust(ellipse95(xx, xy, yy).major_m), key=list(type(told.status)).index)
    heading = float(wrap(last.heading1_rad + turn))
    return replace(
        told, t_s=last.t1_s, x_m=x, y_m=y, xx_m2=xx, xy_m2=xy, yy_m2=yy, heading_rad=heading, step=last.step, status=status
    )  # fmt: skip
