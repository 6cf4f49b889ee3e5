# SPDX-License-Identifier: MIT
"""Indoor Mapping Data Format (zip or folder) -> `Plan`.

In: an archive [OGC 20-094]. Out: `Plan`. Owns nothing. IMDF has no walls: the boundaries of enclosed units become walls, with gaps at the `opening`s;
units of brick, concrete or glass become walls with a thickness. Walkways and unenclosed areas get no walls, nor do stairs, lifts and ramps without an
opening. Levels are `storey_height_m` apart, by their ordinals. Files end in .geojson or .json. With `doors_m`, openings drawn as points and rooms
without an opening get doors of this width.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from echostep.errors import EchostepError
from echostep.plan import ConnectorKind, Door, DoorState, Georeference, Plan
from echostep_app.plan.georeference import EarthTransform
from echostep_app.plan.importers.connector_shapes import plan_of
from echostep_app.plan.importers.drawn_level import ConnectorShape, DrawnLevel, areas, pieces, room
from echostep_app.plan.importers.geojson import features, geometries, label, properties, shape
from echostep_app.plan.importers.imdf.archive import Archive
from echostep_app.plan.importers.imdf.assumed_doors import ASSUMED, ONE_LINE_M, THICKEST_M, doors_at, doors_of_rooms
from echostep_app.plan.importers.parsing import number, parse_json, text
from echostep_app.plan.importers.report import ImportReport
from echostep_app.plan.importers.straight import pieces_of
from echostep_app.printing.lines import faults_of

OPEN = {
    "walkway", "walkway.island", "unenclosedarea", "platform", "road", "footbridge", "movingwalkway", "lobby", "waitingroom",
    "terrace",
}  # fmt: skip
FILLED = {"structure", "column", "opentobelow", "brick", "concrete", "drywall", "wood", "glass"}
CONNECTOR_KINDS: dict[str, ConnectorKind] = {
    "stairs": "stairs", "steps": "stairs", "escalator": "stairs", "elevator": "lift", "ramp": "ramp",
}  # fmt: skip
SOLID_FIXTURES = {
    "wall", "obstruction", "equipment", "desk", "furniture", "baggagecarousel", "waterfeature", "vegetation",
}  # fmt: skip
UNUSED = ("address", "amenity", "anchor", "building", "detail", "footprint", "geofence", "occupant", "section")
ALONG = 0.9  # cosine of the angle up to which an opening runs along its wall; assumed
ON_M = 0.2  # greatest distance of an opening from the boundary that it opens; assumed
Line = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Feature:
    """A feature with its path in the archive (`where`), its id (`key`), its properties and its shape."""

    where: str
    key: str
    about: dict[str, Any]
    shape: BaseGeometry

    @property
    def category(self) -> str:
        """Its category in small letters; "" without one."""
        return text(self.about.get("category") or "", f"{self.where}.properties.category").casefold()

    @property
    def level(self) -> str:
        """The id of its level; "" without one."""
        return label(self.about.get("level_id"), f"{self.where}.properties.level_id")

    @property
    def name(self) -> str:
        """Its name, else its other name."""
        return (
            label(self.about.get("name"), f"{self.where}.properties.name")
            or label(self.about.get("alt_name"), self.where)
        )[:80]


def import_imdf(path: Path, storey_height_m: float, doors_m: float | None, report: ImportReport) -> Plan:
    """Import the venue of an archive; raises EchostepError that names the file in it and the feature."""
    with Archive(path) as archive:
        if not archive.has(_file(archive, "level")):
            raise EchostepError(
                f"{path}: no level.geojson in it: IMDF is a folder or zip of level.geojson, unit.geojson"
            )
        if not archive.has("manifest.json"):
            report.doubt("no manifest.json: read as IMDF by the names of its files")
        plan = _venue(archive, path, storey_height_m, doors_m, report)
        _tell(archive, plan, report)
        return plan


def _tell(archive: Archive, plan: Plan, report: ImportReport) -> None:
    """Report kinds of features that plans do not have, doors that were assumed, and the remedy for rooms without doors."""
    report.doors_remedy = "--doors 0.9 assumes doors 0.9 m wide, echostep plan edit draws them"
    for kind in UNUSED:
        if archive.has(name := _file(archive, kind)):
            report.leave_out(kind, archive.text(name).count('"Feature"'))
    assumed = sum(door.name == ASSUMED for level in plan.levels for door in level.doors)
    if assumed:
        report.doubt(f"{assumed} doors are assumed, named {ASSUMED!r}: compare them with the building")


def _venue(archive: Archive, path: Path, storey_height_m: float, doors_m: float | None, report: ImportReport) -> Plan:
    georeference = _origin(archive)
    earth = EarthTransform(georeference)
    levels = sorted(_features(archive, "level", earth), key=_ordinal)
    if not levels:
        raise EchostepError(f"{path}: {_file(archive, 'level')}: it has no levels: export the archive with its levels")
    drawn_levels = {
        level.key: DrawnLevel(level.name or f"level {_ordinal(level):g}", round(_ordinal(level) * storey_height_m, 6))
        for level in levels
    }
    openings = _by_level(_features(archive, "opening", earth), drawn_levels, report)
    units = _by_level(_features(archive, "unit", earth), drawn_levels, report)
    if not any(units.values()):
        raise EchostepError(f"{path}: {_file(archive, 'unit')}: no units on these levels: export all files again")
    for key, drawn in drawn_levels.items():
        if doors_m is None:
            report.leave_out(
                "opening without a width (--doors 0.9 gives one)", sum(not _doors(one) for one in openings[key])
            )
        inside = [one.shape for one in levels if one.key == key and one.about.get("outdoor") is not True]
        drawn.walls += [area.boundary for area in areas(inside)]
        for unit in units[key]:
            _unit(drawn, unit, [one.shape for one in openings[key]])
        _place_doors(drawn, openings[key], report)
        report.leave_out("unit without an area", sum(not areas([unit.shape]) for unit in units[key]))
        if doors_m is not None:
            _assume_doors(drawn, units[key], openings[key], doors_m)
    fixed = _by_level(_features(archive, "fixture", earth) + _features(archive, "kiosk", earth), drawn_levels, report)
    for key, drawn in drawn_levels.items():
        for fixture in fixed[key]:
            if "kiosk" in fixture.where or fixture.category in SOLID_FIXTURES:
                drawn.obstacles += areas([fixture.shape])
                report.leave_out("fixture or kiosk without an area", not areas([fixture.shape]))
            else:
                report.leave_out(f"fixture {fixture.category}")
    numbered = {unit.key: (k, unit) for k, key in enumerate(drawn_levels) for unit in units[key]}
    _relationships(archive, earth, numbered, list(drawn_levels.values()), report)
    name = next((venue.name for venue in _features(archive, "venue", earth)), "") or path.stem
    return plan_of(name, list(drawn_levels.values()), report, georeference)


def _file(archive: Archive, kind: str) -> str:
    """The file of a kind of feature: .geojson as the standard names it, or .json."""
    return f"{kind}.json" if archive.has(f"{kind}.json") and not archive.has(f"{kind}.geojson") else f"{kind}.geojson"


def _origin(archive: Archive) -> Georeference:
    """The plan's origin: the first corner of the first level, rounded to 1e-5 degrees (about 1 m)."""
    name = _file(archive, "level")
    tree = parse_json(archive.text(name), archive.label(name))
    with faults_of(archive.label(name)):
        for where, feature in features(tree):
            for _, place, _ in geometries(feature, where):
                while isinstance(place, list) and place:
                    place = place[0]
                if isinstance(place, tuple):
                    return Georeference(round(place[0], 5), round(place[1], 5))
    raise EchostepError(f"{archive.label(name)}: it has no levels with a place: export the archive with its levels")


