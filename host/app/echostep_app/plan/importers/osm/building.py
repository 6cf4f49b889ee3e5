# SPDX-License-Identifier: MIT
"""OpenStreetMap Simple Indoor Tagging (XML, JSON of Overpass, GeoJSON of overpass-turbo) -> `Plan`.

In: an .osm, .xml, .json or .geojson file. Out: `Plan`. Owns nothing. Rooms have walls, corridors and areas have none, `indoor=wall` is a wall, a
building's outline is a wall on each of its levels; a door is a node on a wall. Levels are `storey_m` apart, level 0 at 0 m.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.fields import LIMIT_M
from echostep.plan import ConnectorKind, Door, DoorState, Georeference, Plan
from echostep_app.plan.georeference import EarthTransform
from echostep_app.plan.importers.connector_shapes import plan_of
from echostep_app.plan.importers.drawn_level import ConnectorShape, DrawnLevel, areas, room
from echostep_app.plan.importers.osm.elements import Elements, Tags, levels_of, read_osm
from echostep_app.plan.importers.report import ImportReport
from echostep_app.plan.importers.straight import merge_collinear, pieces_of

DOOR_M, STAIRS_M, LIFT_M = 0.9, 1.5, 1.8  # widths where the map states none: usual sizes
OFF_M = 0.02  # of a straight wall's nodes from its line: twice OpenStreetMap's resolution
ON_M = 0.1  # greatest distance of a door's node from its wall; assumed
MOST_LEVELS = 200
WALL_LESS = ("no", "roof", "carport", "canopy")  # values of building=*: roofs on posts
UNITS_M = {"": 1.0, "m": 1.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048, "'": 0.3048, '"': 0.0254}
# As 0.9, 90 cm, 3'6" [OpenStreetMap wiki, Map features/Units]
WIDTH = re.compile(r"""(\d+(?:[.,]\d+)?) ?(m|cm|mm|ft|'|"|)(?: ?(\d+)")?""")


@dataclass(slots=True)
class OsmSite:
    """Levels by their OSM level numbers, these in order, and the levels of the indoor elements and of the outlines through each node."""

    drawn_levels: dict[float, DrawnLevel]
    order: list[float]
    levels_at: dict[int, set[float]] = field(default_factory=dict)
    outside: dict[int, list[float]] = field(default_factory=dict)

    def on(self, levels: list[float]) -> Iterator[DrawnLevel]:
        """The levels with these OSM numbers."""
        return (self.drawn_levels[level] for level in levels if level in self.drawn_levels)


def import_osm(path: Path, storey_m: float, report: ImportReport) -> Plan:
    """Import the building in a file; raises EchostepError that names the file and the element."""
    elements = read_osm(path)
    levels = sorted(elements.levels(path))
    if not levels:
        raise EchostepError(f"{path}: {_why_empty(elements)}")
    if len(levels) > MOST_LEVELS:
        raise EchostepError(f"{path}: {len(levels)} levels; a plan has {MOST_LEVELS} at most: cut out one building")
    georeference = _origin(elements, path)
    elements.project(EarthTransform(georeference).metres)
    if np.abs(np.array(list(elements.at_m.values()))).max() > LIMIT_M:
        raise EchostepError(f"{path}: nodes are further than {LIMIT_M / 1000:.0f} km apart: cut out one building")
    site = OsmSite({level: DrawnLevel(f"level {level:g}", round(level * storey_m, 6)) for level in levels}, levels)
    _without_level(elements, report)
    _outlines(site, elements, report)
    _spaces(site, elements)
    _doors(site, elements, report)
    _lifts(site, elements)
    _other(elements, report)
    drawn_levels = [site.drawn_levels[level] for level in levels]
    names = sorted({tags["name"] for *_, tags in elements.lines() if "building" in tags and "name" in tags})
    return plan_of(", ".join(names) or path.stem, drawn_levels, report, georeference)


def _why_empty(elements: Elements) -> str:
    """Why no indoor element has a level, and the next step."""
    indoor = [tags for tags in elements.way_tags.values() if tags.get("indoor", "no") != "no"]
    if any(levels_of(tags) for tags in indoor):
        return "its indoor ways have no nodes: download it again by `out geom;`, or with `(._;>;);`"
    if unread := sorted({tags["level"][:40] for tags in indoor if tags.get("level")}):
        return f"level={unread[0]} is no number or range: write level=0;1 or level=0-2"
    return "nothing is tagged indoor=* with a level: choose an area that is mapped indoors"


def _without_level(elements: Elements, report: ImportReport) -> None:
    """Report indoor elements that no level tag places."""
    lost: dict[str, list[str]] = {}
    unread = [tags["level"][:40] for _, _, tags in elements.lines() if tags.get("level") and not levels_of(tags)]
    advice = f"level={unread[0]} is no number or range: write level=0;1 or level=0-2" if unread else "tag level=*"
    for where, _, tags in elements.lines():
        indoor = tags.get("indoor", "no")
        kind = "room" if indoor == "room" else f"indoor={indoor[:20]}" if indoor != "no" else ""
        if (kind or _way(tags)) and not levels_of(tags, where) and not _is_outline(tags):
            lost.setdefault(kind or str(_way(tags)), []).append(where)
    for kind, names in lost.items():
        report.leave_out(f"{kind} without level", len(names))
        one = len(names) == 1
        report.doubt(
            f"{len(names)} {kind}{'' if one or kind == 'stairs' or '=' in kind else 's'} {'has' if one else 'have'} no level and "
            f"{'was' if one else 'were'} left out ({', '.join(names[:5])}): {advice} and download it again"
        )


def _other(elements: Elements, report: ImportReport) -> None:
    """Report elements with tags that plans do not have: shops, furniture, footpaths, groups."""
    walls = ("room", "wall", "column", "pillar", "area", "corridor", "level")
    for _, _, tags in elements.lines():
        if tags and _way(tags) is None and not _is_outline(tags) and tags.get("indoor") not in walls:
            report.leave_out("way that is no wall, room, corridor or stairs")
    for _, tags in elements.nodes():
        if _way(tags) is None and not _is_door(tags):
            report.leave_out("node that is no door, stairs or lift")
    report.leave_out("relation that is no multipolygon", elements.other_relations)


def _is_door(tags: Tags) -> bool:
    return "door" in tags or "entrance" in tags or tags.get("indoor") == "door"


def _origin(elements: Elements, path: Path) -> Georeference:
    """The plan's origin: the mean position of the nodes of indoor elements and buildings, rounded to 1e-5 degrees (about 1 m)."""
    used = [node for _, nodes, tags in elements.lines() if {"indoor", "building"} & tags.keys() for node in nodes]
    if not used:
        raise EchostepError(f"{path}: no way is tagged indoor=*: choose an area that is mapped indoors")
    lon, lat = np.array([elements.degrees[node] for node in used]).mean(axis=0).round(5)
    return Georeference(float(lon), float(lat))


def _outlines(site: OsmSite, elements: Elements, report: ImportReport) -> None:
    """Add the outlines of buildings as walls, on each of their levels."""
    for where, nodes, tags in elements.lines():
        if _is_outline(tags):
            least = tags.get("building:min_level") or tags.get("min_level")
            own = levels_of(tags, where) or [k for k in site.order if _within(k, least, tags.get("max_level"))]
            _wall(site, elements, nodes, own, tags)
            above, stated = sum(level >= 0 for level in site.order), tags.get("building:levels", "")
            if re.fullmatch(r"\d{1,3}", stated, re.ASCII) and int(stated) < above:
                report.doubt(
                    f"{where}: building:levels={stated}, but indoor elements are on {above} levels from 0 up: these are taken"
                )
            site.outside |= dict.fromkeys(nodes, own)


def _is_outline(tags: Tags) -> bool:
    """Whether a way is a building's outline, which has walls."""
    return tags.get("building", "no") not in WALL_LESS


def _within(level: float, least: str | None, most: str | None) -> bool:
    try:
        return float(least or -math.inf) <= level <= float(most or math.inf)
    except ValueError:
        return True


def _spaces(site: OsmSite, elements: Elements) -> None:
    """Add rooms, areas, corridors, walls, stairs and lifts that are mapped as lines or areas."""
    for where, nodes, tags in elements.lines():
        levels, kind = levels_of(tags, where), tags.get("indoor", "no")
        line = elements.line(nodes)
        closed = nodes[0] == nodes[-1] and len(nodes) > 3
        area = Polygon(line) if closed and line is not None else None
        way = _way(tags)
        for node in nodes if kind != "no" else ():
            site.levels_at.setdefault(node, set()).update(levels)
        if kind in ("room", "wall"):
            _wall(site, elements, nodes, levels, tags)
        if kind in ("column", "pillar") and area is not None:
            for drawn in site.on(levels):
                drawn.filled += areas([area])
        if way is not None and line is not None:
            where_to = area or line.buffer(_metres(tags, STAIRS_M) / 2, cap_style="flat")
            _ways(site, way, tags, where_to, levels)
        name = tags.get("name") or tags.get("ref") or ""
        if name and area is not None and kind in ("room", "area", "corridor") and way is None:
            for drawn in site.on(levels):
                drawn.rooms += [room(name[:80], part) for part in areas([area])]


def _wall(site: OsmSite, elements: Elements, nodes: list[int], levels: list[float], tags: Tags) -> None:
    """Add a line as a wall, or as a window when it is of glass, on each of its levels."""
    line = elements.line(nodes)
    if line is None:
        return
    glass = "glass" in (tags.get("material"), tags.get("wall"))
    for drawn in site.on(levels):
        (drawn.windows if glass else drawn.walls).append(line)


def _doors(site: OsmSite, elements: Elements, report: ImportReport) -> None:
    """Add a door for each node with a door tag, on each of its levels where it lies on a wall."""
    walls = {
        level: merge_collinear(pieces_of([*drawn.walls, *drawn.windows]), OFF_M)
        for level, drawn in site.drawn_levels.items()
    }
    trees = {level: shapely.STRtree(shapely.linestrings(rows.reshape(-1, 2, 2))) for level, rows in walls.items()}
    lines: dict[float, set[tuple[float, ...]]] = {level: set() for level in walls}
    lost, odd, ground = [], [], []
    for node, tags in elements.nodes():
        if not _is_door(tags):
            continue
        odd += [f"node {node}: width={tags['width'][:20]}"] if "width" in tags and not _metres(tags, 0.0) else []
        own, through = levels_of(tags, f"node {node}"), elements.through(node)
        ground += [f"node {node}"] if not own and through in site.outside else []
        own = own or _levels_at(site, through)
        wide_m, at_m = _metres(tags, DOOR_M), elements.at_m[node]
        gaps = {level: _gap(walls[level], trees[level], at_m, wide_m) for level in own if level in walls}
        lost += [] if any(gaps.values()) else [f"node {node}"]
        for level, gap in gaps.items():
            if gap is not None and gap not in lines[level]:
                lines[level].add(gap)
                entrance = f"{tags['entrance']} entrance" if tags.get("entrance", "no") != "no" else ""
                name = (tags.get("name") or tags.get("ref") or entrance)[:80]
                site.drawn_levels[level].doors.append(Door(gap, _state(tags), name))
    if ground:
        report.doubt(f"doors without level on outlines are on the ground ({', '.join(ground[:5])}): tag level=*")
    if odd:
        report.doubt(
            f"{len(odd)} doors were taken as {DOOR_M:g} m wide ({', '.join(odd[:3])}): write it in metres, as width=0.9, or with its unit"
        )
    if lost:
        report.leave_out("door on no wall", len(lost))
        report.doubt(f"doors on no wall were left out ({', '.join(lost[:5])}): corridors and areas have no walls")


def _levels_at(site: OsmSite, node: int) -> list[float]:
    """Levels of a door without a level: of the indoor elements through its node; on an outline only the lowest from 0 up."""
    levels = sorted(site.levels_at.get(node) or site.outside.get(node) or site.order)
    return [min(levels, key=lambda level: (level < 0, abs(level)))] if node in site.outside else levels


def _gap(
    walls: Floats, tree: shapely.STRtree, at_m: tuple[float, float], wide_m: float
) -> tuple[float, float, float, float] | None:
    """A door's line along the longest of the walls (n, 4) at its node, of equal ones the first from west to north; within the wall's ends."""
    near = walls[tree.query(Point(at_m), predicate="dwithin", distance=ON_M)]
    if not len(near):
        return None
    x0, y0, x1, y1 = min(map(_directed, near.tolist()), key=lambda w: (-round(math.dist(w[:2], w[2:]), 2), w))
    side = LineString([(x0, y0), (x1, y1)])
    wide_m = min(wide_m, side.length)
    middle = min(max(side.project(Point(at_m)), wide_m / 2), side.length - wide_m / 2)
    first, last = (side.interpolate(middle + sign * wide_m / 2) for sign in (-1, 1))
    return round(first.x, 3), round(first.y, 3), round(last.x, 3), round(last.y, 3)


def _directed(wall: list[float]) -> tuple[float, ...]:
    """A wall from its end in the west, or in the south, whichever way it was drawn."""
    return min(tuple(wall), tuple(wall[2:] + wall[:2]), key=lambda w: (round(w[0], 2), round(w[1], 2)))


def _state(tags: Tags) -> DoorState:
    if tags.get("door") == "no":
        return "open"
    return "closed" if tags.get("locked") == "yes" or tags.get("access") == "no" else "unknown"


def _lifts(site: OsmSite, elements: Elements) -> None:
    """Add lifts and stairs that are mapped as one node, as squares."""
    for node, tags in elements.nodes():
        way = _way(tags)
        if way is not None:
            square = Point(elements.at_m[node]).buffer(LIFT_M / 2, cap_style="square")
            _ways(site, way, tags, square, levels_of(tags, f"node {node}"))


def _way(tags: Tags) -> ConnectorKind | None:
    """The kind of connector that the tags state; None for other elements."""
    values = {tags.get("highway"), tags.get("room"), tags.get("indoor"), tags.get("buildingpart:verticalpassage")}
    if "elevator" in values or tags.get("elevator") == "yes":
        return "lift"
    if values & {"steps", "stairs", "stairway", "escalator"} or tags.get("stairs") == "yes":
        return "stairs"
    return "ramp" if "ramp" in values or tags.get("ramp") == "yes" else None


def _ways(site: OsmSite, kind: ConnectorKind, tags: Tags, area: BaseGeometry, levels: list[float]) -> None:
    """Add a connector's shape to each of its levels."""
    known = tuple(site.order.index(level) for level in levels if level in site.drawn_levels)
    for drawn in site.on(levels):
        drawn.connectors += [ConnectorShape(kind, tags.get("name", "")[:80], part, known) for part in areas([area])]


def _metres(tags: Tags, otherwise: float) -> float:
    """The tagged width in metres; `otherwise` when it is absent or not between 0.3 m and 20 m."""
    stated = WIDTH.fullmatch(tags.get("width", "").strip())
    if stated is None:
        return otherwise
    width = float(stated[1].replace(",", ".")) * UNITS_M[stated[2]] + float(stated[3] or 0) * UNITS_M['"']
    return width if 0.3 <= width <= 20.0 else otherwise
