"""Longitude and latitude -> metres on the plan, and back.

In: degrees (WGS 84 unless the georeference says otherwise). Out: map metres. Azimuthal equidistant about the plan's origin: true to 1 mm
over a kilometre.
"""

from __future__ import annotations

import numpy as np

from echostep.arrays import Floats
from echostep.plan.model import Georeference


class EarthTransform:
    """The plan's place on EarthTransform; raises ValueError when pyproj does not know the coordinate system."""

    def __init__(self, georeference: Georeference) -> None:
        """Prepare both ways."""
        from pyproj import CRS, Transformer
        from pyproj.exceptions import CRSError

        try:
            crs = CRS.from_user_input(georeference.crs)
        except CRSError as error:
            raise ValueError(
                f"georeference.crs: {georeference.crs[:60]!r} is no coordinate system that pyproj knows"
            ) from error
        if not crs.is_geographic:
            raise ValueError(f"georeference.crs: {georeference.crs[:60]!r} is not in longitude and latitude")
        lon, lat = georeference.longitude_deg, georeference.latitude_deg
        local = CRS.from_dict({"proj": "aeqd", "lon_0": lon, "lat_0": lat, "datum": "WGS84", "units": "m"})
        self._there = Transformer.from_crs(crs, local, always_xy=True)
        self._back = Transformer.from_crs(local, crs, always_xy=True)
        c, s = np.cos(georeference.rotation_rad), np.sin(georeference.rotation_rad)
        self._turn = np.array([[c, -s], [s, c]])  # map -> east, north

    def metres(self, lon_lat_deg: Floats) -> Floats:
        """(n, 2) degrees -> (n, 2) map metres; raises ValueError for what is not on EarthTransform."""
        lon, lat = lon_lat_deg.T
        if not (np.abs(lon) <= 180).all() or not (np.abs(lat) <= 90).all():
            raise ValueError("coordinates are no longitudes and latitudes in degrees")
        east, north = self._there.transform(lon, lat)
        found: Floats = np.column_stack((east, north)) @ self._turn
        return found

    def degrees(self, xy_m: Floats) -> Floats:
        """(n, 2) map metres -> (n, 2) longitude, latitude."""
        east, north = self._turn @ xy_m.T
        return np.column_stack(self._back.transform(east, north))
