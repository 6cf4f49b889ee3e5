"""The estimate: what people are told.

In: a cloud. Out: `Estimate`, immutable: position, covariance, heading, and in one word how far to trust it. Owns nothing.
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

from echostep.particles import Cloud

CHI2_95 = 5.991464547107979  # two degrees of freedom
TRACKING_M = 1.0
LOST_M = 5.0
WALKER_M_S = 1.5


class Status(StrEnum):
    """How far to trust a position: `uncertain` beyond 1 m of 95 % radius, `lost` beyond 5 m."""

    TRACKING = "tracking"
    UNCERTAIN = "uncertain"
    LOST = "lost"


@dataclass(frozen=True, slots=True)
class Estimate:
    """Trunk position in the map (m), covariance (xx, xy, yy in m2), heading (rad), at `t_s`."""

    t_s: float
    x_m: float
    y_m: float
    xx_m2: float
    xy_m2: float
    yy_m2: float
    heading_rad: float
    heading_sd_rad: float
    step: int
    status: Status

    @property
    def ellipse95(self) -> Ellipse:
        """The 95 % ellipse of the covariance."""
        return ellipse95(self.xx_m2, self.xy_m2, self.yy_m2)

    def holds(self, x_m: float, y_m: float) -> bool:
        """Whether a place lies in the 95 % ellipse."""
        dx, dy = x_m - self.x_m, y_m - self.y_m
        determinant = self.xx_m2 * self.yy_m2 - self.xy_m2**2
        square = self.yy_m2 * dx * dx - 2.0 * self.xy_m2 * dx * dy + self.xx_m2 * dy * dy
        return square <= CHI2_95 * determinant


class Ellipse(NamedTuple):
    """Half axes in metres and the angle of the longer one from x."""

    major_m: float
    minor_m: float
    angle_rad: float


def ellipse95(xx_m2: float, xy_m2: float, yy_m2: float) -> Ellipse:
    """The ellipse that holds 95 % of a normal distribution with this covariance."""
    values, vectors = np.linalg.eigh(np.array([[xx_m2, xy_m2], [xy_m2, yy_m2]]))
    minor, major = (math.sqrt(max(float(v), 0.0) * CHI2_95) for v in values)
    return Ellipse(major, minor, math.atan2(vectors[1, 1], vectors[0, 1]))


def estimate(cloud: Cloud, t_s: float, walk_heading_rad: float, step: int, doubt_m: float = 0.0) -> Estimate:
    """Weighted moments of the cloud [Girard 2011, eq. 2 for the mean]; `doubt_m`: standard deviation that the cloud does not know of."""
    weight = np.exp(cloud.log_weight)
    weight /= weight.sum()
    x, y = float(weight @ cloud.x_m), float(weight @ cloud.y_m)
    dx, dy = cloud.x_m - x, cloud.y_m - y
    xx, xy, yy = float(weight @ (dx * dx)), float(weight @ (dx * dy)), float(weight @ (dy * dy))
    east = float(weight @ np.cos(cloud.turn_rad + walk_heading_rad))
    north = float(weight @ np.sin(cloud.turn_rad + walk_heading_rad))
    spread = math.sqrt(max(-2.0 * math.log(min(math.hypot(east, north), 1.0)), 0.0))
    xx, yy = xx + doubt_m**2, yy + doubt_m**2
    status = trust(ellipse95(xx, xy, yy).major_m)
    return Estimate(t_s, x, y, xx, xy, yy, math.atan2(north, east), spread, step, status)


def unwatched(last: Estimate, t_s: float) -> Estimate:
    """What is left of an estimate when the foot has been silent since: he may have walked any way at a walker's speed."""
    more = (WALKER_M_S * max(t_s - last.t_s, 0.0)) ** 2
    return replace(
        last, t_s=t_s, xx_m2=last.xx_m2 + more, yy_m2=last.yy_m2 + more, heading_sd_rad=math.pi, status=Status.LOST
    )


def trust(radius95_m: float) -> Status:
    """How far to trust a position whose 95 % ellipse reaches so far."""
    if radius95_m <= TRACKING_M:
        return Status.TRACKING
    return Status.UNCERTAIN if radius95_m <= LOST_M else Status.LOST


def digest(estimates: Iterable[Estimate]) -> str:
    """SHA-256 over every bit of the estimates: equal for equal runs."""
    sha = hashlib.sha256()
    for e in estimates:
        numbers = (e.t_s, e.x_m, e.y_m, e.xx_m2, e.xy_m2, e.yy_m2, e.heading_rad, e.heading_sd_rad)
        sha.update(struct.pack("<8di", *numbers, e.step) + e.status.value.encode())
    return sha.hexdigest()
