# SPDX-License-Identifier: MIT
"""Indoor maps of WRLD (as `westport-house`): main.json and one GeoJSON file per level -> `Plan`.

In: main.json. Out: `Plan`. Owns nothing. Walls, windows and doors are areas; stairs and elevators become connectors where levels have them at the
same position. The format has no heights: the caller gives the height of a storey.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Annotated

from msgspec import Meta, Struct
from shapely.geometry.base import BaseGeometry

from echostep.errors import EchostepError
from echostep.fields import Longitude, Text, checked
from echostep.plan import Door, Georeference, Plan
from echostep_app.plan.georeference import EarthTransform
from echostep_app.plan.importers.connector_shapes import plan_of, same_place
from echostep_app.plan.importers.drawn_level import ConnectorShape, DrawnLevel, areas, opening, room
from echostep_app.plan.importers.geojson import features, label, properties, shape
from echostep_app.plan.importers.parsing import beside, parse_json, read_text, text
from echostep_app.plan.importers.report import ImportReport

CONNECTOR_KINDS = {"stairs": "stairs", "elevator": "lift", "escalator": "stairs", "ramp": "ramp"}
OPEN_PLAN = {"room", "bathroom", "no_geometry", "hallway", "pathway"}  # areas without walls of their own


class LocationFields(Struct):
    """Where the building stands, as a point of GeoJSON."""

    coordinates: Annotated[list[Longitude], Meta(min_length=2, description="[longitude, latitude] in degrees")]

    def __post_init__(self) -> None:
        if not abs(self.coordinates[1]) <= 90.0:
            raise ValueError("location.coordinates: a latitude beyond 90 degrees")


class FloorFields(Struct):
    """One level and its file."""

    filename: Text
    z_order: Annotated[float, Meta(ge=-1000, le=1000, description="a finite number within 1000 floors")]
    name: Text = ""
    readable_name: Text = ""


class BuildingFields(Struct):
    """The fields that are read from main.json."""

    location: LocationFields
    levels: Annotated[list[FloorFields], Meta(min_length=1, description="a list of at least one level")]
    name: Text = ""


def import_wrld(path: Path, storey_m: float, report: ImportReport) -> Plan:
    """Import the building of a main.json; raises EchostepError that names the file and the feature."""
    try:
        building = checked(parse_json(read_text(path), str(path)), BuildingFields)
        files = [beside(path, row.filename, f"levels[{i}].filename") for i, row in enumerate(building.levels)]
    except ValueError as error:
        raise EchostepError(f"{path}: {error}") from error
    longitude, latitude = building.location.coordinates[:2]
    georeference = Georeference(longitude, latitude)
    earth = EarthTransform(georeference)
    drawn_levels = [
        _level(file, DrawnLevel(row.readable_name or row.name, round(int(row.z_order) * storey_m, 6)), earth, report)
        for row, file in sorted(zip(building.levels, files, strict=True), key=lambda pair: pair[0].z_order)
    ]
    _open_levels(drawn_levels)
    return plan_of(building.name or path.parent.name, drawn_levels, report, georeference)


def _level(file: Path, drawn: DrawnLevel, earth: EarthTransform, report: ImportReport) -> DrawnLevel:
    tree = parse_json(read_text(file), str(file))
    try:
        for where, feature in features(tree):
            about = properties(feature, where)
            kind = text(about.get("type"), f"{where}.properties.type")
            name = label(about.get("name"), f"{where}.properties.name")
            if not _place(drawn, kind, name, shape(feature, where, earth)):
                report.leave_out(kind[:40])
    except ValueError as error:
        raise EchostepError(f"{file}: {error}") from error
    return drawn


def _place(drawn: DrawnLevel, kind: str, name: str, shape: BaseGeometry) -> bool:
    """Add a feature to a level; False for kinds that plans do not have (outlines, landscaping) and for shapes without an area."""
    found = areas([shape])
    for area in found:
        if kind == "wall":
            drawn.walls.append(area)
        elif kind == "window":
            drawn.windows.append(area)
        elif kind == "door":
            drawn.doors.append(Door(opening(area), name=name))
        elif kind == "inaccessible_space":
            drawn.filled.append(area)
        elif kind in CONNECTOR_KINDS:
            drawn.connectors.append(ConnectorShape(CONNECTOR_KINDS[kind], name, area))  # type: ignore[arg-type]
        elif kind == "floor_opening":
            drawn.openings.append(area)
        elif kind in OPEN_PLAN and (name or kind not in ("no_geometry", "pathway")):
            drawn.rooms.append(room(name or kind.replace("_", " ").capitalize(), area))
        else:
            return False
    return bool(found)


def _open_levels(drawn_levels: list[DrawnLevel]) -> None:
    """An opening in the floor above stairs is their upper end; any other opening cannot be walked on."""
    for below, drawn in pairwise([DrawnLevel("", 0.0), *drawn_levels]):
        for area in drawn.openings:
            arrives = any(way.kind == "stairs" and same_place(way.area, area) for way in below.connectors)
            if arrives:
                drawn.connectors.append(ConnectorShape("stairs", "", area))
            else:
                drawn.filled.append(area)