def _features(archive: Archive, kind: str, earth: EarthTransform) -> list[Feature]:
    """All features of a kind; an empty list when the archive has no file of this kind."""
    name = _file(archive, kind)
    if not archive.has(name):
        return []
    read = []
    with faults_of(archive.label(name)):
        for where, feature in features(parse_json(archive.text(name), archive.label(name))):
            place = f"{kind} {where}"
            about = properties(feature, where)
            key = label(feature.get("id", about.get("id")), f"{where}.id") or place
            read.append(Feature(place, key, about, shape(feature, where, earth)))
            _ = read[-1].category, read[-1].name, read[-1].level
    return read


def _ordinal(level: Feature) -> float:
    with faults_of("level.geojson"):
        return number(level.about.get("ordinal"), f"{level.where}.properties.ordinal", 500.0, "storeys")


def _by_level(features: list[Feature], levels: dict[str, DrawnLevel], report: ImportReport) -> dict[str, list[Feature]]:
    """Features by the id of their level; those of another export, whose level the archive lacks, are left out and reported."""
    sorted_: dict[str, list[Feature]] = {key: [] for key in levels}
    lost: Counter[str] = Counter()
    for feature in features:
        if feature.level in sorted_:
            sorted_[feature.level].append(feature)
        else:
            lost[feature.where.partition(" ")[0]] += 1
    for kind, count in lost.items():
        report.leave_out(f"{kind} of a level that level.geojson lacks", count)
        report.doubt(
            f"{kind}.geojson: {count} of {len(features)} are of levels that level.geojson lacks and were left out: export all files again"
        )
    return sorted_


