# SPDX-License-Identifier: MIT
"""Indoor maps of WRLD (as `westport-house`): main.json and one GeoJSON file per level -> `Plan`.

In: main.json. Out: `Plan`. Owns nothing. Walls, windows and doors are areas; stairs and elevators become connectors where levels have them at the
same position. The format has no heights: the caller gives the height of a storey.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

from shapely.geometry.base import BaseGeometry

from echostep.errors import EchostepError
from echostep.plan.georeference import EarthTransform
from echostep.plan.importers.connector_shapes import join_connectors, same_place
from echostep.plan.importers.drawn_level import ConnectorShape, DrawnLevel, areas, opening, room
from echostep.plan.importers.geojson import features, label, properties, shape
from echostep.plan.importers.parsing import parse_json, read_text
from echostep.plan.importers.report import ImportReport
from echostep.plan.json_fields import number, text, typed
from echostep.plan.model import Door, Georeference, Plan

CONNECTOR_KINDS = {"stairs": "stairs", "elevator": "lift", "escalator": "stairs", "ramp": "ramp"}
OPEN_PLAN = {"room", "bathroom", "no_geometry", "hallway", "pathway"}  # areas without walls of their own


def import_wrld(path: Path, storey_height_m: float, report: ImportReport) -> Plan:
    """Import the building of a main.json; raises EchostepError that names the file and the feature."""
    tree = parse_json(read_text(path), str(path))
    try:
        tree = typed(tree, "the file", dict)
        georeference = _georeference(tree)
        levels = sorted(
            (
                _floor(row, f"levels[{i}]", path.parent)
                for i, row in enumerate(typed(tree.get("levels"), "levels", list))
            ),
            key=lambda level: level[0],
        )
        if not levels:
            raise ValueError("levels: a plan needs at least one level")
        name = text(tree.get("name", path.parent.name), "name")
    except ValueError as error:
        raise EchostepError(f"{path}: {error}") from error
    earth = EarthTransform(georeference)
    drawn_levels = [
        _level(file, DrawnLevel(level_name, round(z * storey_height_m, 6)), earth, report)
        for z, level_name, file in levels
    ]
    _open_levels(drawn_levels)
    return Plan(
        name, tuple(drawn.level() for drawn in drawn_levels), None, "", join_connectors(drawn_levels), georeference
    )


def _georeference(tree: dict[str, Any]) -> Georeference:
    where = "location.coordinates"
    at = typed(typed(tree.get("location"), "location", dict).get("coordinates"), where, list)
    if len(at) < 2:
        raise ValueError(f"{where}: expected [longitude, latitude]")
    return Georeference(number(at[0], where, 180.0, "degrees"), number(at[1], where, 90.0, "degrees"))


def _floor(row: Any, where: str, folder: Path) -> tuple[int, str, Path]:
    """Order, name and file of a level; the file must be in the folder of main.json."""
    row = typed(row, where, dict)
    name = text(row.get("readable_name", row.get("name")), f"{where}.name")
    file = text(row.get("filename"), f"{where}.filename")
    if Path(file).name != file or file in ("", "..") or "\x00" in file:
        raise ValueError(f"{where}.filename: {file[:60]!r} is not a file beside main.json")
    return int(number(row.get("z_order"), f"{where}.z_order", 1000, "floors")), name, folder / file


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
