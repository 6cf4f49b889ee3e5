"""The estimate: moments of the cloud.

In: a cloud. Out: `Estimate`, immutable: position, covariance, heading, level, and a status that says how far to trust it. Owns nothing.
"""

from __future__ import annotations

import hashlib
import math
import struct
from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.localization.particles import Cloud

CHI2_95 = 5.991464547107979  # 95 % quantile of chi-square, two degrees of freedom
TRACKING_M, LOST_M = (
    1.0,
    5.0,
)  # 95 % radius up to which the status is tracking, beyond which it is lost; by reason: a door, a room
SURE_OF_LEVEL = 0.9  # least probability of the likeliest level while tracking, by reason
WALKER_M_S = 1.5  # speed at which an unobserved position spreads per axis, by reason: a brisk walk


class TrackStatus(StrEnum):
    """How far to trust a position: `uncertain` beyond 1 m of 95 % radius, `lost` beyond 5 m."""

    TRACKING = "tracking"
    UNCERTAIN = "uncertain"
    LOST = "lost"


@dataclass(frozen=True, slots=True)
class Estimate:
    """Trunk position in the map (m), covariance (xx, xy, yy in m2), heading (rad), at `t_s`.

    `level` is the likeliest one (an index into the plan's), `levels` the probability of each, `z_m` the height in the plan's metres.
    """

    t_s: float
    x_m: float
    y_m: float
    xx_m2: float
    xy_m2: float
    yy_m2: float
    heading_rad: float
    heading_sd_rad: float
    step: int
    status: TrackStatus
    level: int = 0
    levels: tuple[float, ...] = (1.0,)
    z_m: float = 0.0
    z_sd_m: float = 0.0

    @property
    def ellipse95(self) -> Ellipse:
        """The 95 % ellipse of the covariance."""
        return ellipse95(self.xx_m2, self.xy_m2, self.yy_m2)

    def holds(self, x_m: float, y_m: float) -> bool:
        """Whether a place lies in the 95 % ellipse; in an ellipse without area, only its centre does."""
        dx, dy = x_m - self.x_m, y_m - self.y_m
        determinant = self.xx_m2 * self.yy_m2 - self.xy_m2**2
        if determinant <= 0.0:
            return dx == dy == 0.0
        square = self.yy_m2 * dx * dx - 2.0 * self.xy_m2 * dx * dy + self.xx_m2 * dy * dy
        return square <= CHI2_95 * determinant


class Ellipse(NamedTuple):
    """Half axes in metres and the angle of the longer one from x."""

    major_m: float
    minor_m: float
    angle_rad: float


def ellipse95(xx_m2: float, xy_m2: float, yy_m2: float) -> Ellipse:
    """The ellipse that holds 95 % of a normal distribution with this covariance."""
    mean, half = 0.5 * (xx_m2 + yy_m2), math.hypot(0.5 * (xx_m2 - yy_m2), xy_m2)
    major, minor = (math.sqrt(max(v, 0.0) * CHI2_95) for v in (mean + half, mean - half))
    return Ellipse(major, minor, 0.5 * math.atan2(2.0 * xy_m2, xx_m2 - yy_m2))


def estimate(cloud: Cloud, t_s: float, walk_heading_rad: float, step: int, doubt_m: float = 0.0) -> Estimate:
    """Weighted moments of the cloud [Girard 2011, eq. 2 for the mean]; `doubt_m`: standard deviation per axis to be added."""
    weight = cloud.weight
    levels, z, z_sd = _heights(cloud, weight)
    map_x = cloud.map_x_m
    x, y = float(weight @ map_x), float(weight @ cloud.y_m)
    dx, dy = map_x - x, cloud.y_m - y
    xx, xy, yy = float(weight @ (dx * dx)), float(weight @ (dx * dy)), float(weight @ (dy * dy))
    east = float(weight @ np.cos(cloud.turn_rad + walk_heading_rad))
    north = float(weight @ np.sin(cloud.turn_rad + walk_heading_rad))
    spread = math.sqrt(max(-2.0 * math.log(min(math.hypot(east, north), 1.0)), 0.0))
    xx, yy = xx + doubt_m**2, yy + doubt_m**2
    status = trust(ellipse95(xx, xy, yy).major_m)
    if status is TrackStatus.TRACKING and max(levels) < SURE_OF_LEVEL:
        status = TrackStatus.UNCERTAIN
    return Estimate(
        t_s, x, y, xx, xy, yy, math.atan2(north, east), spread, step, status, levels.index(max(levels)), levels, z, z_sd
    )


def _heights(cloud: Cloud, weight: Floats) -> tuple[tuple[float, ...], float, float]:
    """Probability of each level; mean and standard deviation of the height."""
    if cloud.sheet is None:
        return (1.0,), 0.0, 0.0
    share = np.bincount(cloud.level, weight, len(cloud.sheet.height_m))
    z = float(weight @ cloud.z_m)
    return tuple(share.tolist()), z, math.sqrt(float(weight @ (cloud.z_m - z) ** 2))


def unobserved(last: Estimate, t_s: float) -> Estimate:
    """An estimate carried on to `t_s` without measurements: the position spreads at WALKER_M_S, the heading is unknown."""
    more = (WALKER_M_S * max(t_s - last.t_s, 0.0)) ** 2
    return replace(
        last, t_s=t_s, xx_m2=last.xx_m2 + more, yy_m2=last.yy_m2 + more, heading_sd_rad=math.pi, status=TrackStatus.LOST
    )


def trust(radius95_m: float) -> TrackStatus:
    """Status of a position whose 95 % ellipse has this longer half axis."""
    if radius95_m <= TRACKING_M:
        return TrackStatus.TRACKING
    return TrackStatus.UNCERTAIN if radius95_m <= LOST_M else TrackStatus.LOST


def digest(estimates: Iterable[Estimate]) -> str:
    """SHA-256 over every bit of the estimates: equal for equal runs."""
    sha = hashlib.sha256()
    for e in estimates:
        numbers = (e.t_s, e.x_m, e.y_m, e.xx_m2, e.xy_m2, e.yy_m2, e.heading_rad, e.heading_sd_rad)
        sha.update(struct.pack("<8di", *numbers, e.step) + e.status.value.encode())
        sha.update(struct.pack(f"<i2d{len(e.levels)}d", e.level, e.z_m, e.z_sd_m, *e.levels))
    return sha.hexdigest()
