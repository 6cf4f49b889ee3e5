# SPDX-License-Identifier: MIT
"""GeoJSON features -> shapes in map metres.

In: a parsed FeatureCollection [RFC 7946]. Out: features with their path in the file, properties, shapes. Owns nothing. Errors are ValueErrors that
name the feature.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import shapely
from shapely.geometry import LineString, MultiLineString, MultiPolygon, Point, Polygon
from shapely.geometry.base import BaseGeometry

from echostep.arrays import Floats
from echostep.fields import LIMIT_M
from echostep_app.plan.georeference import EarthTransform, is_projected
from echostep_app.plan.importers.parsing import PROJECTED, text, typed


def features(tree: Any) -> Iterator[tuple[str, dict[str, Any]]]:
    """Each feature with its path in the file, as `features[3]`."""
    tree = typed(tree, "the file", dict)
    if tree.get("type") != "FeatureCollection":
        raise ValueError(f"type: {str(tree.get('type'))[:40]!r} is not a FeatureCollection")
    _check_crs(tree.get("crs"))
    for i, feature in enumerate(typed(tree.get("features"), "features", list)):
        yield f"features[{i}]", typed(feature, f"features[{i}]", dict)


def _check_crs(crs: Any) -> None:
    """Raise ValueError for the older field crs [GeoJSON 2008, 3] when it names a projected system."""
    about = crs.get("properties") if isinstance(crs, dict) else None
    name = str(about.get("name"))[:60] if isinstance(about, dict) else ""
    if name and is_projected(name):
        raise ValueError(f"crs {name}: {PROJECTED}")


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
    """The feature's geometry in map metres; an empty polygon when it has none."""
    if feature.get("geometry") is None:
        return Polygon()
    where = f"{where}.geometry"
    geometry = typed(feature["geometry"], where, dict)
    kind, nested = geometry.get("type"), geometry.get("coordinates")
    where = f"{where}.coordinates"
    match kind:
        case "Point":
            return Point(*_metres([nested], where, earth))
        case "LineString":
            return _line(nested, where, earth)
        case "MultiLineString":
            return MultiLineString([_line(line, where, earth) for line in typed(nested, where, list)])
        case "Polygon":
            return _polygon(nested, where, earth)
        case "MultiPolygon":
            return MultiPolygon([_polygon(rings, where, earth) for rings in typed(nested, where, list)])
    raise ValueError(
        f"{where}: {str(kind)[:40]!r} is not a type of geometry that plans use: expected a point, lines or polygons"
    )


def _polygon(rings: Any, where: str, earth: EarthTransform) -> Polygon:
    """A polygon from its rings; if it crosses itself, its largest valid part."""
    rings = [_metres(corners, where, earth) for corners in typed(rings, where, list)]
    if not rings or any(len(corners) < 4 for corners in rings):
        raise ValueError(f"{where}: a polygon needs rings of four positions or more")
    polygon = Polygon(rings[0], rings[1:])
    if polygon.is_valid:
        return polygon
    parts = [part for part in shapely.get_parts(shapely.make_valid(polygon)) if isinstance(part, Polygon)]
    return max(parts, key=lambda part: part.area, default=Polygon())


def _line(positions: Any, where: str, earth: EarthTransform) -> LineString:
    metres = _metres(positions, where, earth)
    if len(metres) < 2:
        raise ValueError(f"{where}: a line needs two positions")
    return LineString(metres)


def _metres(positions: Any, where: str, earth: EarthTransform) -> Floats:
    """[[longitude, latitude, ...], ...] -> (n, 2) map metres."""
    rows = typed(positions, where, list)
    if not all(isinstance(row, list) and len(row) >= 2 for row in rows):
        raise ValueError(f"{where}: expected positions [longitude, latitude]")
    pairs = [row[:2] for row in rows]
    if not all(type(value) in (int, float) for pair in pairs for value in pair):
        raise ValueError(f"{where}: a coordinate is not a number")
    try:
        metres = earth.metres(np.array(pairs, dtype=np.float64).reshape(-1, 2))
    except (OverflowError, ValueError) as error:
        raise ValueError(f"{where}: {error}") from error
    if not (np.abs(metres) <= LIMIT_M).all():
        raise ValueError(f"{where}: further than {LIMIT_M / 1000:.0f} km from the plan's origin")
    return metres