def _doors(one: Feature) -> list[Door]:
    """An opening as a door from its first to its last point; without a door leaf its state is open."""
    about = one.about.get("door")
    state: DoorState = "unknown" if isinstance(about, dict) and about.get("type") not in (None, "open") else "open"
    doors = []
    for line in pieces([one.shape]):
        if isinstance(line, LineString) and line.length > 0.1:
            (x0, y0), (x1, y1) = line.coords[0][:2], line.coords[-1][:2]
            if (round(x0, 3), round(y0, 3)) != (round(x1, 3), round(y1, 3)):
                doors.append(Door((round(x0, 3), round(y0, 3), round(x1, 3), round(y1, 3)), state, one.name))
    return doors


def _place_doors(drawn: DrawnLevel, openings: list[Feature], report: ImportReport) -> None:
    """Add the doors of openings, each on the nearest wall and on that wall's other face; those in no wall keep their place, and are reported."""
    walls = pieces([*drawn.walls, *(area.exterior for area in drawn.filled)])
    tree, astray = shapely.STRtree(walls), 0
    for door in (door for one in openings for door in _doors(one)):
        middle = LineString((door.line[:2], door.line[2:])).centroid
        around = [walls[k] for k in tree.query(middle, predicate="dwithin", distance=THICKEST_M)]
        near = sorted(around, key=middle.distance)[:2]  # behind these is another room
        is_near = bool(near) and near[0].distance(middle) < ON_M
        astray += not is_near
        own, *others = [_onto(door.line, wall, middle) for wall in near if is_near] or [door.line]
        apart = [LineString((own[:2], own[2:])).distance(LineString((line[:2], line[2:]))) for line in others]
        faces = [line for line, m in zip(others, apart, strict=True) if line != door.line and m > ONE_LINE_M]
        drawn.doors += [replace(door, line=line) for line in (own, *faces)]
    if again := _again(drawn.doors):
        drawn.doors = [door for k, door in enumerate(drawn.doors) if k not in again]
        report.leave_out("opening that stands twice", len(again))
    if astray:
        report.doubt(f"{drawn.name}: {astray} of {len(drawn.doors)} openings lie in no wall: compare with the building")


def _again(doors: list[Door]) -> set[int]:
    """Which doors lie for the most part on an earlier one."""
    lines = shapely.linestrings(np.array([door.line for door in doors]).reshape(-1, 2, 2))
    bands = shapely.buffer(lines, ONE_LINE_M, cap_style="flat")
    later, earlier = shapely.STRtree(bands).query(lines, predicate="intersects")
    pairs = later > earlier
    later, earlier = later[pairs], earlier[pairs]
    shared = shapely.length(shapely.intersection(lines[later], bands[earlier]))
    return set(later[shared > 0.5 * shapely.length(lines[later])].tolist())


