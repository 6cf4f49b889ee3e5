# SPDX-License-Identifier: MIT
"""Longitude and latitude (WGS 84) -> metres on the plan, and back.

In: degrees. Out: map metres. Azimuthal equidistant projection about the plan's origin, which may be stated in another datum; accurate to 1 mm over
a kilometre.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from echostep.arrays import Floats
from echostep.plan import Georeference, Plan
from echostep_app.extras import lacks, require
from echostep_app.printing.lines import faults_of

WGS84 = "EPSG:4326"
FAR_M, EARTH_M = 1e4, 1e8  # larger coordinates are in a national grid; beyond that in none: twice around the Earth
IN_GRID = "{} lies in a national grid: the plan's origin is x {:.0f} m, y {:.0f} m there"


def grid_origin(points_m: Floats) -> tuple[float, float]:
    """The median of points (n, 2) in whole metres, so that a stray one does not count; 0, 0 where that is near, or in no grid."""
    x, y = np.floor(np.median(points_m, axis=0)) if len(points_m) else (0.0, 0.0)
    return (float(x), float(y)) if FAR_M < max(abs(x), abs(y)) <= EARTH_M else (0.0, 0.0)


class EarthTransform:
    """Projection between a plan's map frame and the Earth, in both directions."""

    def __init__(self, georeference: Georeference) -> None:
        """Raises ValueError when pyproj does not know the coordinate system, or when it is not in degrees; EchostepError without pyproj."""
        require("the plan's georeference", "pyproj")
        from pyproj import CRS, Transformer

        stated = georeference.longitude_deg, georeference.latitude_deg
        try:
            lon, lat = to_wgs84(georeference.crs)(*stated)
        except ValueError as error:
            raise ValueError(f"georeference.crs: {error}") from error
        if not (np.isfinite(lon) and np.isfinite(lat)):
            raise ValueError(f"georeference.origin: {stated[0]:g}, {stated[1]:g} is outside {georeference.crs[:60]!r}")
        local = CRS.from_dict({"proj": "aeqd", "lon_0": lon, "lat_0": lat, "datum": "WGS84", "units": "m"})
        self._to_east_north = Transformer.from_crs(WGS84, local, always_xy=True)
        self._to_degrees = Transformer.from_crs(local, WGS84, always_xy=True)
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


def to_wgs84(name: str) -> Callable[[float, float], tuple[float, float]]:
    """From longitude and latitude in a coordinate system to WGS 84; raises ValueError for one in metres, and for one that pyproj does not know."""
    require("a coordinate system", "pyproj")
    from pyproj import CRS, Transformer
    from pyproj.exceptions import CRSError

    try:
        crs = CRS.from_user_input(name)
    except CRSError as error:
        raise ValueError(f"{name[:60]!r} is not a coordinate system that pyproj knows") from error
    if not crs.is_geographic:
        raise ValueError(f"{name[:60]!r} is not in longitude and latitude")
    return Transformer.from_crs(crs, WGS84, always_xy=True).transform


def earth_of(plan: Plan) -> EarthTransform | None:
    """The transform of a plan to longitude and latitude, None without a georeference or without pyproj; raises EchostepError when it is not valid."""
    with faults_of(f"plan {plan.name}"):
        return None if plan.georeference is None or lacks("it", "pyproj") else EarthTransform(plan.georeference)
