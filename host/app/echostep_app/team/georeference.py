# SPDX-License-Identifier: MIT
"""A position on the plan as latitude and longitude.

In: a plan with a georeference, a position, a heading. Out: `ReportedPlace`. Owns the projection.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.plan import Plan
from echostep_app.plan.georeference import EarthTransform
from echostep_app.team.messages.report import ReportedPlace


class GroundPlane:
    """Transforms positions on a georeferenced plan to WGS 84."""

    def __init__(self, plan: Plan) -> None:
        """Raises ValueError when the plan has no georeference that can be used."""
        if plan.georeference is None:
            raise ValueError("the plan has no georeference")
        self._rotation_rad = plan.georeference.rotation_rad
        self._uncertainty_m = plan.uncertainty_m or 0.0
        self._earth = EarthTransform(plan.georeference)

    def place(self, x_m: float, y_m: float, sd_m: float, heading_rad: float | None) -> ReportedPlace:
        """A position on the plan, on Earth.

        `sd_m` is combined with the plan's uncertainty. The height stays unknown: a plan's heights do not refer to the ellipsoid.
        """
        ((lon, lat),) = self._earth.degrees(np.array([[x_m, y_m]]))
        course = None if heading_rad is None else (90.0 - math.degrees(heading_rad + self._rotation_rad)) % 360.0
        return ReportedPlace(float(lat), float(lon), None, math.hypot(sd_m, self._uncertainty_m), None, course)
