"""From the plan to the Earth: a position on the plan -> latitude and longitude.

In: a plan with a georeference, a position, a heading. Out: `Place`. Owns nothing.
"""

from __future__ import annotations

import math
from typing import Protocol

from echostep.plan import Plan
from echostep.team.report import Place

EQUATOR_M, FLATTENING = 6_378_137.0, 1.0 / 298.257223563  # [WGS 84]


class Georeference(Protocol):
    """What `Plan.georeference` tells: where the origin lies, and how far x is turned counter-clockwise from east."""

    @property
    def longitude_deg(self) -> float: ...
    @property
    def latitude_deg(self) -> float: ...
    @property
    def rotation_rad(self) -> float: ...


def georeference(plan: Plan) -> Georeference | None:
    """The plan's georeference, if it has one."""
    return getattr(plan, "georeference", None)


def place(plan: Plan, x_m: float, y_m: float, sd_m: float, heading_rad: float | None) -> Place | None:
    """Where a position is on Earth; None without a georeference.

    On the tangent plane at the plan's origin: within 1 mm for a kilometre. `sd_m` is widened by the plan's own uncertainty. The height stays unknown:
    a plan's heights are not tied to the ellipsoid.
    """
    origin = georeference(plan)
    if origin is None:
        return None
    c, s = math.cos(origin.rotation_rad), math.sin(origin.rotation_rad)
    east, north = c * x_m - s * y_m, s * x_m + c * y_m
    latitude = math.radians(origin.latitude_deg)
    square = FLATTENING * (2.0 - FLATTENING)
    curve = 1.0 - square * math.sin(latitude) ** 2
    across, along = EQUATOR_M / math.sqrt(curve), EQUATOR_M * (1.0 - square) / curve**1.5  # radii of curvature
    lat = origin.latitude_deg + math.degrees(north / along)
    lon = origin.longitude_deg + math.degrees(east / (across * max(math.cos(latitude), 1e-9)))
    course = None if heading_rad is None else (90.0 - math.degrees(heading_rad + origin.rotation_rad)) % 360.0
    uncertainty = getattr(plan, "uncertainty_m", None) or 0.0
    return Place(
        max(-90.0, min(90.0, lat)), (lon + 180.0) % 360.0 - 180.0, None, math.hypot(sd_m, uncertainty), None, course
    )