def _onto(line: Line, wall: BaseGeometry, middle: Point) -> Line:
    """A door's line moved onto the line of the nearest straight piece of a wall, where it runs along it."""
    ends, rows = np.array(line).reshape(2, 2), pieces_of([wall])
    nearest = rows[shapely.distance(shapely.linestrings(rows.reshape(-1, 2, 2)), middle).argmin()]
    start, along = nearest[:2], nearest[2:] - nearest[:2]
    along = along / np.hypot(*along)
    moved = (start + ((ends - start) @ along)[:, None] * along).round(3)
    if np.hypot(*(moved[1] - moved[0])) < ALONG * np.hypot(*(ends[1] - ends[0])):
        return line
    return float(moved[0, 0]), float(moved[0, 1]), float(moved[1, 0]), float(moved[1, 1])


def _unit(drawn: DrawnLevel, unit: Feature, openings: list[BaseGeometry]) -> None:
    kind = unit.category
    for area in areas([unit.shape]):
        if kind in FILLED:
            (drawn.windows if kind == "glass" else drawn.filled).append(area)
            continue
        way = next((CONNECTOR_KINDS[word] for word in (kind, kind.split(".")[0]) if word in CONNECTOR_KINDS), None)
        opened = any(_opens(area, one) for one in openings)
        if kind not in OPEN and (way is None or opened):
            drawn.walls.append(area.boundary)
        if way is not None:
            drawn.connectors.append(ConnectorShape(way, unit.name, area))
        elif unit.name or (kind not in OPEN and kind != "unspecified"):
            drawn.rooms.append(room(unit.name or kind, area))


def _assume_doors(drawn: DrawnLevel, units: list[Feature], openings: list[Feature], width_m: float) -> None:
    """Doors of openings without a width, and of enclosed units without an opening."""
    enclosed: list[Polygon] = []
    ways: list[Polygon] = []
    for unit in units:
        if unit.category not in FILLED:
            lift_or_stairs = unit.category.split(".")[0] in CONNECTOR_KINDS
            (ways if unit.category in OPEN or lift_or_stairs else enclosed).extend(areas([unit.shape]))
    walls = [area.exterior for area in enclosed]
    for one in openings:
        points = [part for part in pieces([one.shape]) if isinstance(part, Point)]
        drawn.doors += [door for point in points for door in doors_at(point, walls, width_m, ON_M)]
    opened = [area for area in enclosed if any(_opens(area, one.shape) for one in openings)]
    closed = [area for area in enclosed if all(area is not other for other in opened)]
    drawn.doors += doors_of_rooms(closed, ways, opened, width_m)


def _opens(area: Polygon, one: BaseGeometry) -> bool:
    if one.is_empty:
        return False
    middle = Point(np.asarray(shapely.get_coordinates(one)).mean(axis=0))
    return bool(area.boundary.distance(middle) < ON_M)


def _relationships(
    archive: Archive,
    earth: EarthTransform,
    units: dict[str, tuple[int, Feature]],
    drawn_levels: list[DrawnLevel],
    report: ImportReport,
) -> None:
    """Levels of stairs and lifts whose units do not lie above each other: from the archive's relationships."""
    for one in _features(archive, "relationship", earth):
        if one.category not in CONNECTOR_KINDS:
            report.leave_out(f"relationship {one.category[:40]}")
            continue
        between = one.about.get("intermediary")
        ends = [one.about.get("origin"), one.about.get("destination"), *(between if isinstance(between, list) else [])]
        keys = [str(end.get("id")) for end in ends if isinstance(end, dict)]
        levels = sorted({units[key][0] for key in keys if key in units})
        for key in keys:
            if key in units and len(levels) > 1:
                i, unit = units[key]
                for way in drawn_levels[i].connectors:
                    if any(way.area.equals(area) for area in areas([unit.shape])):
                        way.levels = tuple(levels)
