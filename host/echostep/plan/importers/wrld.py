"""Indoor maps of WRLD (`westport-house`): main.json, and one GeoJSON a floor -> `Plan`.

In: main.json or its folder. Out: `Plan`. Walls, windows and doors are areas; stairs and elevators become connectors where
floors show them at the same place. The format has no heights: the caller gives that of a storey.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

from shapely.geometry.base import BaseGeometry

from echostep.errors import EchostepError
from echostep.plan.georeference import EarthTransform
from echostep.plan.importers.geojson import features, label, properties, shape
from echostep.plan.importers.parsing import parse_json, read_text
from echostep.plan.importers.storey import Storey, Way, areas, opening, room
from echostep.plan.importers.walkways import connect, same_place
from echostep.plan.json_fields import number, text, typed
from echostep.plan.model import Door, Georeference, Plan

WAYS = {"stairs": "stairs", "elevator": "lift", "escalator": "stairs", "ramp": "ramp"}
OPEN_PLAN = {"room", "bathroom", "no_geometry", "hallway", "pathway"}  # areas without walls of their own


def import_wrld(path: Path, storey_m: float) -> Plan:
    """The building of a main.json; raises EchostepError that names file and feature."""
    tree = parse_json(read_text(path), str(path))
    try:
        tree = typed(tree, "the file", dict)
        georeference = _georeference(tree)
        floors = sorted(
            (
                _floor(row, f"levels[{i}]", path.parent)
                for i, row in enumerate(typed(tree.get("levels"), "levels", list))
            ),
            key=lambda floor: floor[0],
        )
        if not floors:
            raise ValueError("levels: a plan needs at least one level")
        name = text(tree.get("name", path.parent.name), "name")
    except ValueError as error:
        raise EchostepError(f"{path}: {error}") from error
    earth = EarthTransform(georeference)
    storeys = [_storey(file, floor_name, round(z * storey_m, 6), earth) for z, floor_name, file in floors]
    _open_floors(storeys)
    return Plan(name, tuple(storey.level() for storey in storeys), None, "", connect(storeys), georeference)


def _georeference(tree: dict[str, Any]) -> Georeference:
    where = "location.coordinates"
    at = typed(typed(tree.get("location"), "location", dict).get("coordinates"), where, list)
    if len(at) < 2:
        raise ValueError(f"{where}: expected [longitude, latitude]")
    return Georeference(number(at[0], where, 180.0, "degrees"), number(at[1], where, 90.0, "degrees"))


def _floor(row: Any, where: str, folder: Path) -> tuple[int, str, Path]:
    """Order, name and file of a floor; the file lies beside main.json."""
    row = typed(row, where, dict)
    name = text(row.get("readable_name", row.get("name")), f"{where}.name")
    file = text(row.get("filename"), f"{where}.filename")
    if Path(file).name != file or file in ("", "..") or "\x00" in file:
        raise ValueError(f"{where}.filename: {file[:60]!r} is not a file beside main.json")
    return int(number(row.get("z_order"), f"{where}.z_order", 1000, "floors")), name, folder / file


def _storey(file: Path, name: str, height_m: float, earth: EarthTransform) -> Storey:
    storey = Storey(name, height_m)
    tree = parse_json(read_text(file), str(file))
    try:
        for where, feature in features(tree):
            about = properties(feature, where)
            kind = text(about.get("type"), f"{where}.properties.type")
            _place(storey, kind, label(about.get("name"), f"{where}.properties.name"), shape(feature, where, earth))
    except ValueError as error:
        raise EchostepError(f"{file}: {error}") from error
    return storey


def _place(storey: Storey, kind: str, name: str, found: BaseGeometry) -> None:
    """One feature into the storey; what a plan does not know (outlines, landscaping) is left out."""
    for area in areas([found]):
        if kind == "wall":
            storey.walls.append(area)
        elif kind == "window":
            storey.windows.append(area)
        elif kind == "door":
            storey.doors.append(Door(opening(area), name=name))
        elif kind == "inaccessible_space":
            storey.filled.append(area)
        elif kind in WAYS:
            storey.ways.append(Way(WAYS[kind], name, area))  # type: ignore[arg-type]
        elif kind == "floor_opening":
            storey.openings.append(area)
        elif kind in OPEN_PLAN and (name or kind not in ("no_geometry", "pathway")):
            storey.rooms.append(room(name or kind.replace("_", " ").capitalize(), area))


def _open_floors(storeys: list[Storey]) -> None:
    """An opening over stairs is where they arrive; nobody walks over any other."""
    for below, storey in pairwise([Storey("", 0.0), *storeys]):
        for area in storey.openings:
            arrives = any(way.kind == "stairs" and same_place(way.area, area) for way in below.ways)
            if arrives:
                storey.ways.append(Way("stairs", "", area))
            else:
                storey.filled.append(area)
