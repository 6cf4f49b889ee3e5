"""Where places of the map lie on Earth.

In: a plan's georeference and places in map metres. Out: longitude and latitude (WGS 84). Owns nothing.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import pyproj
from numpy.typing import NDArray

from echostep.plan import Georeference

Floats = NDArray[np.float64]


def east_north(georeference: Georeference, x_m: Floats, y_m: Floats) -> tuple[Floats, Floats]:
    """Map metres turned into metres east and north of the map's origin, both (n,)."""
    c, s = math.cos(georeference.rotation_rad), math.sin(georeference.rotation_rad)
    return c * x_m - s * y_m, s * x_m + c * y_m


def longitude_latitude(georeference: Georeference, x_m: Floats, y_m: Floats) -> tuple[Floats, Floats]:
    """Degrees (n,) of places (n,), by the azimuthal equidistant projection about the map's origin: exact to millimetres on any site."""
    east, north = east_north(georeference, np.asarray(x_m, np.float64), np.asarray(y_m, np.float64))
    longitude, latitude = _projection(georeference.longitude_deg, georeference.latitude_deg)(east, north, inverse=True)
    return np.asarray(longitude), np.asarray(latitude)


def covariance_east_north(
    georeference: Georeference, xx_m2: float, xy_m2: float, yy_m2: float
) -> tuple[float, float, float]:
    """A covariance of the map's axes as variances east, of both, north."""
    c, s = math.cos(georeference.rotation_rad), math.sin(georeference.rotation_rad)
    east = c * c * xx_m2 - 2.0 * c * s * xy_m2 + s * s * yy_m2
    north = s * s * xx_m2 + 2.0 * c * s * xy_m2 + c * c * yy_m2
    return east, c * s * (xx_m2 - yy_m2) + (c * c - s * s) * xy_m2, north


@lru_cache(maxsize=8)
def _projection(longitude_deg: float, latitude_deg: float) -> pyproj.Proj:
    return pyproj.Proj(proj="aeqd", lon_0=longitude_deg, lat_0=latitude_deg, datum="WGS84", units="m")
