# SPDX-License-Identifier: MIT
"""The georeference of a plan from two of its points whose longitude and latitude are known.

In: places of the plan in metres, their degrees (WGS 84). Out: `TwoPoints`: the georeference that puts the middle of both where it is and turns the
plan by their direction, and the two distances. Owns the limits. A plan is turned and moved, not scaled: a scale that differs is an error of plan or
points.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.fields import Latitude, Longitude, Metres, checked
from echostep.plan import Georeference
from echostep_app.plan.georeference import EarthTransform

LEAST_M = 5.0  # between the points, assumed: a map's error of 0.5 m turns the plan by 6 degrees over this distance
# Of the plan's distance by which the distance on Earth may differ, assumed: 1 m of a map's error over 20 m
MOST_SHARE = 0.05
TURNS = 3  # of the fit: an error of 0.2 mm is left for a plan 100 km from its origin


class PointFields(Struct):
    """A place of the plan and where it is on Earth."""

    x_m: Metres
    y_m: Metres
    longitude_deg: Longitude
    latitude_deg: Latitude


class TwoPointFields(Struct):
    """The fields that the editor posts."""

    points: Annotated[list[PointFields], Meta(min_length=2, max_length=2, description="a list of two points")]


@dataclass(frozen=True, slots=True)
class TwoPoints:
    """A georeference, and the distance of the two points on the plan and on Earth in metres."""

    georeference: Georeference
    plan_m: float
    earth_m: float

    @property
    def share(self) -> float:
        """Share of the plan's distance by which the distance on Earth is longer."""
        return self.earth_m / self.plan_m - 1.0


def parse_two_points(raw: bytes) -> TwoPoints:
    """The fit of posted points; raises ValueError that names the field, EchostepError as `fit_two_points` does."""
    try:
        tree = json.loads(raw)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"not two points: {error}") from error
    points = checked(tree, TwoPointFields).points
    return fit_two_points(
        np.array([[point.x_m, point.y_m] for point in points]),
        np.array([[point.longitude_deg, point.latitude_deg] for point in points]),
    )


def fit_two_points(xy_m: Floats, lon_lat_deg: Floats) -> TwoPoints:
    """Two places (2, 2) of the plan, their longitudes and latitudes (2, 2) -> the fit.

    Raises EchostepError when the points are too near to each other, when their distances disagree, or without pyproj.
    """
    plan_m = _length(xy_m)
    if plan_m < LEAST_M:
        raise EchostepError(
            f"the two points are {plan_m:.2f} m apart on the plan: choose two that are {LEAST_M:g} m or more apart"
        )
    guess = Georeference(float(lon_lat_deg[0, 0]), float(lon_lat_deg[0, 1]))
    earth_m = _length(EarthTransform(guess).metres(lon_lat_deg))
    if abs(earth_m - plan_m) > MOST_SHARE * plan_m:
        raise EchostepError(
            f"the two points are {plan_m:.2f} m apart on the plan and {earth_m:.2f} m on Earth, {_percent(earth_m / plan_m - 1.0)}: "
            f"more than {100 * MOST_SHARE:g} %; check both points and the scale of the plan"
        )
    for _ in range(TURNS):
        guess = _fitted(guess, xy_m, lon_lat_deg)
    return TwoPoints(guess, plan_m, earth_m)


def _fitted(guess: Georeference, xy_m: Floats, lon_lat_deg: Floats) -> Georeference:
    """The guess, turned and moved by where it puts the two points."""
    earth = EarthTransform(guess)
    found_m = earth.metres(lon_lat_deg)
    turn_rad = _angle(found_m) - _angle(xy_m)
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    origin_m = found_m.mean(axis=0) - np.array([[c, -s], [s, c]]) @ xy_m.mean(axis=0)
    ((lon, lat),) = earth.degrees(origin_m[np.newaxis])
    rotation_rad = math.remainder(guess.rotation_rad + turn_rad, 2.0 * math.pi)
    return Georeference(float(lon), float(lat), rotation_rad)


def _length(points_m: Floats) -> float:
    return float(np.hypot(*(points_m[1] - points_m[0])))


def _angle(points_m: Floats) -> float:
    dx, dy = points_m[1] - points_m[0]
    return math.atan2(dy, dx)


def _percent(share: float) -> str:
    return f"{abs(100 * share):.1f} % {'longer' if share > 0 else 'shorter'}"
