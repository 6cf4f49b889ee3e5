# SPDX-License-Identifier: MIT
"""GeoJSON features -> shapes in map metres.

In: a parsed FeatureCollection [RFC 7946]. Out: features with their path in the file, properties, shapes. Owns nothing. Errors are ValueErrors that
name the feature. Coordinates in another datum, stated by the older field crs [GeoJSON 2008, 3], become WGS 84; projected ones are refused.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import shapely
from shapely.geometry import GeometryCollection, LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from echostep.arrays import Floats
from echostep.fields import LIMIT_M
from echostep_app.plan.georeference import EarthTransform, to_wgs84
from echostep_app.plan.importers.parsing import PROJECTED, number, text, typed

SINGLE = {"MultiPoint": "Point", "MultiLineString": "LineString", "MultiPolygon": "Polygon"}
DEEPEST = {"Point": 0, "LineString": 1, "Polygon": 2}  # lists around a position
Place = tuple[float, float]


def features(tree: Any) -> Iterator[tuple[str, dict[str, Any]]]:
    """Each feature with its path in the file, as `features[3]`."""
    tree = typed(tree, "the file", dict)
    if tree.get("type") != "FeatureCollection":
        raise ValueError(f"type: {str(tree.get('type'))[:40]!r} is not a FeatureCollection")
    datum = _datum(tree.get("crs"))
    for i, feature in enumerate(typed(tree.get("features"), "features", list)):
        feature = typed(feature, f"features[{i}]", dict)
        yield f"features[{i}]", feature if datum is None else feature | {"datum": datum}


def _datum(crs: Any) -> Callable[[float, float], Place] | None:
    """From a stated datum to WGS 84; None without one. Raises ValueError for a projected system."""
    about = crs.get("properties") if isinstance(crs, dict) else None
    name = str(about.get("name"))[:60] if isinstance(about, dict) else ""
    try:
        return to_wgs84(name) if name else None
    except ValueError as error:
        raise ValueError(f"crs: {error}: {PROJECTED}") from error


def geometries(feature: dict[str, Any], where: str) -> Iterator[tuple[str, Any, str]]:
    """Points, lines and polygons of a feature, also those in collections: kind, nested positions as (longitude, latitude), path in the file."""
    stack = [] if feature.get("geometry") is None else [(feature["geometry"], f"{where}.geometry")]
    while stack:
        value, at = stack.pop()
        geometry = typed(value, at, dict)
        kind, nested = geometry.get("type"), geometry.get("coordinates")
        if kind == "GeometryCollection":
            parts = typed(geometry.get("geometries"), f"{at}.geometries", list)
            stack += [(part, f"{at}.geometries[{i}]") for i, part in enumerate(parts)][::-1]
        elif kind in SINGLE:
            nested = typed(nested, f"{at}.coordinates", list)
            stack += [({"type": SINGLE[kind], "coordinates": part}, at) for part in nested][::-1]
        elif kind in DEEPEST:
            at = f"{at}.coordinates"
            yield kind, _places(nested, at, DEEPEST[kind], feature.get("datum")), at
        else:
            raise ValueError(f"{at}: {str(kind)[:40]!r} is no type of geometry: expected points, lines or polygons")


def _places(nested: Any, where: str, depth: int, datum: Callable[[float, float], Place] | None) -> Any:
    """Nested positions as pairs in WGS 84."""
    rows = typed(nested, where, list)
    if depth:
        return [_places(row, where, depth - 1, datum) for row in rows]
    if len(rows) < 2:
        raise ValueError(f"{where}: expected [longitude, latitude]")
    lon, lat = number(rows[0], where, 180.0, "degrees"), number(rows[1], where, 90.0, "degrees")
    return (lon, lat) if datum is None else datum(lon, lat)


def properties(feature: dict[str, Any], where: str) -> dict[str, Any]:
    """The feature's properties; empty when it has none."""
    values: dict[str, Any] = typed(feature.get("properties") or {}, f"{where}.properties", dict)
    return values


def label(value: Any, where: str) -> str:
    """A name as text: given as a string, as strings by language (English preferred), as a number, or not at all (empty)."""
    if isinstance(value, dict) and value:
        value = value.get("en") or next(iter(value.values()))
    if isinstance(value, int) and not isinstance(value, bool):
        value = str(value)
    return "" if value is None else text(value, where).strip()


def shape(feature: dict[str, Any], where: str, earth: EarthTransform) -> BaseGeometry:
    """The feature's geometry in map metres; an empty one when it has none."""
    parts = [_shape(kind, nested, at, earth) for kind, nested, at in geometries(feature, where)]
    return parts[0] if len(parts) == 1 else GeometryCollection(parts)


def _shape(kind: str, nested: Any, where: str, earth: EarthTransform) -> BaseGeometry:
    if kind == "Point":
        return Point(*_metres([nested], where, earth))
    if kind == "LineString":
        if len(nested) < 2:
            raise ValueError(f"{where}: a line needs two positions")
        return LineString(_metres(nested, where, earth))
    return _polygon(nested, where, earth)


def _polygon(rings: Any, where: str, earth: EarthTransform) -> Polygon:
    """A polygon from its rings; if it crosses itself, its largest valid part."""
    if not rings or any(len(corners) < 4 for corners in rings):
        raise ValueError(f"{where}: a polygon needs rings of four positions or more")
    rings = [_metres(corners, where, earth) for corners in rings]
    polygon = Polygon(rings[0], rings[1:])
    if polygon.is_valid:
        return polygon
    parts = [part for part in shapely.get_parts(shapely.make_valid(polygon)) if isinstance(part, Polygon)]
    return max(parts, key=lambda part: part.area, default=Polygon())


def _metres(places: list[Place], where: str, earth: EarthTransform) -> Floats:
    """(n, 2) map metres of positions."""
    metres = earth.metres(np.array(places, dtype=np.float64).reshape(-1, 2))
    if not (np.abs(metres) <= LIMIT_M).all():
        raise ValueError(f"{where}: further than {LIMIT_M / 1000:.0f} km from the plan's origin")
    return metres
