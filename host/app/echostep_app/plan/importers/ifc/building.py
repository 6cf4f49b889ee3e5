# SPDX-License-Identifier: MIT
"""Building models (IFC; needs `pip install echostep[ifc]`) -> `Plan`.

In: an .ifc or .ifczip file. Out: `Plan`. Owns nothing. Each level is cut by a horizontal plane one metre above its floor: the sections of walls,
columns and curtain walls become walls, so that doors are gaps. Windows, stairs and lifts are rectangles, seen from above; doors lie in their
openings.
"""

from __future__ import annotations

import math
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry import LineString, Point

from echostep.errors import EchostepError
from echostep.plan import ConnectorKind, Door, Georeference, Plan
from echostep_app.plan.georeference import FAR_M, IN_GRID, EarthTransform
from echostep_app.plan.importers.connector_shapes import plan_of
from echostep_app.plan.importers.drawn_level import ConnectorShape, DrawnLevel, room
from echostep_app.plan.importers.ifc.bodies import Shapes, SolidBody
from echostep_app.plan.importers.ifc.doors import placed_door
from echostep_app.plan.importers.ifc.map_conversion import map_georeference
from echostep_app.plan.importers.ifc.model import open_model, standing, storeys_of
from echostep_app.plan.importers.report import ImportReport

NO_STOREY = "at the height of no storey"
AT_FACE_M, THICKEST_M = 0.1, 1.0  # of a door from the face of its wall; of a wall; assumed
FRAME_M = 0.3  # between a door's width and its opening's; assumed
FAR_DEG = 0.01  # of latitude: a kilometre
CUT_M = 1.0  # height of the cut above the floor: about the rangers' height
WALLS = ("IfcWall", "IfcColumn", "IfcCurtainWall", "IfcPlate", "IfcMember")
CONNECTOR_KINDS: dict[str, ConnectorKind] = {
    "IfcStair": "stairs", "IfcStairFlight": "stairs", "IfcRamp": "ramp", "IfcRampFlight": "ramp", "IfcTransportElement": "lift",
}  # fmt: skip
SEEN = (*WALLS, *CONNECTOR_KINDS, "IfcWindow", "IfcSpace")


def import_ifc(path: Path, report: ImportReport) -> Plan:
    """Import the building of a model; raises EchostepError that names the file and the element."""
    model = open_model(path)
    storeys = storeys_of(model, path, report)
    drawn_levels = [DrawnLevel(storey.name, storey.height_m) for storey in storeys]
    shapes = Shapes(path)
    shapes.find_origin(model.by_type("IfcWall") or model.by_type("IfcElement"))
    count, strays = 0, list[str]()
    for body in shapes.bodies(standing(model, SEEN, report), report):
        count += 1
        if why := _place(drawn_levels, body):
            report.leave_out(f"{body.element.is_a()} {why}")
        elif body.element.is_a("IfcSpace") and not _at_home(drawn_levels, body):
            strays.append(str(body.element.LongName or body.element.Name or f"#{body.element.id()}"))
    if strays:
        report.doubt(
            f"{len(strays)} rooms ({', '.join(strays)[:120]}) lie at another height than the storey that they belong to: the height is taken"
        )
    _doors(model, drawn_levels, shapes, report)
    _tell(model, report)
    if not any(drawn.walls for drawn in drawn_levels):
        raise EchostepError(
            f"{path}: no walls one metre above any of its {len(drawn_levels)} storeys ({count} elements with a shape): "
            "export the model with the geometry of its walls"
        )
    projects = model.by_type("IfcProject")
    name = str((projects[0].LongName or projects[0].Name) if projects else "") or path.stem
    return plan_of(name, drawn_levels, report, _place_on_earth(model, shapes, report))


def _doors(model: Any, drawn_levels: list[DrawnLevel], shapes: Shapes, report: ImportReport) -> None:
    """Add each door to the levels that it is open to at the height of the cut."""
    scale_m = float(import_module("ifcopenshell.util.unit").calculate_unit_scale(model))
    odd: list[str] = []
    solid: dict[int, list[LineString]] = {}  # doors without an opening, by id of the level
    for element in standing(model, ["IfcDoor"], report):
        door = placed_door(element, shapes, scale_m)
        if door is None:
            report.leave_out(f"{element.is_a()} without a shape, an opening or a width")
            report.doubt("doors without a shape were left out: export the model with the geometry of its doors")
            continue
        width_m = float(element.OverallWidth or 0.0) * scale_m
        if width_m > 0.0 and abs((drawn_m := math.dist(door.line[:2], door.line[2:])) - width_m) > FRAME_M:
            odd.append(f"{element.Name or f'#{element.id()}'} {width_m:.2f}/{drawn_m:.2f} m")
        levels = [drawn for drawn in drawn_levels if door.z_m[0] <= drawn.height_m + CUT_M <= door.z_m[1]]
        if not levels:
            report.leave_out(f"{element.is_a()} {NO_STOREY}")
        for drawn in levels:
            drawn.doors.append(Door(door.line, name=str(element.Name or "")[:80]))
            if not door.fills:
                solid.setdefault(id(drawn), []).append(LineString([door.line[:2], door.line[2:]]))
    if odd:
        report.doubt(
            f"OverallWidth and opening of {len(odd)} doors differ ({', '.join(odd)[:120]}): the opening is taken"
        )
    for drawn in drawn_levels:
        _open(drawn, solid.get(id(drawn), []))


