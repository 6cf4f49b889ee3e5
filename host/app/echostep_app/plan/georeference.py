# SPDX-License-Identifier: MIT
"""Longitude and latitude -> metres on the plan, and back.

In: degrees (WGS 84 unless the georeference names another system). Out: map metres. Azimuthal equidistant projection about the plan's origin, accurate
to 1 mm over a kilometre.
"""

from __future__ import annotations

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.plan import Georeference, Plan
from echostep_app.extras import require


class EarthTransform:
    """Projection between a plan's map frame and the Earth, in both directions."""

    def __init__(self, georeference: Georeference) -> None:
        """Raises ValueError when pyproj does not know the coordinate system, or when it is not in degrees; EchostepError without pyproj."""
        require("the plan's georeference", "pyproj")
        from pyproj import CRS, Transformer
        from pyproj.exceptions import CRSError

        try:
            crs = CRS.from_user_input(georeference.crs)
        except CRSError as error:
            raise ValueError(
                f"georeference.crs: {georeference.crs[:60]!r} is not a coordinate system that pyproj knows"
            ) from error
        if not crs.is_geographic:
            raise ValueError(f"georeference.crs: {georeference.crs[:60]!r} is not in longitude and latitude")
        lon, lat = georeference.longitude_deg, georeference.latitude_deg
        local = CRS.from_dict({"proj": "aeqd", "lon_0": lon, "lat_0": lat, "datum": "WGS84", "units": "m"})
        self._to_east_north = Transformer.from_crs(crs, local, always_xy=True)
        self._to_degrees = Transformer.from_crs(local, crs, always_xy=True)
        c, s = np.cos(georeference.rotation_rad), np.sin(georeference.rotation_rad)
        self._rotation = np.array([[c, -s], [s, c]])  # map -> east, north

    def metres(self, lon_lat_deg: Floats) -> Floats:
        """(n, 2) longitude, latitude in degrees -> (n, 2) map metres; raises ValueError for values outside +-180 and +-90 degrees."""
        lon, lat = lon_lat_deg.T
        if not (np.abs(lon) <= 180).all() or not (np.abs(lat) <= 90).all():
            raise ValueError("coordinates are not longitudes and latitudes in degrees")
        east, north = self._to_east_north.transform(lon, lat)
        xy_m: Floats = np.column_stack((east, north)) @ self._rotation
        return xy_m

    def degrees(self, xy_m: Floats) -> Floats:
        """(n, 2) map metres -> (n, 2) longitude, latitude in degrees."""
        east, north = self._rotation @ xy_m.T
        return np.column_stack(self._to_degrees.transform(east, north))


def earth_of(plan: Plan) -> EarthTransform | None:
    """The transform of a plan to longitude and latitude, None without a georeference; raises EchostepError when it is not valid."""
    try:
        return None if plan.georeference is None else EarthTransform(plan.georeference)
    except ValueError as error:
        raise EchostepError(f"plan {plan.name}: {error}") from error
