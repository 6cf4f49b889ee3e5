# SPDX-License-Identifier: MIT
"""The plan on the Earth, as a page needs it: longitude, latitude and UTM as linear functions of the place.

In: a plan with a georeference. Out: `Globe`; None without one, and without pyproj. Owns the rules of zones and bands.
The projection bends by 1 to 2 mm within 100 m of the middle of the plan, by 0.2 m within 1 km (`tests/app/plan/test_georeference.py`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from echostep.arrays import Floats
from echostep.plan import Georeference, Plan
from echostep_app.extras import lacks
from echostep_app.plan.georeference import EarthTransform

BANDS = "CDEFGHJKLMNPQRSTUVWX"  # of 8 degrees from 80 S on, the last one of 12 [NGA.STND.0037, 2.5.3]
SOUTHMOST_DEG, NORTHMOST_DEG = -80.0, 84.0  # of UTM
BASE_M = 100.0  # over which the derivatives are taken
Linear = tuple[tuple[float, float, float], tuple[float, float, float]]  # value, by x, by y, of both coordinates


@dataclass(frozen=True, slots=True)
class Globe:
    """About the place (`x_m`, `y_m`): `degrees` longitude and latitude, `utm_m` easting and northing in `zone` and `band`.

    `band` is empty near the poles, where UTM is not defined. The field names are keys of the page's JSON.
    """

    x_m: float
    y_m: float
    degrees: Linear
    utm_m: Linear
    zone: int
    band: str


def globe_of(plan: Plan) -> Globe | None:
    """The plan on the Earth, about its middle."""
    if plan.georeference is None or lacks("longitude and latitude", "pyproj"):
        return None
    corners = [level.solid.reshape(-1, 2) for level in plan.levels if len(level.solid)]
    points = np.concatenate(corners) if corners else np.zeros((1, 2))
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    try:
        return _globe(plan.georeference, float(middle[0]), float(middle[1]))
    except ValueError:
        return None


@lru_cache(maxsize=8)
def _globe(georeference: Georeference, x_m: float, y_m: float) -> Globe:
    from pyproj import Transformer

    around = np.array([[x_m, y_m], [x_m - BASE_M, y_m], [x_m + BASE_M, y_m], [x_m, y_m - BASE_M], [x_m, y_m + BASE_M]])
    degrees = EarthTransform(georeference).degrees(around)
    lon_deg, lat_deg = map(float, degrees[0])
    zone, band = utm_zone(lon_deg, lat_deg), utm_band(lat_deg)
    to_utm = Transformer.from_crs("EPSG:4326", f"EPSG:{326 if lat_deg >= 0.0 else 327}{zone:02d}", always_xy=True)
    utm_m = np.column_stack(to_utm.transform(*degrees.T)) if band else np.zeros((5, 2))
    return Globe(x_m, y_m, _linear(degrees), _linear(utm_m), zone, band)


def _linear(values: Floats) -> Linear:
    """Value and derivatives of both columns, from the middle and the places to its west, east, south and north."""
    by_x, by_y = (values[2] - values[1]) / (2.0 * BASE_M), (values[4] - values[3]) / (2.0 * BASE_M)
    first, second = (tuple(map(float, (values[0, k], by_x[k], by_y[k]))) for k in (0, 1))
    return first, second  # type: ignore[return-value]


def utm_band(lat_deg: float) -> str:
    """The letter of the latitude band; empty near the poles."""
    if not SOUTHMOST_DEG <= lat_deg <= NORTHMOST_DEG:
        return ""
    return BANDS[min(int((lat_deg - SOUTHMOST_DEG) // 8.0), len(BANDS) - 1)]


def utm_zone(lon_deg: float, lat_deg: float) -> int:
    """The zone, 1 to 60, with the wider ones of Norway and Svalbard [NGA.STND.0037, 2.5.2]."""
    if 56.0 <= lat_deg < 64.0 and 3.0 <= lon_deg < 12.0:
        return 32
    if 72.0 <= lat_deg <= NORTHMOST_DEG and 0.0 <= lon_deg < 42.0:
        return 31 if lon_deg < 9.0 else 33 if lon_deg < 21.0 else 35 if lon_deg < 33.0 else 37
    return int((lon_deg + 180.0) // 6.0) % 60 + 1
