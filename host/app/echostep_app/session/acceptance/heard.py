# SPDX-License-Identifier: MIT
"""Shares of the pings that a wall answered, by the angle between the ranger's axis and the wall.

In: the pings of a walk with the poses at which they were sent; a plan. Out: `HeardShare`s. Owns the limits. The poses are the tracker's own, so a
ping counts only where it says `tracking`, and the limits are wide against its errors.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Floats
from echostep.localization import Estimate
from echostep.path import MeasuredSegment
from echostep.plan import Plan
from echostep_app.output.ping_poses import placed_pings

# Assumed, all of them.
REACH_M = 3.0  # along the axis to the wall: half of an SRF02's reach
AGREES_M = 0.3  # of the wall's distance: the tracker's error, and the ranger's
STEP_DEG, MOST_DEG = 10, 90


class SeenPing(NamedTuple):
    """A ping from (x_m, y_m) on `level` along an axis; `range_m` is NaN without an echo."""

    x_m: float
    y_m: float
    level: int
    axis_rad: float
    ranger: int
    range_m: float


@dataclass(slots=True)
class SeenPings:
    """Watches a tracker: the pings that were sent while it says `tracking`."""

    pings: list[SeenPing] = field(default_factory=list)

    def note(self, measured: MeasuredSegment | None, new: Estimate) -> None:
        """Keep the pings of a segment."""
        for ranger, x_m, y_m, axis_rad, range_m in placed_pings(measured, new).tolist():
            self.pings.append(SeenPing(x_m, y_m, new.level, axis_rad, int(ranger), range_m))


class HeardShare(NamedTuple):
    """Of `pings` at `from_deg` to `to_deg` off a wall's normal: shares answered by that wall, nearer, farther, and by no echo."""

    ranger: str
    from_deg: int
    to_deg: int
    pings: int
    wall: float
    nearer: float
    farther: float
    none: float


def heard_shares(pings: Sequence[SeenPing], plan: Plan) -> list[HeardShare]:
    """Shares for each ranger square to a wall, and for both by angle; no row without a ping."""
    if not pings:
        return []
    ranger, range_m = np.array([p.ranger for p in pings]), np.array([p.range_m for p in pings])
    distance_m, off_deg = np.transpose([_wall_ahead(ping, plan) for ping in pings])
    near = distance_m <= REACH_M
    nearest_m = distance_m * np.cos(np.radians(np.nan_to_num(off_deg)))
    kinds = (
        (range_m >= nearest_m - AGREES_M) & (range_m <= distance_m + AGREES_M),
        range_m < nearest_m - AGREES_M,
        range_m > distance_m + AGREES_M,
        np.isnan(range_m),
    )

    def row(name: str, begin: int, end: int, which: Bools) -> HeardShare | None:
        chosen = which & near & (off_deg >= begin) & (off_deg < end)
        count = int(chosen.sum())
        shares = [float(kind[chosen].mean()) for kind in kinds] if count else []
        return HeardShare(name, begin, end, count, *shares) if count else None

    rows = [row(name, 0, STEP_DEG, ranger == k) for k, name in enumerate(("left", "right"))]
    rows += [row("both", a, a + STEP_DEG, near) for a in range(0, MOST_DEG, STEP_DEG)]
    return [each for each in rows if each is not None]


def _wall_ahead(ping: SeenPing, plan: Plan) -> tuple[float, float]:
    """Distance (m) along the axis to the first wall, and the angle (degrees) between axis and its normal; infinite and NaN without one."""
    walls: Floats = plan.levels[ping.level].solid
    ux, uy = math.cos(ping.axis_rad), math.sin(ping.axis_rad)
    dx, dy = walls[:, 2] - walls[:, 0], walls[:, 3] - walls[:, 1]
    ax, ay = walls[:, 0] - ping.x_m, walls[:, 1] - ping.y_m
    across = ux * dy - uy * dx  # of the axis and the wall; 0: parallel
    with np.errstate(divide="ignore", invalid="ignore"):
        along_axis_m, along_wall = (ax * dy - ay * dx) / across, (ax * uy - ay * ux) / across
    hit = (along_axis_m > 0.0) & (along_wall >= 0.0) & (along_wall <= 1.0)
    if not hit.any():
        return math.inf, math.nan
    first = int(np.where(hit, along_axis_m, np.inf).argmin())
    sine = abs(float(across[first])) / math.hypot(float(dx[first]), float(dy[first]))
    return float(along_axis_m[first]), 90.0 - math.degrees(math.asin(min(sine, 1.0)))
