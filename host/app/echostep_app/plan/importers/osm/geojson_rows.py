# SPDX-License-Identifier: MIT
"""GeoJSON of OpenStreetMap (overpass-turbo, osmtogeojson, ogr2ogr) -> elements in the form of Overpass JSON.

In: a parsed FeatureCollection. Out: rows of nodes, and of ways with the positions of their nodes. Owns nothing.
"""

from __future__ import annotations

import json
import re
from itertools import count
from typing import Any

from echostep_app.plan.importers.geojson import Place, features, geometries, properties
from echostep_app.plan.importers.parsing import typed

PAIR = re.compile(r'"((?:[^"\\]|\\.)*)"=>"((?:[^"\\]|\\.)*)"')  # of the field other_tags, as ogr2ogr writes it


def geojson_rows(tree: Any) -> list[dict[str, Any]]:
    """Rows of all features; raises ValueError that names the feature. Inner rings have the same walls, but no name."""
    ids, rows = count(1), []
    for where, feature in features(tree):
        tags = _tags(feature, where)
        for kind, nested, _ in geometries(feature, where):
            if kind == "Point":
                rows.append({"type": "node", "id": next(ids), "tags": tags} | _place(nested))
            rings = [ring if ring[0] == ring[-1] else [*ring, ring[0]] for ring in nested] if kind == "Polygon" else []
            for k, line in enumerate([nested] if kind == "LineString" else rings):
                own = tags if k == 0 else without_names(tags)
                rows.append({"type": "way", "id": next(ids), "tags": own, "geometry": list(map(_place, line))})
    return rows


def _place(position: Place) -> dict[str, float]:
    return {"lon": position[0], "lat": position[1]}


def without_names(tags: dict[str, str]) -> dict[str, str]:
    """Tags of an inner ring: the tags of the room around it, without its name."""
    return {key: value for key, value in tags.items() if key not in ("name", "ref")}


def _tags(feature: dict[str, Any], where: str) -> dict[str, str]:
    """The tags of a feature: its properties, or its property tags or other_tags, also as text; tags that begin with @ come from the exporter."""
    about = properties(feature, where)
    if isinstance(packed := about.get("other_tags"), str):
        about = about | dict(PAIR.findall(packed))
    tags = about.get("tags", about)
    if isinstance(tags, str):
        try:
            tags = json.loads(tags)
        except (ValueError, RecursionError) as error:
            raise ValueError(f"{where}.properties.tags: not JSON: {error}") from error
    tags = typed(tags, f"{where}.properties.tags", dict)
    return {  # a list, as of levels, as OpenStreetMap separates its values
        str(key): ";".join(map(str, value)) if isinstance(value, list) else str(value)
        for key, value in tags.items()
        if not str(key).startswith("@") and value is not None
    }