def _open(drawn: DrawnLevel, doors: list[LineString]) -> None:
    """Cut the walls that have doors without an opening: a door's two ends and its middle are in the wall, or at its face."""
    tree = shapely.STRtree(drawn.walls)
    for door in doors:
        stands = [
            set(tree.query(Point(at), predicate="dwithin", distance=AT_FACE_M))
            for at in (*door.coords, door.centroid.coords[0])
        ]
        for k in set.intersection(*stands):
            drawn.walls[k] = drawn.walls[k].difference(door.buffer(THICKEST_M, cap_style="flat"))


def _tell(model: Any, report: ImportReport) -> None:
    """Report the unit, and elements of kinds that plans do not have."""
    units = list(import_module("ifcopenshell.util.unit").get_project_unit(model, "LENGTHUNIT") or ())
    report.units = " ".join(str(part).lower() for part in units[2:] if isinstance(part, str)) or "metre"
    seen = (*SEEN, "IfcDoor", "IfcFeatureElement", "IfcPort", "IfcVirtualElement", "IfcElementComponent")
    for element in model.by_type("IfcElement"):
        if not any(element.is_a(kind) for kind in seen):
            report.leave_out(element.is_a())


def _place(drawn_levels: list[DrawnLevel], body: SolidBody) -> str:
    """Add an element to the levels that it is on; returns why it is on none, empty when it is on one."""
    kind = next(kind for kind in SEEN if body.element.is_a(kind))
    low, high = body.z_m
    name = str(getattr(body.element, "LongName", None) or getattr(body.element, "Name", None) or "")[:80]
    if kind in CONNECTOR_KINDS:
        return _place_way(drawn_levels, body, CONNECTOR_KINDS[kind], name)
    levels = [drawn for drawn in drawn_levels if low <= drawn.height_m + CUT_M <= high]
    for drawn in levels:
        if kind in WALLS:
            drawn.walls += body.cut(drawn.height_m + CUT_M)
        elif kind == "IfcWindow":
            drawn.windows.append(body.above())
        else:
            drawn.rooms += [room(name or "room", area) for area in body.cut(drawn.height_m + CUT_M)]
    return "" if levels else NO_STOREY


def _at_home(drawn_levels: list[DrawnLevel], body: SolidBody) -> bool:
    """Whether a room is at the height of the storey that it belongs to; true where that is no level."""
    (low, high), storeys = body.z_m, [str(relation.RelatingObject.Name) for relation in body.element.Decomposes]
    own = [drawn for drawn in drawn_levels if drawn.name in storeys]
    return not own or any(low <= drawn.height_m + CUT_M <= high for drawn in own)


def _place_way(drawn_levels: list[DrawnLevel], body: SolidBody, kind: ConnectorKind, name: str) -> str:
    """As `_place`, for stairs, a ramp or a lift: on all levels between its lowest and its highest corner."""
    low, high = body.z_m
    passed = [i for i, drawn in enumerate(drawn_levels) if low - 0.5 <= drawn.height_m <= high + 0.5]
    for i in passed:
        drawn_levels[i].connectors.append(ConnectorShape(kind, name, body.above(), tuple(passed)))
    return "" if passed else NO_STOREY


def _georeference(model: Any) -> Georeference | None:
    """Longitude, latitude and true north of the model's site; None where the model does not state them."""
    sites = [site for site in model.by_type("IfcSite") if site.RefLatitude and site.RefLongitude]
    if not sites:
        return None
    lat, lon = (_degrees(parts) for parts in (sites[0].RefLatitude, sites[0].RefLongitude))
    if not (abs(lat) <= 90.0 and abs(lon) <= 180.0) or (lat, lon) == (0.0, 0.0):
        return None
    contexts = model.by_type("IfcGeometricRepresentationContext", include_subtypes=False)
    norths = [c.TrueNorth.DirectionRatios for c in contexts if c.TrueNorth]
    x, y = norths[0][:2] if norths else (0.0, 1.0)
    return Georeference(lon, lat, math.pi / 2 - math.atan2(y, x))


def _place_on_earth(model: Any, shapes: Shapes, report: ImportReport) -> Georeference | None:
    """The georeference of the plan's origin by the map conversion, else by the site, whose longitude and latitude belong to its placement."""
    x, y = shapes.origin_m
    scale_m = float(import_module("ifcopenshell.util.unit").calculate_unit_scale(model))
    if (x, y) != (0.0, 0.0):
        report.doubt(IN_GRID.format("the model", x, y))
    georeference = _georeference(model)
    if by_map := map_georeference(model, shapes.origin_m, scale_m, report):
        if georeference and abs(georeference.latitude_deg - by_map.latitude_deg) > FAR_DEG:
            report.doubt(
                "its site's RefLatitude is more than 1 km from its map conversion: the map conversion is taken"
            )
        return by_map
    if georeference is None or (x, y) == (0.0, 0.0):
        return georeference
    placement = model.by_type("IfcSite")[0].ObjectPlacement
    matrix = import_module("ifcopenshell.util.placement").get_local_placement(placement)
    off_m = np.array([[x, y]]) - np.asarray(matrix)[:2, 3] * scale_m
    if not np.abs(off_m).max() <= FAR_M:
        report.doubt("its longitude and latitude are of a place far from its walls: left out")
        return None
    ((lon, lat),) = EarthTransform(georeference).degrees(off_m).tolist()
    return replace(georeference, longitude_deg=lon, latitude_deg=lat)


def _degrees(parts: Any) -> float:
    """Degrees from degrees, minutes, seconds and millionths of a second; all have the sign of the first that is not 0."""
    size = sum(abs(part) / unit for part, unit in zip(parts, (1, 60, 3600, 3600e6), strict=False))
    return math.copysign(size, next(filter(None, parts), 0))
