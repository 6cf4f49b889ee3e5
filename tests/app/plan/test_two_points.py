# SPDX-License-Identifier: MIT
"""The georeference from two points: exact anywhere on Earth, refused where the distances disagree."""

from __future__ import annotations

import json

import numpy as np
import pytest

from echostep.errors import EchostepError
from echostep.plan import Georeference
from echostep_app.plan.georeference import EarthTransform
from echostep_app.plan.two_points import LEAST_M, MOST_SHARE, fit_two_points, parse_two_points

TRUE = [
    Georeference(11.5755, 48.1374, 0.3), Georeference(-70.6, -33.4, -2.9), Georeference(179.9999, -17.0, 1.6),
    Georeference(25.0, 84.9, 3.1), Georeference(0.0, 0.0, 0.0),
]  # fmt: skip


@pytest.mark.parametrize("true", TRUE)
@pytest.mark.parametrize(
    "points_m", [[[1.0, 2.0], [25.0, 13.0]], [[-400.0, 900.0], [300.0, -200.0]], [[30_000.0, 1.0], [30_100.0, 1.0]]]
)
def test_the_georeference_that_gave_the_degrees_is_found(true: Georeference, points_m: list[list[float]]) -> None:
    xy_m = np.array(points_m)
    fit = fit_two_points(xy_m, EarthTransform(true).degrees(xy_m))
    assert fit.georeference.crs == "EPSG:4326"
    assert EarthTransform(fit.georeference).degrees(xy_m) == pytest.approx(EarthTransform(true).degrees(xy_m), abs=1e-9)
    origin_m = EarthTransform(true).metres(np.array([[fit.georeference.longitude_deg, fit.georeference.latitude_deg]]))
    assert np.hypot(*origin_m[0]) < 1e-3 * max(1.0, np.abs(xy_m).max() / 1000.0)
    assert np.cos(fit.georeference.rotation_rad - true.rotation_rad) == pytest.approx(1.0, abs=1e-9)
    assert abs(fit.share) < 1e-5


def test_an_error_of_scale_is_shared_by_both_points() -> None:
    true, xy_m = TRUE[0], np.array([[0.0, 0.0], [40.0, 0.0]])
    degrees = EarthTransform(true).degrees(1.02 * xy_m)
    fit = fit_two_points(xy_m, degrees)
    assert fit.plan_m == pytest.approx(40.0)
    assert fit.earth_m == pytest.approx(40.8, abs=1e-4)
    assert fit.share == pytest.approx(0.02, abs=1e-5)
    off_m = EarthTransform(fit.georeference).metres(degrees) - xy_m
    assert off_m == pytest.approx(np.array([[-0.4, 0.0], [0.4, 0.0]]), abs=1e-4)


@pytest.mark.parametrize("factor", [1.0 + 1.01 * MOST_SHARE, 1.0 - 1.01 * MOST_SHARE, 0.0, 1000.0])
def test_distances_that_disagree_are_refused(factor: float) -> None:
    xy_m = np.array([[0.0, 0.0], [40.0, 0.0]])
    with pytest.raises(EchostepError, match=r"40\.00 m apart on the plan and .* m on Earth, .*more than 5 %"):
        fit_two_points(xy_m, EarthTransform(TRUE[0]).degrees(factor * xy_m))
    fit_two_points(xy_m, EarthTransform(TRUE[0]).degrees((1.0 + 0.99 * MOST_SHARE) * xy_m))


def test_points_too_near_to_each_other_are_refused() -> None:
    xy_m = np.array([[0.0, 0.0], [0.99 * LEAST_M, 0.0]])
    with pytest.raises(EchostepError, match=r"4\.95 m apart on the plan: choose two that are 5 m"):
        fit_two_points(xy_m, EarthTransform(TRUE[0]).degrees(xy_m))


POINT = {"x_m": 0, "y_m": 0, "longitude_deg": 0, "latitude_deg": 0}


@pytest.mark.parametrize(
    ("raw", "names"),
    [
        (b"", "not two points"), (b"[" * 100_000, "not two points"), (b"{}", "points: missing"), (b'{"points": []}', "a list of two points"),
        (json.dumps({"points": [POINT] * 3}).encode(), "a list of two points"),
        (json.dumps({"points": [POINT, POINT | {"latitude_deg": 91}]}).encode(), r"points\[1\]\.latitude_deg"),
        (json.dumps({"points": [POINT, POINT | {"longitude_deg": float("nan")}]}).encode(), r"points\[1\]\.longitude_deg"),
        (json.dumps({"points": [POINT, POINT | {"x_m": float("inf")}]}).encode(), r"points\[1\]\.x_m"),
    ],
)  # fmt: skip
def test_what_are_no_two_points_is_refused_by_its_field(raw: bytes, names: str) -> None:
    with pytest.raises(ValueError, match=names):
        parse_two_points(raw)
