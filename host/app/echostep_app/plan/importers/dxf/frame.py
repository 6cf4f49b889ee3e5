# SPDX-License-Identifier: MIT
"""Entities of a drawing -> polylines in map metres.

In: entities of ezdxf, the scale. Out: `LineString`s. Owns the limits for stray lines, and which hatches are walls.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.fields import LIMIT_M
from echostep_app.plan.georeference import EARTH_M, grid_origin

METRES = {"mm": 0.001, "cm": 0.01, "m": 1.0, "in": 0.0254, "ft": 0.3048}
FLAT_M = 0.005  # greatest distance of an arc from the straight pieces that replace it
SAMPLES = 50  # walls that decide the origin
STRAY = LineString([(0.0, 0.0), (EARTH_M, 0.0)])  # replaces a line beyond that
THINNEST_M = 0.03  # a wider polyline is drawn as thick as its wall, a narrower one with a pen; assumed
THICKEST_M = 1.2  # a hatch that is nowhere wider fills a wall or a column, a wider one a floor; assumed
ASKEW = 0.5  # sine of the angle between a multiline and its stored offsets below which these are wrong; at right corners it is 0.71
PROXY_LINES = ("LINE", "ARC", "CIRCLE", "LWPOLYLINE", "POLYLINE")
# Their outlines are not lines of the building
PICTURES = frozenset({"IMAGE", "WIPEOUT", "VIEWPORT", "OLE2FRAME", "XLINE", "RAY", "UNDERLAY", "INSERT"})


@dataclass(frozen=True, slots=True)
class DrawingFrame:
    """Drawing units -> map metres: scaled, then moved by `x0_m`, `y0_m`."""

    scale_m: float
    x0_m: float = 0.0
    y0_m: float = 0.0

    @classmethod
    def about(cls, walls: Sequence[Any], scale_m: float) -> DrawingFrame:
        """The drawing's own origin, or that in a national grid by some of the walls."""
        some = walls[:: max(1, len(walls) // SAMPLES)]
        points = [points[0] * scale_m for entity in some for points in corners(entity)[:1]]
        return cls(scale_m, *grid_origin(np.array(points).reshape(-1, 2)))

    def metres(self, point: Any) -> tuple[float, float]:
        """A point of the drawing in map metres."""
        return float(point.x) * self.scale_m - self.x0_m, float(point.y) * self.scale_m - self.y0_m

    def heights(self, entity: Any) -> tuple[float, float]:
        """Lowest and highest z (m) of an entity with its thickness, to a millimetre; 0 without one, or far away."""
        try:
            at = entity.dxf.get("insert") if entity.dxf.is_supported("insert") else None
            ends = [at.z] if at is not None else [p.z for path in paths(entity) for p in path.control_vertices()]
            tall = float(entity.dxf.get("thickness", 0.0)) if entity.dxf.is_supported("thickness") else 0.0
        except _broken():
            return 0.0, 0.0
        z_m = [round(z * self.scale_m, 3) for end in ends for z in (end, end + tall)]
        return (min(z_m), max(z_m)) if z_m and all(abs(z) <= LIMIT_M for z in z_m) else (0.0, 0.0)

    def raw(self, entity: Any) -> list[LineString]:
        """The entity as polylines in metres, `STRAY` for a line that no building has; empty for an entity without a line."""
        try:
            if not abs(float(getattr(entity.dxf, "radius", 0.0))) * self.scale_m <= EARTH_M:
                return [STRAY]
            lines = [line for path in paths(entity) if (line := self._flat(path)) is not None]
        except _broken():
            return []
        if (width_m := _width(entity) * self.scale_m) > THINNEST_M:
            return _thick(lines, width_m)
        return _thin(lines) if entity.dxftype() in ("HATCH", "MPOLYGON") else lines

    def lines(self, entity: Any, file: Path) -> list[LineString]:
        """As `raw`; raises EchostepError when a line is beyond the limit of plans."""
        lines = self.raw(entity)
        if any(np.abs(shapely.get_coordinates(line)).max() > LIMIT_M for line in lines):
            raise EchostepError(
                f"{file}: layer {entity.dxf.layer!r}: {entity.dxftype()} is {LIMIT_M / 1000:.0f} km away: other units, or a stray line?"
            )
        return lines

    def _flat(self, path: Any) -> LineString | None:
        """A path as straight pieces within `FLAT_M`; None when it has no length."""
        ends = np.array([self.metres(p) for p in path.control_vertices()])
        if len(ends) and not np.abs(ends).max() <= EARTH_M:  # its pieces could not be counted
            return STRAY
        points = [self.metres(p) for p in path.flattening(FLAT_M / self.scale_m)]
        return LineString(points) if len(set(points)) > 1 and np.isfinite(points).all() else None


def _broken() -> tuple[type[Exception], ...]:
    """What a damaged entity raises."""
    from ezdxf.lldxf.const import DXFError

    return TypeError, ValueError, ArithmeticError, LookupError, AttributeError, DXFError


def paths(entity: Any) -> Iterator[Any]:
    """The outlines of an entity: one for lines and curves, several for hatches, multilines and faces; none for texts and pictures."""
    from ezdxf import path
    from ezdxf.render.mesh import MeshBuilder

    kind = entity.dxftype()
    if kind in PICTURES:
        return
    if kind in ("HATCH", "MPOLYGON"):
        yield from path.from_hatch(entity)
    elif kind == "MLINE":
        if _askew(entity):
            entity.update_geometry()
        yield from (path.make_path(part) for part in entity.virtual_entities() if part.dxftype() in ("LINE", "ARC"))
    elif kind == "ACAD_PROXY_ENTITY":  # an object of another program, with lines that show it
        yield from (path.make_path(part) for part in entity.virtual_entities() if part.dxftype() in PROXY_LINES)
    elif kind == "MESH" or (kind == "POLYLINE" and (entity.is_poly_face_mesh or entity.is_polygon_mesh)):
        mesh = MeshBuilder.from_mesh(entity) if kind == "MESH" else MeshBuilder.from_polyface(entity)
        yield from (path.from_vertices(face, close=True) for face in mesh.faces_as_vertices())
    else:
        yield path.make_path(entity)


def corners(entity: Any) -> list[Floats]:
    """Corners (n, 2) of the entity's outlines in drawing units; curves count as their chords."""
    try:
        found = [[(p.start.x, p.start.y), *((c.end.x, c.end.y) for c in p.commands())] for p in paths(entity)]
    except _broken():
        return []
    return [points for row in found if np.isfinite(points := np.array(row, dtype=np.float64)).all() and len(row) > 1]


def _width(entity: Any) -> float:
    """The width of a polyline that is drawn with one width all along, in drawing units; 0 for others."""
    if entity.dxftype() == "LWPOLYLINE":
        same = entity.dxf.get("const_width", 0.0)
        widths = [(same, same)] * 2 if same else [tuple(point) for point in entity.get_points("se")]
    elif entity.dxftype() == "POLYLINE" and entity.has_width:
        start, end = entity.dxf.default_start_width, entity.dxf.default_end_width
        widths = [(v.dxf.get("start_width", start), v.dxf.get("end_width", end)) for v in entity.vertices]
    else:
        return 0.0
    pieces = widths if entity.is_closed else widths[:-1]  # none begins at the last corner of an open one
    known = {float(width) for pair in pieces for width in pair}
    return known.pop() if len(known) == 1 else 0.0


def _thick(lines: list[LineString], width_m: float) -> list[LineString]:
    """Outlines of lines that are drawn with a width."""
    areas = (line.buffer(width_m / 2, cap_style="flat", join_style="mitre") for line in lines)
    parts = [part for area in areas for part in shapely.get_parts(area) if not part.is_empty]
    return [LineString(ring.coords) for part in parts for ring in (part.exterior, *part.interiors)]


def _askew(mline: Any) -> bool:
    """Whether the offsets that a multiline stores do not point away from its line."""
    for one, other in zip(mline.vertices, mline.vertices[1:], strict=False):
        along, across = other.location - one.location, one.miter_direction
        length = math.hypot(along.x, along.y) * math.hypot(across.x, across.y)
        if length and abs(along.x * across.y - along.y * across.x) < ASKEW * length:
            return True
    return False


def _thin(lines: list[LineString]) -> list[LineString]:
    """Outlines of the parts of a hatch that are no wider than a wall; islands cut holes."""
    area = Polygon()
    for line in lines:
        if len(line.coords) > 3:
            area = area.symmetric_difference(shapely.make_valid(Polygon(line.coords)))
    parts = [part for part in shapely.get_parts(area) if isinstance(part, Polygon) and not part.is_empty]
    thin = [part for part in parts if part.buffer(-THICKEST_M / 2).is_empty]
    return [LineString(ring.coords) for part in thin for ring in (part.exterior, *part.interiors)]
