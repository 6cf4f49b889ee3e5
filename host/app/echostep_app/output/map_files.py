# SPDX-License-Identifier: MIT
"""Tracks for maps: GeoPackage and GeoJSON for geographic information systems, KML, GPX for maps and outdoor programs.

In: a track on a georeferenced plan, of GeoJSON on any. Out: an SQLite file [OGC 12-128r19, GeoPackage 1.4], GeoJSON [RFC 7946], KML, GPX [Topografix,
GPX 1.1 schema], in longitude and latitude. Owns nothing. GPX has no heights: `ele` is metres above the sea, to which a plan's heights are not tied.
"""

from __future__ import annotations

import json
import math
import sqlite3
import struct
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from echostep.arrays import Floats
from echostep.file_mode import claim
from echostep.localization import Estimate
from echostep.plan import Plan
from echostep.walk.table import Columns, columns_of
from echostep_app.extras import require
from echostep_app.output.derived import outline95
from echostep_app.plan.georeference import earth_of
from echostep_app.printing.lines import moment

ELLIPSE_POINTS = 33
GAP_S = 5.0  # without an estimate, after which a new stretch of a track begins; assumed
KML, GPX = "http://www.opengis.net/kml/2.2", "http://www.topografix.com/GPX/1/1"
COLORS = {"tracking": "ffff8020", "uncertain": "ff20a0ff", "lost": "ff2020ff"}  # alpha, blue, green, red
APPLICATION_ID, USER_VERSION = 0x47504B47, 10400  # "GPKG", 1.4 [table 1]
WGS84 = 4326
_WGS84_WKT = (
    'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],'
    'PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433],AUTHORITY["EPSG","4326"]]'
)
_TABLES = f"""
PRAGMA application_id = {APPLICATION_ID};
PRAGMA user_version = {USER_VERSION};
CREATE TABLE gpkg_spatial_ref_sys (srs_name TEXT NOT NULL, srs_id INTEGER PRIMARY KEY, organization TEXT NOT NULL,
    organization_coordsys_id INTEGER NOT NULL, definition TEXT NOT NULL, description TEXT);
CREATE TABLE gpkg_contents (table_name TEXT NOT NULL PRIMARY KEY, data_type TEXT NOT NULL, identifier TEXT UNIQUE, description TEXT DEFAULT '',
    last_change DATETIME NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ','now')), min_x DOUBLE, min_y DOUBLE, max_x DOUBLE, max_y DOUBLE,
    srs_id INTEGER, CONSTRAINT fk_gc_r_srs_id FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys(srs_id));
CREATE TABLE gpkg_geometry_columns (table_name TEXT NOT NULL, column_name TEXT NOT NULL, geometry_type_name TEXT NOT NULL,
    srs_id INTEGER NOT NULL, z TINYINT NOT NULL, m TINYINT NOT NULL, CONSTRAINT pk_geom_cols PRIMARY KEY (table_name, column_name),
    CONSTRAINT fk_gc_tn FOREIGN KEY (table_name) REFERENCES gpkg_contents(table_name),
    CONSTRAINT fk_gc_srs FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys (srs_id));
INSERT INTO gpkg_spatial_ref_sys VALUES ('Undefined Cartesian', -1, 'NONE', -1, 'undefined', NULL);
INSERT INTO gpkg_spatial_ref_sys VALUES ('Undefined geographic', 0, 'NONE', 0, 'undefined', NULL);
INSERT INTO gpkg_spatial_ref_sys VALUES ('WGS 84', {WGS84}, 'EPSG', {WGS84}, '{_WGS84_WKT}', NULL);
"""


@dataclass(frozen=True, slots=True)
class TrackOnPlan:
    """The exported track; `moments`: time of day of each estimate, empty where it was not recorded."""

    estimates: list[Estimate]
    plan: Plan
    moments: list[str]

    @property
    def degrees(self) -> Floats:
        """Longitude and latitude of each estimate (n, 2), on a plan with a georeference."""
        return self.on_earth([(e.x_m, e.y_m) for e in self.estimates])

    def on_earth(self, places_m: Sequence[tuple[float, float]] | Floats) -> Floats:
        """Places on the plan (n, 2) as longitudes and latitudes."""
        earth = earth_of(self.plan)
        assert earth is not None
        return earth.degrees(np.asarray(places_m))

    @property
    def stretches(self) -> list[list[int]]:
        """Indices of the estimates in stretches in which each claims a place and none is more than GAP_S after the one before."""
        known = [k for k, e in enumerate(self.estimates) if e.claims_place]
        t_s = np.array([self.estimates[k].t_s for k in known])
        breaks = np.flatnonzero((np.diff(known) > 1) | (np.diff(t_s) > GAP_S)) + 1
        return [stretch.tolist() for stretch in np.split(np.array(known, dtype=int), breaks) if len(stretch)]


