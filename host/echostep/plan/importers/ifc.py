# SPDX-License-Identifier: MIT
"""Building models (IFC; needs `pip install echostep[ifc]`) -> `Plan`.

In: an .ifc file. Out: `Plan`. Owns nothing. Each level is cut by a horizontal plane one metre above its floor: the sections of walls, columns and
curtain walls become walls, so that doors are gaps. Windows, doors, stairs and lifts are rectangles, seen from above.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry import MultiPoint, Polygon

from echostep.arrays import Floats, Ints
from echostep.errors import EchostepError
from echostep.extras import require
from echostep.plan.importers.connector_shapes import join_connectors
from echostep.plan.importers.drawn_level import ConnectorShape, DrawnLevel, areas, opening, room
from echostep.plan.importers.parsing import read_bytes
from echostep.plan.json_fields import LIMIT_M
from echostep.plan.model import ConnectorKind, Door, Georeference, Plan

CUT_M = 1.0  # height of the cut above the floor: about that of the rangers
WALLS = ("IfcWall", "IfcColumn", "IfcCurtainWall", "IfcPlate", "IfcMember")
CONNECTOR_KINDS: dict[str, ConnectorKind] = {
    "IfcStair": "stairs", "IfcStairFlight": "stairs", "IfcRamp": "ramp", "IfcRampFlight": "ramp", "IfcTransportElement": "lift",
}  # fmt: skip
SEEN = (*WALLS, *CONNECTOR_KINDS, "IfcWindow", "IfcDoor", "IfcSpace")


@dataclass(frozen=True, slots=True)
class SolidBody:
    """An element as triangles: corners (n, 3) in metres, faces (m, 3) as indices of corners."""

    element: Any
    corners: Floats
    faces: Ints

    def cut(self, z_m: float) -> list[Polygon]:
        """Its section with the horizontal plane at `z_m`."""
        three = self.corners[self.faces]
        above = three[:, :, 2] > z_m
        crossed = three[above.any(axis=1) & ~above.all(axis=1)]
        if not len(crossed):
            return []
        lines = shapely.linestrings(_crossings(crossed, z_m))
        return areas(shapely.get_parts(shapely.build_area(shapely.union_all(lines, grid_size=1e-4))))

    def above(self) -> Polygon:
        """The smallest rectangle around it, seen from above."""
        hull = MultiPoint(self.corners[:, :2]).minimum_rotated_rectangle
        return hull if isinstance(hull, Polygon) else hull.buffer(0.01)

    @property
    def z_m(self) -> tuple[float, float]:
        """Heights of its lowest and its highest corner."""
        return float(self.corners[:, 2].min()), float(self.corners[:, 2].max())


def import_ifc(path: Path) -> Plan:
    """Import the building of a model; raises EchostepError that names the file and the element."""
    model = _open(path)
    levels = _level_heights(model, path)
    drawn_levels = [DrawnLevel(name, height) for name, height in levels]
    count = 0
    for body in _bodies(model, path):
        count += 1
        _place(drawn_levels, body)
    if not any(drawn.walls for drawn in drawn_levels):
        raise EchostepError(
            f"{path}: no walls one metre above any of its {len(drawn_levels)} storeys ({count} elements with a shape): "
            "export the model with the geometry of its walls"
        )
    projects = model.by_type("IfcProject")
    name = str((projects[0].LongName or projects[0].Name) if projects else "") or path.stem
    return Plan(
        name[:80], tuple(s.level() for s in drawn_levels), None, "", join_connectors(drawn_levels), _georeference(model)
    )


def _open(path: Path) -> Any:
    require(f"{path}: IFC", "ifcopenshell")
    ifcopenshell: Any = import_module("ifcopenshell")
    start = read_bytes(path)[:2000]
    if b"ISO-10303-21" not in start:
        raise EchostepError(f"{path}: not an IFC file (no ISO-10303-21 at its beginning): export it as IFC (STEP)")
    try:
        return ifcopenshell.open(str(path))
    except Exception as error:  # a damaged model breaks its reader in many ways
        raise EchostepError(f"{path}: not an IFC file: {' '.join(str(error).split())[:200]}") from error


def _level_heights(model: Any, path: Path) -> list[tuple[str, float]]:
    """Names and heights (m) of the model's levels, from the lowest."""
    elevation: Any = import_module("ifcopenshell.util.placement").get_storey_elevation
    try:
        scale_m = float(import_module("ifcopenshell.util.unit").calculate_unit_scale(model))
        levels = [
            (str(s.LongName or s.Name or "storey")[:80], float(elevation(s)) * scale_m)
            for s in model.by_type("IfcBuildingStorey")
        ]
    except Exception as error:
        raise EchostepError(f"{path}: its storeys cannot be read: {' '.join(str(error).split())[:200]}") from error
    if not levels or not all(abs(height) <= LIMIT_M for _, height in levels):
        raise EchostepError(
            f"{path}: {'a storey has no sane height' if levels else 'no IfcBuildingStorey'}: export the model with its storeys"
        )
    return sorted(((name, round(height, 6)) for name, height in levels), key=lambda level: level[1])


