# SPDX-License-Identifier: MIT
"""Where a model lies by its map conversion [IFC 4, IfcMapConversion; in IFC 2x3 the property set ePSet_MapConversion].

In: a model, the plan's origin in it. Out: longitude, latitude and direction of the plan's axes, None without a conversion; doubts where it
contradicts itself. Owns nothing. The unit of eastings and northings is the coordinate system's, or by its scale; where neither is stated, it
is the one in which they lie where the coordinate system is used.
"""

from __future__ import annotations

import math
from importlib import import_module
from typing import Any

import numpy as np

from echostep.plan import Georeference
from echostep_app.extras import lacks
from echostep_app.plan.georeference import WGS84, EarthTransform
from echostep_app.plan.importers.report import ImportReport

AHEAD_M = 100.0  # along the plan's x axis: the second place that gives its direction
BY_HAND = "write the plan's georeference by hand (docs/plan.md)"


def map_georeference(
    model: Any, origin_m: tuple[float, float], scale_m: float, report: ImportReport
) -> Georeference | None:
    """The georeference of a plan whose origin is at `origin_m` in the model; `scale_m`: its unit of length."""
    conversion, system = _stated(model)
    if not conversion:
        return None
    name = str(system.get("Name") or "")[:60]
    if words := lacks("its map conversion", "pyproj"):
        report.doubt(words)
        return None
    from pyproj import CRS, Transformer
    from pyproj.exceptions import CRSError

    try:
        crs = CRS.from_user_input(name)
    except CRSError:
        report.doubt(f"its map conversion is in {name!r}, which pyproj does not know: {BY_HAND}")
        return None
    east, north, along, across, scale = (
        _number(conversion.get(key)) for key in ("Eastings", "Northings", "XAxisAbscissa", "XAxisOrdinate", "Scale")
    )
    axis_m = crs.axis_info[0].unit_conversion_factor if crs.is_projected else 0.0
    stated_m = _unit_m(system.get("MapUnit")) or (scale_m / scale if scale not in (0.0, 1.0) else 0.0)
    to_degrees = Transformer.from_crs(crs, WGS84, always_xy=True).transform
    turn = math.atan2(across, along) if along or across else 0.0
    c, s = math.cos(turn), math.sin(turn)
    places = []
    for unit_m in sorted({stated_m} if stated_m else {axis_m, scale_m}) if axis_m else ():
        stretch = scale * unit_m / scale_m
        grid = stretch if abs(stretch - 1.0) < 0.01 else 1.0  # metres there for one here
        ends = [
            to_degrees(
                (east * unit_m + grid * (c * x - s * origin_m[1])) / axis_m,
                (north * unit_m + grid * (s * x + c * origin_m[1])) / axis_m,
            )
            for x in (origin_m[0], origin_m[0] + AHEAD_M)
        ]
        places += [ends] if _is_used_there(crs, *ends[0]) else []
    if len(places) != 1:
        report.doubt(
            f"its map conversion lies {'outside of ' if not places else 'in several places of '}{name!r}: {BY_HAND}"
        )
        return None
    (lon, lat), ahead = places[0]
    x, y = EarthTransform(Georeference(lon, lat, 0.0)).metres(np.array([ahead]))[0]
    return Georeference(lon, lat, math.atan2(y, x))


def _stated(model: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """The attributes of the map conversion and of its coordinate system; empty without one."""
    if model.schema != "IFC2X3":
        conversions = model.by_type("IfcMapConversion")
        rows = [(c.get_info(), c.TargetCRS.get_info()) for c in conversions if c.TargetCRS]
        return rows[0] if rows else ({}, {})
    psets = import_module("ifcopenshell.util.element").get_psets
    owners = [*model.by_type("IfcProject"), *model.by_type("IfcSite")]
    sets = {name.casefold(): values for owner in owners for name, values in psets(owner).items()}
    return sets.get("epset_mapconversion", {}), sets.get("epset_projectedcrs", {})


def _number(value: Any) -> float:
    """A stated number, also as text; 0 where none is, not a number for other text."""
    try:
        return float(value or 0.0)
    except (TypeError, ValueError):
        return math.nan


def _unit_m(unit: Any) -> float:
    """A stated unit in metres; 0 where none is, or only a word."""
    if unit is None or isinstance(unit, str):
        return 0.0
    return float(import_module("ifcopenshell.util.unit").get_unit_scale(unit))


def _is_used_there(crs: Any, lon: float, lat: float) -> bool:
    """Whether a place lies where the coordinate system is used."""
    area = crs.area_of_use
    if not (math.isfinite(lon) and math.isfinite(lat)):
        return False
    return area is None or (area.west <= lon <= area.east and area.south <= lat <= area.north)
