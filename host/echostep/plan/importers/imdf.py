"""Indoor Mapping Data Format (zip or folder) -> `Plan`.

In: an archive [OGC 20-094]. Out: `Plan`. IMDF draws no walls: the boundaries of enclosed units are taken as walls, open at the `opening`s; units
of brick, concrete or glass are walls with a thickness. Walkways and unenclosed areas have no walls of their own, nor have stairs, lifts and ramps
without an opening. Storeys are `storey_m` apart, by their ordinals.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from echostep.errors import EchostepError
from echostep.plan.georeference import EarthTransform
from echostep.plan.importers.archive import Archive
from echostep.plan.importers.geojson import features, label, properties, shape
from echostep.plan.importers.parsing import parse_json
from echostep.plan.importers.storey import Storey, Way, areas, pieces, room
from echostep.plan.importers.walkways import connect
from echostep.plan.json_fields import number, text, typed
from echostep.plan.model import ConnectorKind, Door, DoorState, Georeference, Plan

OPEN = {
    "walkway",
    "walkway.island",
    "unenclosedarea",
    "platform",
    "road",
    "footbridge",
    "movingwalkway",
    "lobby",
    "waitingroom",
    "terrace",
}
FILLED = {"structure", "column", "opentobelow", "brick", "concrete", "drywall", "wood", "glass"}
WAYS: dict[str, ConnectorKind] = {
    "stairs": "stairs",
    "steps": "stairs",
    "escalator": "stairs",
    "elevator": "lift",
    "ramp": "ramp",
}
SOLID_FIXTURES = {
    "wall",
    "obstruction",
    "equipment",
    "desk",
    "furniture",
    "baggagecarousel",
    "waterfeature",
    "vegetation",
}
ON_M = 0.2  # an opening lies so near to the boundary that it opens


@dataclass(frozen=True, slots=True)
class Feature:
    """A feature with its place in the archive."""

    where: str
    key: str
    about: dict[str, Any]
    shape: BaseGeometry

    @property
    def category(self) -> str:
        """Its category, "" without one."""
        return text(self.about.get("category") or "", f"{self.where}.properties.category")

    @property
    def level(self) -> str:
        """The id of its level."""
        return text(self.about.get("level_id"), f"{self.where}.properties.level_id")

    @property
    def name(self) -> str:
        """Its name, else its other name."""
        return (
            label(self.about.get("name"), f"{self.where}.properties.name")
            or label(self.about.get("alt_name"), self.where)
        )[:80]


def import_imdf(path: Path, storey_m: float) -> Plan:
    """The venue of an archive; raises EchostepError that names the file in it and the feature."""
    with Archive(path) as archive:
        if not archive.has("manifest.json"):
            raise EchostepError(f"{path}: no manifest.json: is this an IMDF archive?")
        return _venue(archive, path, storey_m)


def _venue(archive: Archive, path: Path, storey_m: float) -> Plan:
    georeference = _origin(archive)
    earth = EarthTransform(georeference)
    levels = sorted(_features(archive, "level", earth), key=_ordinal)
    if not levels:
        raise EchostepError(f"{path}: level.geojson: no levels")
    storeys = {
        level.key: Storey(level.name or f"level {_ordinal(level):g}", round(_ordinal(level) * storey_m, 6))
        for level in levels
    }
    openings = _by_level(_features(archive, "opening", earth), storeys)
    units = _by_level(_features(archive, "unit", earth), storeys)
    order = list(storeys)
    for key, storey in storeys.items():
        storey.doors = [door for one in openings[key] for door in _doors(one)]
        _outline(storey, next(level for level in levels if level.key == key))
        for unit in units[key]:
            _unit(storey, unit, [one.shape for one in openings[key]])
    fixtures = _by_level(_features(archive, "fixture", earth) + _features(archive, "kiosk", earth), storeys)
    for key, storey in storeys.items():
        for fixture in fixtures[key]:
            if "kiosk" in fixture.where or fixture.category in SOLID_FIXTURES:
                storey.obstacles += areas([fixture.shape])
    _relationships(
        archive,
        earth,
        {unit.key: (order.index(key), unit) for key in order for unit in units[key]},
        list(storeys.values()),
    )
    name = next((venue.name for venue in _features(archive, "venue", earth)), "") or path.stem
    return Plan(
        name, tuple(s.level() for s in storeys.values()), None, "", connect(list(storeys.values())), georeference
    )


def _origin(archive: Archive) -> Georeference:
    """The first corner of the first level, to a hundred thousandth of a degree."""
    name = "level.geojson"
    tree = parse_json(archive.text(name), archive.place(name))
    found: Any = tree
    try:
        for where, feature in features(tree):
            found = typed(feature.get("geometry"), f"{where}.geometry", dict).get("coordinates")
            while isinstance(found, list) and found and isinstance(found[0], list):
                found = found[0]
            if not isinstance(found, list) or len(found) < 2:
                raise ValueError(f"{where}.geometry: no coordinates")
            lon, lat = number(found[0], where, 180.0, "degrees"), number(found[1], where, 90.0, "degrees")
            return Georeference(round(lon, 5), round(lat, 5))
    except ValueError as error:
        raise EchostepError(f"{archive.place(name)}: {error}") from error
    raise EchostepError(f"{archive.place(name)}: no levels")


def _features(archive: Archive, kind: str, earth: EarthTransform) -> list[Feature]:
    """All features of a kind; none when the archive has no such file."""
    name = f"{kind}.geojson"
    if not archive.has(name):
        return []
    found = []
    try:
        for where, feature in features(parse_json(archive.text(name), archive.place(name))):
            place = f"{kind} {where}"
            found.append(
                Feature(
                    place,
                    text(feature.get("id"), f"{where}.id"),
                    properties(feature, where),
                    shape(feature, where, earth),
                )
            )
            _ = found[-1].category, found[-1].name
    except ValueError as error:
        raise EchostepError(f"{archive.place(name)}: {error}") from error
    return found


def _ordinal(level: Feature) -> float:
    try:
        return number(level.about.get("ordinal"), f"{level.where}.properties.ordinal", 500.0, "storeys")
    except ValueError as error:
        raise EchostepError(f"level.geojson: {error}") from error


def _by_level(found: list[Feature], storeys: dict[str, Storey]) -> dict[str, list[Feature]]:
    """Features of each level; those of unknown levels are mistakes."""
    sorted_: dict[str, list[Feature]] = {key: [] for key in storeys}
    for feature in found:
        try:
            sorted_[feature.level].append(feature)
        except KeyError as error:
            raise EchostepError(f"{feature.where}: there is no level {feature.level[:50]!r}") from error
        except ValueError as error:
            raise EchostepError(str(error)) from error
    return sorted_


def _doors(one: Feature) -> list[Door]:
    """An opening as a door from its first to its last point; one without a door leaf stands open."""
    about = one.about.get("door")
    state: DoorState = "unknown" if isinstance(about, dict) and about.get("type") not in (None, "open") else "open"
    found = []
    for line in pieces([one.shape]):
        if isinstance(line, LineString) and line.length > 0.1:
            (x0, y0), (x1, y1) = line.coords[0][:2], line.coords[-1][:2]
            if (round(x0, 3), round(y0, 3)) != (round(x1, 3), round(y1, 3)):
                found.append(Door((round(x0, 3), round(y0, 3), round(x1, 3), round(y1, 3)), state, one.name))
    return found


def _outline(storey: Storey, level: Feature) -> None:
    """Where the floor ends there is a wall, unless the level is outdoors."""
    if level.about.get("outdoor") is not True:
        storey.walls += [area.boundary for area in areas([level.shape])]


def _unit(storey: Storey, unit: Feature, openings: list[BaseGeometry]) -> None:
    kind = unit.category
    for area in areas([unit.shape]):
        if kind in FILLED:
            (storey.windows if kind == "glass" else storey.filled).append(area)
            continue
        way = next((WAYS[word] for word in (kind, kind.split(".")[0]) if word in WAYS), None)
        opened = any(_opens(area, one) for one in openings)
        if kind not in OPEN and (way is None or opened):
            storey.walls.append(area.boundary)
        if way is not None:
            storey.ways.append(Way(way, unit.name, area))
        elif unit.name or (kind not in OPEN and kind != "unspecified"):
            storey.rooms.append(room(unit.name or kind, area))


def _opens(area: Polygon, one: BaseGeometry) -> bool:
    if one.is_empty:
        return False
    middle = Point(np.asarray(shapely.get_coordinates(one)).mean(axis=0))
    return bool(area.boundary.distance(middle) < ON_M)


def _relationships(
    archive: Archive, earth: EarthTransform, units: dict[str, tuple[int, Feature]], storeys: list[Storey]
) -> None:
    """Stairs and lifts that lead to places which do not lie over each other."""
    for one in _features(archive, "relationship", earth):
        if one.category not in WAYS:
            continue
        between = one.about.get("intermediary")
        ends = [one.about.get("origin"), one.about.get("destination"), *(between if isinstance(between, list) else [])]
        keys = [str(end.get("id")) for end in ends if isinstance(end, dict)]
        found = sorted({units[key][0] for key in keys if key in units})
        for key in keys:
            if key in units and len(found) > 1:
                i, unit = units[key]
                for way in storeys[i].ways:
                    if any(way.area.equals(area) for area in areas([unit.shape])):
                        way.levels = tuple(found)