def _bodies(model: Any, path: Path) -> Iterator[SolidBody]:
    """All elements that a plan shows, in the model's world coordinates in metres; elements without a usable shape are left out."""
    geometry: Any = import_module("ifcopenshell.geom")
    settings = geometry.settings()
    settings.set("use-world-coords", True)
    for element in (element for kind in SEEN for element in model.by_type(kind)):
        if getattr(element, "Representation", None) is None:
            continue
        try:
            shape = geometry.create_shape(settings, element).geometry
        except RuntimeError:
            continue
        corners = np.array(shape.verts, dtype=np.float64).reshape(-1, 3)
        faces = np.array(shape.faces, dtype=np.int64).reshape(-1, 3)
        if not len(corners) or not len(faces):
            continue
        if not (np.abs(corners) <= LIMIT_M).all():
            raise EchostepError(
                f"{path}: {element.is_a()} #{element.id()}: further than {LIMIT_M / 1000:.0f} km from the origin"
            )
        yield SolidBody(element, corners, faces)


def _place(drawn_levels: list[DrawnLevel], body: SolidBody) -> None:
    kind = next(kind for kind in SEEN if body.element.is_a(kind))
    low, high = body.z_m
    name = str(getattr(body.element, "LongName", None) or getattr(body.element, "Name", None) or "")[:80]
    if kind in CONNECTOR_KINDS:
        _place_way(drawn_levels, body, CONNECTOR_KINDS[kind], name)
        return
    for drawn in drawn_levels:
        z = drawn.height_m + CUT_M
        if not low <= z <= high:
            continue
        if kind in WALLS:
            drawn.walls += body.cut(z)
        elif kind == "IfcWindow":
            drawn.windows.append(body.above())
        elif kind == "IfcDoor":
            drawn.doors.append(Door(opening(body.above()), name=name))
        else:
            drawn.rooms += [room(name or "room", area) for area in body.cut(z)]


def _place_way(drawn_levels: list[DrawnLevel], body: SolidBody, kind: ConnectorKind, name: str) -> None:
    """Add stairs, a ramp or a lift to all levels between its lowest and its highest corner."""
    if kind == "lift" and str(getattr(body.element, "PredefinedType", "ELEVATOR")) not in (
        "ELEVATOR",
        "None",
        "NOTDEFINED",
    ):
        return
    low, high = body.z_m
    passed = [i for i, drawn in enumerate(drawn_levels) if low - 0.5 <= drawn.height_m <= high + 0.5]
    for i in passed:
        drawn_levels[i].connectors.append(ConnectorShape(kind, name, body.above(), tuple(passed)))


def _crossings(three: Floats, z_m: float) -> Floats:
    """Sections of triangles (n, 3, 3) with the plane: (n, 2, 2). One corner lies alone on its side; both its edges cross the plane."""
    above = three[:, :, 2] > z_m
    alone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), (~above).argmax(axis=1))
    rows = np.arange(len(three))
    tip = three[rows, alone]
    others = np.stack((three[rows, (alone + 1) % 3], three[rows, (alone + 2) % 3]), axis=1)
    part = (z_m - tip[:, None, 2]) / (others[:, :, 2] - tip[:, None, 2])
    crossings: Floats = tip[:, None, :2] + part[:, :, None] * (others[:, :, :2] - tip[:, None, :2])
    return crossings


def _georeference(model: Any) -> Georeference | None:
    """Longitude, latitude and true north of the model's site; None where the model does not state them."""
    sites = [site for site in model.by_type("IfcSite") if site.RefLatitude and site.RefLongitude]
    if not sites:
        return None
    lat, lon = (_degrees(parts) for parts in (sites[0].RefLatitude, sites[0].RefLongitude))
    if not (abs(lat) <= 90.0 and abs(lon) <= 180.0) or (lat, lon) == (0.0, 0.0):
        return None
    norths = [
        c.TrueNorth.DirectionRatios
        for c in model.by_type("IfcGeometricRepresentationContext", include_subtypes=False)
        if c.TrueNorth
    ]
    x, y = norths[0][:2] if norths else (0.0, 1.0)
    return Georeference(lon, lat, math.pi / 2 - math.atan2(y, x))


def _degrees(parts: Any) -> float:
    """Degrees from degrees, minutes, seconds and millionths of a second."""
    return float(sum(part / unit for part, unit in zip(parts, (1, 60, 3600, 3600e6), strict=False)))
