# SPDX-License-Identifier: MIT
"""Writes points and lines as a GeoPackage, the exchange format of geographic information systems.

In: points and lines in longitude and latitude. Out: an SQLite file [OGC 12-128r19, GeoPackage 1.4]. Owns nothing.
"""

from __future__ import annotations

import sqlite3
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import shapely
from shapely.geometry.base import BaseGeometry

from echostep.file_mode import claim

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
class Layer:
    """A table of features: `kind` is POINT or LINESTRING; `columns` are names with SQL types; a row: a geometry or None, and one value per column."""

    name: str
    kind: str
    columns: Sequence[tuple[str, str]]
    rows: Sequence[tuple[BaseGeometry | None, tuple[float | int | str | None, ...]]]


def write_geopackage(path: Path, layers: Sequence[Layer]) -> None:
    """Write a new file; raises OSError or sqlite3.Error."""
    path.unlink(missing_ok=True)
    connection = sqlite3.connect(claim(path))
    try:
        connection.executescript(_TABLES)
        for layer in layers:
            _write(connection, layer)
        connection.commit()
    finally:
        connection.close()


def _write(connection: sqlite3.Connection, layer: Layer) -> None:
    columns = "".join(f", {name} {kind}" for name, kind in layer.columns)
    connection.execute(
        f"CREATE TABLE {layer.name} (fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, geom {layer.kind}{columns})"
    )
    known = [geometry for geometry, _ in layer.rows if geometry is not None]
    bounds = [float(v) for v in shapely.total_bounds(known)] if known else [None] * 4
    connection.execute(
        "INSERT INTO gpkg_contents (table_name, data_type, identifier, min_x, min_y, max_x, max_y, srs_id) VALUES (?, 'features', ?, ?, ?, ?, ?, ?)",
        (layer.name, layer.name, *bounds, WGS84),
    )
    connection.execute(
        "INSERT INTO gpkg_geometry_columns VALUES (?, 'geom', ?, ?, 0, 0)", (layer.name, layer.kind, WGS84)
    )
    marks = ", ".join("?" * (1 + len(layer.columns)))
    names = "".join(f", {name}" for name, _ in layer.columns)
    connection.executemany(
        f"INSERT INTO {layer.name} (geom{names}) VALUES ({marks})",
        [(None if geometry is None else _blob(geometry), *values) for geometry, values in layer.rows],
    )


def _blob(geometry: BaseGeometry) -> bytes:
    """A geometry as a GeoPackage blob: header without envelope, then well-known binary [GeoPackage, 2.1.3]."""
    return struct.pack("<2sBBi", b"GP", 0, 1, WGS84) + bytes(shapely.to_wkb(geometry, byte_order=1))