def flat(columns: Columns) -> Columns:
    """The same columns with tuples as text, for formats without lists."""
    return {
        name: [" ".join(map(str, v)) if isinstance(v, tuple) else v for v in column] for name, column in columns.items()
    }


def write_geopackage(out: Path, track: TrackOnPlan) -> None:
    """The estimates as points with all their columns, the track as lines; raises OSError or sqlite3.Error."""
    columns = flat(columns_of(track.estimates, track.plan))
    places = zip(columns.pop("longitude_deg"), columns.pop("latitude_deg"), strict=True)
    points = [None if x is None else np.array([[x, y]]) for x, y in places]
    kinds = {float: "REAL", int: "INTEGER", str: "TEXT"}
    named = [(name, kinds.get(type(values[0]), "TEXT")) for name, values in columns.items()]
    lines = [track.degrees[ks] for ks in track.stretches if len(ks) > 1]
    out.unlink(missing_ok=True)
    with closing(sqlite3.connect(claim(out))) as connection:
        connection.executescript(_TABLES)
        rows = zip(points, zip(*columns.values(), strict=True), strict=True)
        _add_layer(connection, "estimates", "POINT", named, list(rows))
        if lines:
            names = [(line, (track.plan.name,)) for line in lines]
            _add_layer(connection, "track", "LINESTRING", [("name", "TEXT")], names)
        connection.commit()


Row = tuple[Floats | None, tuple[Any, ...]]


def _add_layer(
    connection: sqlite3.Connection, layer: str, kind: str, columns: Sequence[tuple[str, str]], rows: Sequence[Row]
) -> None:
    """A table of features: `kind` is POINT or LINESTRING; `columns` are names with SQL types; a row: places (n, 2) or None, one value per column."""
    described = "".join(f", {name} {sql}" for name, sql in columns)
    connection.execute(f"CREATE TABLE {layer} (fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, geom {kind}{described})")
    known = [places for places, _ in rows if places is not None]
    every = np.concatenate(known) if known else np.zeros((0, 2))
    bounds = [*every.min(0).tolist(), *every.max(0).tolist()] if known else [None] * 4
    connection.execute(
        "INSERT INTO gpkg_contents (table_name, data_type, identifier, min_x, min_y, max_x, max_y, srs_id) VALUES (?, 'features', ?, ?, ?, ?, ?, ?)",
        (layer, layer, *bounds, WGS84),
    )
    connection.execute("INSERT INTO gpkg_geometry_columns VALUES (?, 'geom', ?, ?, 0, 0)", (layer, kind, WGS84))
    marks, names = ", ".join("?" * (1 + len(columns))), "".join(f", {name}" for name, _ in columns)
    connection.executemany(
        f"INSERT INTO {layer} (geom{names}) VALUES ({marks})",
        [(None if places is None else _blob(places, kind), *values) for places, values in rows],
    )


def _blob(places: Floats, kind: str) -> bytes:
    """A geometry as a GeoPackage blob: header without envelope [GeoPackage, 2.1.3], then well-known binary [OGC 06-103r4, 8.2]."""
    begin = struct.pack("<2sBBi", b"GP", 0, 1, WGS84)
    shape = struct.pack("<BI", 1, 1) if kind == "POINT" else struct.pack("<BII", 1, 2, len(places))
    return begin + shape + places.astype("<f8").tobytes()


def write_geojson(out: Path, track: TrackOnPlan) -> None:
    """The estimates as points with all their columns, the 95 % radius (m) and the time of day, and the stretches of the track as lines.

    Without a georeference places are in metres of the plan, and the file says so.
    """
    columns = flat(columns_of(track.estimates, track.plan))
    columns["radius95_m"] = [e.ellipse95.major_m for e in track.estimates]
    columns |= {"time": track.moments} if track.moments else {}
    local = {"coordinates": "metres of the plan, not longitude and latitude: it has no georeference"}
    places: list[list[float]] = [[e.x_m, e.y_m] for e in track.estimates]
    if track.plan.georeference is not None:
        require(str(out), "pyproj")
        local, places = {}, track.degrees.tolist()
    features = []
    for place, e, row in zip(places, track.estimates, zip(*columns.values(), strict=True), strict=True):
        finite = (None if isinstance(value, float) and not math.isfinite(value) else value for value in row)
        features.append(_feature("Point", place if e.claims_place else None, zip(columns, finite, strict=True)))
    for ks in track.stretches:
        if len(ks) > 1:
            told = {"name": track.plan.name, "t_s": [track.estimates[k].t_s for k in ks]}
            features.append(_feature("LineString", [places[k] for k in ks], told.items()))
    out.write_text(json.dumps({"type": "FeatureCollection", **local, "features": features}), encoding="utf-8")


