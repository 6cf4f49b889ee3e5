# SPDX-License-Identifier: MIT
"""GeoJSON of OpenStreetMap (overpass-turbo, osmtogeojson) -> elements in the form of Overpass JSON.

In: a parsed FeatureCollection. Out: rows of nodes and ways. Owns nothing. GeoJSON repeats coordinates in place of node ids: equal coordinates
(to 1e-7 degrees, OpenStreetMap's resolution) are one node, so a door's point lies on the walls that pass through it.
"""

from __future__ import annotations

from itertools import count
from typing import Any

from echostep_app.plan.importers.geojson import features, properties
from echostep_app.plan.importers.parsing import number, typed

RESOLUTION = 7  # decimals of a degree


class _Rows:
    """Rows collected so far; one node for each position."""

    def __init__(self) -> None:
        self.nodes: dict[tuple[float, float], dict[str, Any]] = {}
        self.ways: list[dict[str, Any]] = []
        self.more: list[dict[str, Any]] = []  # nodes at the place of another one, with tags of their own
        self._ids = count(1)

    def node(self, position: Any, where: str) -> dict[str, Any]:
        """The node at [longitude, latitude]."""
        pair = typed(position, f"{where}.coordinates", list)
        if len(pair) < 2:
            raise ValueError(f"{where}.coordinates: expected [longitude, latitude]")
        lon, lat = (
            round(number(value, f"{where}.coordinates", most, "degrees"), RESOLUTION)
            for value, most in zip(pair[:2], (180.0, 90.0), strict=True)
        )
        row = {"type": "node", "id": next(self._ids), "lon": lon, "lat": lat, "tags": {}}
        return self.nodes.setdefault((lon, lat), row)

    def point(self, position: Any, tags: dict[str, str], where: str) -> None:
        """A node with tags; copies of a storey have a node each at one place."""
        row = self.node(position, where)
        if not row["tags"]:
            row["tags"] = tags
        elif row["tags"] != tags:
            self.more.append({**row, "id": next(self._ids), "tags": tags, "same": row["id"]})

    def way(self, positions: Any, tags: dict[str, str], where: str) -> None:
        """A way through positions."""
        nodes = [self.node(position, where)["id"] for position in typed(positions, f"{where}.coordinates", list)]
        self.ways.append({"type": "way", "id": next(self._ids), "nodes": nodes, "tags": tags})


def geojson_rows(tree: Any) -> list[dict[str, Any]]:
    """Rows of all features; raises ValueError that names the feature."""
    rows = _Rows()
    for where, feature in features(tree):
        geometry = feature.get("geometry")
        if geometry is not None:
            _add(rows, typed(geometry, f"{where}.geometry", dict), _tags(feature, where), f"{where}.geometry")
    return [*rows.nodes.values(), *rows.more, *rows.ways]


def _add(rows: _Rows, geometry: dict[str, Any], tags: dict[str, str], where: str) -> None:
    nested = geometry.get("coordinates")
    match geometry.get("type"):
        case "Point":
            rows.point(nested, tags, where)
        case "LineString":
            rows.way(nested, tags, where)
        case "MultiLineString":
            for line in typed(nested, f"{where}.coordinates", list):
                rows.way(line, tags, where)
        case "Polygon":
            _polygon(rows, nested, tags, where)
        case "MultiPolygon":
            for polygon in typed(nested, f"{where}.coordinates", list):
                _polygon(rows, polygon, tags, where)
        case kind:
            raise ValueError(f"{where}: {str(kind)[:40]!r} is no type of geometry that OpenStreetMap exports")


def _polygon(rows: _Rows, rings: Any, tags: dict[str, str], where: str) -> None:
    """The outer ring with the tags; inner rings have the same walls, but no name."""
    for k, ring in enumerate(typed(rings, f"{where}.coordinates", list)):
        rows.way(ring, tags if k == 0 else without_names(tags), where)


def without_names(tags: dict[str, str]) -> dict[str, str]:
    """Tags of an inner ring: the tags of the room around it, without its name."""
    return {key: value for key, value in tags.items() if key not in ("name", "ref")}


def _tags(feature: dict[str, Any], where: str) -> dict[str, str]:
    """The tags of a feature: its properties, or its property "tags"; tags that begin with @ come from the exporter."""
    about = properties(feature, where)
    tags = typed(about["tags"], f"{where}.properties.tags", dict) if "tags" in about else about
    return {str(key): str(value) for key, value in tags.items() if not str(key).startswith("@") and value is not None}
