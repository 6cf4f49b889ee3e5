# SPDX-License-Identifier: MIT
"""The estimate: a position with its covariance, and a status that states how far to trust it.

In: values computed by `cloud_estimate`. Out: `Estimate`, immutable, and its derived values: ellipse, whether it claims a place. Owns nothing.
"""

from __future__ import annotations

import hashlib
import math
import struct
from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from echostep.localization.particles.places import LikelyPlace
from echostep.particles.ellipse import CHI2_95, Ellipse, ellipse95, in_ellipse95, widening_m2
from echostep.particles.limits import LOST_M, SURE, TRACKING_M, WALKER_M_S

TAIL = 1.5  # of the protection radius of a normal distribution, assumed: errors of echoes and steps have heavier tails


class TrackStatus(StrEnum):
    """How far to trust a position: `tracking` where the error is below 1 m with probability 0.95, `lost` where it is above 5 m with 0.5."""

    TRACKING = "tracking"
    UNCERTAIN = "uncertain"
    LOST = "lost"

    @classmethod
    def of(cls, radius95_m: float) -> TrackStatus:
        """Status of a position whose 95 % ellipse has this longer half axis."""
        return cls.TRACKING if radius95_m <= TRACKING_M else cls.UNCERTAIN if radius95_m <= LOST_M else cls.LOST


@dataclass(frozen=True, slots=True)
class Estimate:
    """Trunk position in the map (m), covariance (xx, xy, yy in m2), heading (rad), at `t_s`.

    `level` is the likeliest one (an index into the plan's), `levels` the probability of each: the rest is a floor that the plan lacks. `z_m` is the
    height in the plan's metres. `protection_m`: radius on that level beyond which the error is with probability RISK, infinite if none is that safe.
    `right`: probability of the position's place; `plan_fits`: that the plan is the building's; `outside`: that the trunk is outside of the building.
    `hypotheses`: the likely places where none is alone, the likeliest first, each with its share of the belief.

    >>> import echostep
    >>> last = echostep.replay("walk.mcap", "demo.json").estimates[-1]
    >>> last
    <Estimate at 2.67 s: x 2.00 m, y 7.50 m, level 0, 95 % within 0.40 m, heading 0 deg from x, tracking>
    >>> last.status == "tracking"
    True
    >>> round(last.ellipse95.minor_m, 1)
    0.3
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
    protection_m: float = math.inf
    right: float = 1.0
    hypotheses: tuple[LikelyPlace, ...] = ()
    plan_fits: float = 1.0
    outside: float = 0.0

    def __repr__(self) -> str:
        """Time, place with its 95 % radius, heading (it knows no north), status."""
        place = (
            f"x {self.x_m:.2f} m, y {self.y_m:.2f} m, level {self.level}, 95 % within {self.ellipse95.major_m:.2f} m"
        )
        heading_deg = round(math.degrees(self.heading_rad))
        return f"<Estimate at {self.t_s:.2f} s: {place}, heading {heading_deg} deg from x, {self.status.value}>"

    @property
    def ellipse95(self) -> Ellipse:
        """The 95 % ellipse of the covariance."""
        return ellipse95(self.xx_m2, self.xy_m2, self.yy_m2)

    def holds(self, x_m: float, y_m: float) -> bool:
        """Whether a place lies in the 95 % ellipse; in an ellipse without area, only its centre does."""
        error_m, covariance_m2 = (x_m - self.x_m, y_m - self.y_m), (self.xx_m2, self.xy_m2, self.yy_m2)
        return bool(in_ellipse95(np.array(error_m), np.array(covariance_m2)))

    @property
    def is_one_place(self) -> bool:
        """Whether one place has more than SURE of the belief: the ellipse is its region of 95 %; below that, `hypotheses` have their shares."""
        return self.right > SURE and len(self.hypotheses) < 2

    @property
    def claims_place(self) -> bool:
        """Whether the position may be named, drawn or sent: it is not lost, and the mean of several places lies in one of them.

        The one rule for page, terminal, reports, TAK, maps and the summary of a run. Without a plan only the page differs: it draws the end of the
        path.
        """
        places = self.hypotheses
        return self.status is not TrackStatus.LOST and (not places or any(map(self._lies_in, places)))

    def _lies_in(self, place: LikelyPlace) -> bool:
        """Whether the position is within TRACKING_M of a place, or in the circle that holds 95 % of it."""
        reach_m = max(TRACKING_M, math.sqrt(CHI2_95) * place.sd_m)
        return place.level == self.level and math.hypot(place.x_m - self.x_m, place.y_m - self.y_m) <= reach_m

    def unobserved(self, t_s: float) -> Estimate:
        """The same at `t_s`, without measurements since: both radii grow at WALKER_M_S, the status is no better than that, the heading is unknown."""
        by_m, radius_m = WALKER_M_S * max(t_s - self.t_s, 0.0), self.ellipse95.major_m
        status = max(self.status, TrackStatus.of(radius_m + by_m), key=list(TrackStatus).index)
        more = widening_m2(radius_m, by_m)
        grown = replace(self, xx_m2=self.xx_m2 + more, yy_m2=self.yy_m2 + more, protection_m=self.protection_m + by_m)
        return replace(grown, t_s=t_s, heading_sd_rad=math.pi, status=status)


def digest(estimates: Iterable[Estimate]) -> str:
    """SHA-256 over every bit of the estimates: equal for equal runs."""
    sha = hashlib.sha256()
    for e in estimates:
        numbers = (e.t_s, e.x_m, e.y_m, e.xx_m2, e.xy_m2, e.yy_m2, e.heading_rad, e.heading_sd_rad)
        sha.update(struct.pack("<8di", *numbers, e.step) + e.status.value.encode())
        sha.update(struct.pack(f"<i2d{len(e.levels)}d", e.level, e.z_m, e.z_sd_m, *e.levels))
    return sha.hexdigest()