def _feature(kind: str, places: Any, told: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    """A feature of GeoJSON; `places` None: one without a place."""
    geometry = None if places is None else {"type": kind, "coordinates": places}
    return {"type": "Feature", "geometry": geometry, "properties": dict(told)}


def write_kml(out: Path, track: TrackOnPlan) -> None:
    """The track as lines, each estimate that claims a place as a point with its 95 % ellipse."""
    estimates, degrees = track.estimates, track.degrees
    moments = track.moments or [moment(e.t_s) for e in estimates]
    root = _root(KML, "kml")
    document = _element(root, "Document")
    _element(document, "name", track.plan.name)
    if not track.moments:
        _element(document, "description", "No time of day was recorded: times count from 1970-01-01T00:00:00Z.")
    for status, color in COLORS.items():
        style = _element(document, "Style", id=status)
        line = _element(style, "LineStyle")
        _element(line, "color", color)
        _element(line, "width", "2")
        _element(_element(style, "PolyStyle"), "color", "40" + color[2:])
    line_mark = _element(document, "Placemark")
    _element(line_mark, "name", "track")
    span = _element(line_mark, "TimeSpan")
    _element(span, "begin", moments[0])
    _element(span, "end", moments[-1])
    _element(line_mark, "styleUrl", "#tracking")
    lines = _element(line_mark, "MultiGeometry")
    for ks in track.stretches:
        _element(_element(lines, "LineString"), "coordinates", _coordinates(degrees[ks]))
    folder = _element(document, "Folder")
    _element(folder, "name", "estimates")
    for k, e in enumerate(estimates):
        mark = _element(folder, "Placemark")
        _element(mark, "name", f"{e.t_s:.1f} s")
        placed = e.claims_place
        within = f"95 % within {e.ellipse95.major_m:.2f} m" if placed else "place not known"
        _element(mark, "description", f"step {e.step}, {e.status.value}, {within}")
        _element(_element(mark, "TimeStamp"), "when", moments[k])
        _element(mark, "styleUrl", f"#{e.status.value}")
        if not placed:
            continue
        geometry = _element(mark, "MultiGeometry")
        _element(_element(geometry, "Point"), "coordinates", _coordinates(degrees[k : k + 1]))
        ring = _element(_element(_element(geometry, "Polygon"), "outerBoundaryIs"), "LinearRing")
        _element(ring, "coordinates", _coordinates(track.on_earth(outline95(e, ELLIPSE_POINTS))))
    _save(root, out)


def write_gpx(out: Path, track: TrackOnPlan) -> None:
    """The track in its stretches, with the times of day where they are known."""
    root, degrees = _root(GPX, "gpx", version="1.1", creator="echostep"), track.degrees
    _element(_element(root, "metadata"), "name", track.plan.name)
    line = _element(root, "trk")
    _element(line, "name", track.plan.name)
    for ks in track.stretches:
        segment = _element(line, "trkseg")
        for k in ks:
            point = _element(segment, "trkpt", lat=f"{degrees[k, 1]:.9f}", lon=f"{degrees[k, 0]:.9f}")
            if track.moments:
                _element(point, "time", track.moments[k])
    _save(root, out)


def _root(space: str, name: str, **attributes: str) -> ET.Element:
    """The element in which a document of this namespace is."""
    ET.register_namespace("", space)
    return ET.Element(f"{{{space}}}{name}", attributes)


def _element(parent: ET.Element, name: str, text: str | None = None, **attributes: str) -> ET.Element:
    """A new element in another one, of the same namespace."""
    element = ET.SubElement(parent, f"{parent.tag.partition('}')[0]}}}{name}", attributes)
    element.text = text
    return element


def _save(root: ET.Element, out: Path) -> None:
    ET.indent(root)
    ET.ElementTree(root).write(out, encoding="utf-8", xml_declaration=True)


def _coordinates(degrees: Floats) -> str:
    """Longitudes and latitudes (n, 2) as KML coordinates."""
    return " ".join(f"{x:.9f},{y:.9f}" for x, y in degrees.tolist())
