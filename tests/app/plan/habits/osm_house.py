# SPDX-License-Identifier: MIT
"""The house as OpenStreetMap: rows as in the JSON of Overpass, and these as XML, JSON or GeoJSON."""

from __future__ import annotations

import json
from copy import deepcopy
from itertools import count
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

from plan.drawings.drawn_houses import corners
from plan.habits.house import ENTRANCE, HIGH, INNER, PARTITION, STAIRS, STOREYS, WIDE, Move, Point, middle

Row = dict[str, Any]


def house(move: Move, *, sign: int = 1, entrance: str = "door", level: dict[str, Any] | None = None) -> list[Row]:
    """Storeys as copies with nodes of their own at equal places; with `level`, one storey with these tags."""
    rows: list[Row] = []
    ids = (sign * k for k in count(1))
    at: dict[tuple[int, float, float], Row] = {}

    def node(storey: int, x: float, y: float, **tags: Any) -> int:
        if (storey, x, y) not in at:
            lon, lat = move.degrees(x, y)
            at[storey, x, y] = {"type": "node", "id": next(ids), "lon": lon, "lat": lat, "tags": {}}
            rows.append(at[storey, x, y])
        at[storey, x, y]["tags"] |= tags
        return int(at[storey, x, y]["id"])

    def way(storey: int, points: list[Point], **tags: str) -> None:
        nodes = [node(storey, *point) for point in (*points, points[0])]
        rows.append({"type": "way", "id": next(ids), "nodes": nodes, "tags": tags})

    door, way_in = middle(INNER), middle(ENTRANCE)
    for k in STOREYS if level is None else (0,):
        on: dict[str, Any] = level or {"level": str(k)}
        way(k, [(0, 0), (PARTITION, 0), door, (PARTITION, HIGH), (0, HIGH)], indoor="room", name="Office", **on)
        south = [(PARTITION, 0), way_in] if k == 0 else [(PARTITION, 0)]
        way(k, [*south, (WIDE, 0), (WIDE, HIGH), (PARTITION, HIGH), door], indoor="room", name="Hall", **on)
        node(k, *door, door="hinged", **on)
        if k == 0:
            about: dict[str, Any] = {entrance: "yes", "level": "0"}
            node(k, *way_in, **about)
        way(k + 9, corners(STAIRS), indoor="area", highway="steps", **on)
    return rows


def places(rows: list[Row], nodes: list[int]) -> list[dict[str, float]]:
    """The positions that `out geom;` writes."""
    at = {row["id"]: {"lon": row["lon"], "lat": row["lat"]} for row in rows if row["type"] == "node"}
    return [at[node] for node in nodes]


def with_geometry(rows: list[Row], *, ids: bool = True) -> list[Row]:
    """As `out geom;`: ways with the positions of their nodes, nodes only where tagged; or without the ids of nodes."""
    left = [row | {"geometry": places(rows, row["nodes"])} if row["type"] == "way" else row for row in rows]
    return [
        {k: v for k, v in row.items() if ids or k != "nodes"} for row in left if row["type"] != "node" or row["tags"]
    ]


def relations(rows: list[Row], *, geometry: bool = False) -> list[Row]:
    """Rooms as multipolygons of two ways each, one of them against the other's direction, and a member that the file lacks."""
    made: list[Row] = []
    for row in rows:
        if "name" not in row["tags"]:
            made.append(row)
            continue
        half, key = len(row["nodes"]) // 2, 1000 * abs(row["id"])
        parts = (row["nodes"][: half + 1], row["nodes"][half:][::-1])
        ways: list[Row] = [{"type": "way", "id": key + i, "nodes": part, "tags": {}} for i, part in enumerate(parts)]
        members: list[Row] = [{"type": "way", "ref": way["id"], "role": "outer"} for way in ways]
        if geometry:
            members = [m | {"geometry": places(rows, w["nodes"])} for m, w in zip(members, ways, strict=True)]
        made += [] if geometry else ways
        members.append({"type": "way", "ref": 7, "role": "outer"})
        made.append(
            {"type": "relation", "id": key, "tags": {"type": "multipolygon", **row["tags"]}, "members": members}
        )
    return with_geometry(made) if geometry else made


def changed(rows: list[Row], **tags: Any) -> list[Row]:
    """The rows with other tags; None takes one away. Callables make the value from the old one."""
    rows = deepcopy(rows)
    for row in rows:
        for key in tags.keys() & row["tags"].keys():
            row["tags"][key] = tags[key](row["tags"][key]) if callable(tags[key]) else tags[key]
        row["tags"] = {key: value for key, value in row["tags"].items() if value is not None}
    return rows


def tagged(rows: list[Row], **tags: str) -> list[Row]:
    """The rows, doors with more tags."""
    return [row | {"tags": row["tags"] | tags} if {"door", "entrance"} & row["tags"].keys() else row for row in rows]


def as_json(rows: list[Row], move: Move) -> str:
    return json.dumps({"version": 0.6, "elements": move.ordered(rows)})


def as_xml(rows: list[Row], move: Move) -> str:
    def element(name: str, inner: str = "", **attributes: Any) -> str:
        return f"<{name} {' '.join(f'{key}={quoteattr(str(value).lower())}' for key, value in attributes.items())}>{inner}</{name}>"

    def xml(row: Row) -> str:
        refs = [{"ref": node} for node in row.get("nodes", [])] or [{}] * len(row.get("geometry", []))
        nds = [element("nd", **ref, **at) for ref, at in zip(refs, row.get("geometry", [{}] * len(refs)), strict=True)]
        members = [
            element(
                "member",
                "".join(element("nd", **at) for at in m.get("geometry", [])),
                type=m["type"],
                ref=m["ref"],
                role=m["role"],
            )
            for m in row.get("members", [])
        ]
        tags = [f"<tag k={quoteattr(key)} v={quoteattr(value)}/>" for key, value in row["tags"].items()]
        own = {key: row[key] for key in ("id", "lon", "lat", "visible", "action") if key in row}
        return element(row["type"], "".join([*nds, *members, *tags]), **own)

    return f'<osm version="0.6">{"".join(map(xml, move.ordered(rows)))}</osm>'


def as_geojson(rows: list[Row], move: Move, pack: Any = None) -> str:
    """`pack` alters each feature."""
    features = []
    for row in rows:
        if row["type"] == "way" or row["tags"]:
            nodes = row["nodes"] if row["type"] == "way" else [row["id"]]
            line = [[at["lon"], at["lat"]] for at in places(rows, nodes)]
            kind, nested = ("Polygon", [line]) if len(line) > 1 else ("Point", line[0])
            features.append(
                {"type": "Feature", "properties": row["tags"], "geometry": {"type": kind, "coordinates": nested}}
            )
    return json.dumps(
        {"type": "FeatureCollection", "features": move.ordered([pack(f) if pack else f for f in features])}
    )


WRITERS = {"osm": as_xml, "json": as_json, "geojson": as_geojson}


def write(folder: Path, kind: str, rows: list[Row], move: Move) -> Path:
    """A file of these rows."""
    path = folder / f"house.{kind}"
    path.write_text(WRITERS[kind](rows, move))
    return path
