# SPDX-License-Identifier: MIT
"""A plan on the Earth: zones and bands by their rule, and how far the linear functions bend."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from board_runs import ROOT
from echostep.plan import Georeference, load_plan
from echostep_app.plan.georeference import EarthTransform
from echostep_app.plan.places.globe import globe_of, utm_band, utm_zone

PLAN = load_plan(ROOT / "host/core/echostep/plans/demo.json")
DEGREE_M = 111_320.0  # along a meridian


@pytest.mark.parametrize(
    ("lon_deg", "lat_deg", "zone"),
    [(44.4, 33.3, "38S"), (5.3, 60.4, "32V"), (2.9, 60.4, "31V"), (8.0, 78.0, "31X"), (10.0, 78.0, "33X"), (22.0, 78.0, "35X"),
     (34.0, 78.0, "37X"),
     (-180.0, 0.0, "1N"), (179.9, -80.0, "60C"), (180.0, 83.9, "1X"),
     (0.0, 84.0, "31X"),
     (16.4, -0.1, "33M"), (16.4, 84.1, "33"), (0.0, -80.1, "31")],
)  # fmt: skip
def test_zones_and_bands(lon_deg: float, lat_deg: float, zone: str) -> None:
    assert f"{utm_zone(lon_deg, lat_deg)}{utm_band(lat_deg)}" == zone


@pytest.mark.parametrize("lat_deg", [-33.9, 0.0, 48.2, 69.6])
def test_linear_within_a_kilometre(lat_deg: float) -> None:
    pyproj = pytest.importorskip("pyproj")
    georeference = Georeference(16.41, lat_deg, 0.4)
    globe = globe_of(replace(PLAN, georeference=georeference))
    assert globe is not None
    turn = np.linspace(0.0, 2.0 * np.pi, 16)
    places = np.array([[globe.x_m, globe.y_m]]) + 1000.0 * np.column_stack((np.cos(turn), np.sin(turn)))
    away = places - [globe.x_m, globe.y_m]
    exact = EarthTransform(georeference).degrees(places)
    linear = np.column_stack([value + away @ [by_x, by_y] for value, by_x, by_y in globe.degrees])
    metres = DEGREE_M * (linear - exact) * [np.cos(np.radians(lat_deg)), 1.0]
    assert np.abs(metres).max() < BENDS_M
    crs = f"EPSG:{326 if lat_deg >= 0.0 else 327}{globe.zone:02d}"
    utm_m = np.column_stack(pyproj.Transformer.from_crs("EPSG:4326", crs, always_xy=True).transform(*exact.T))
    found = np.column_stack([value + away @ [by_x, by_y] for value, by_x, by_y in globe.utm_m])
    assert np.abs(found - utm_m).max() < BENDS_M


BENDS_M = 0.22  # 0.09 m at Vienna, 0.21 m at Tromsø


def test_no_georeference_no_globe() -> None:
    assert globe_of(replace(PLAN, georeference=None)) is None
