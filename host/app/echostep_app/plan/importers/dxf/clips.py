# SPDX-License-Identifier: MIT
"""Blocks of which a clip (XCLIP) shows a part.

In: block references, entities in them. Out: the area of the drawing that is shown, the parts of an entity inside it. Owns nothing.
"""

from __future__ import annotations

from typing import Any

import shapely
from shapely.geometry import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from echostep_app.plan.importers.dxf.frame import paths

FLAT = 1e-3  # greatest distance of a curve from its pieces, as a share of the clip's size


def shown_of(insert: Any, around: BaseGeometry | None) -> BaseGeometry | None:
    """The area, in drawing units, in which a block is shown; None: all of it. `around`: of the block that it is in."""
    from ezdxf.xclip import XClip

    try:
        clip = XClip(insert)
        if not clip.is_clipping_enabled:
            return around
        path = clip.get_wcs_clipping_path()
        area = _area(path.vertices)
        if path.is_inverted_clip:
            area = shapely.box(*insert_bounds(insert)).difference(_area(path.inverted_clip))
    except Exception:  # a damaged clip breaks ezdxf in many ways
        return around
    return area if around is None else area.intersection(around)


def insert_bounds(insert: Any) -> tuple[float, float, float, float]:
    """A rectangle that holds the whole block."""
    from ezdxf.bbox import extents

    box = extents([insert], fast=True)
    return box.extmin.x - 1.0, box.extmin.y - 1.0, box.extmax.x + 1.0, box.extmax.y + 1.0


def _area(corners: Any) -> BaseGeometry:
    return shapely.make_valid(Polygon([(corner.x, corner.y) for corner in corners]))


def clipped(entity: Any, shown: BaseGeometry) -> list[Any]:
    """What is shown of an entity: itself when it lies inside, polylines where the edge crosses it, nothing outside."""
    from ezdxf.entities import factory

    try:
        lines = _lines(entity, shown)
    except Exception:  # an entity without a line, or a damaged one
        lines = []
    if not lines:
        at = entity.dxf.get("insert") if entity.dxf.is_supported("insert") else None
        return [entity] if at is None or shown.covers(Point(at.x, at.y)) else []
    if all(map(shown.covers, lines)):
        return [entity]
    inside = [
        part for line in lines for part in shapely.get_parts(line.intersection(shown)) if isinstance(part, LineString)
    ]
    pieces = []
    for part in inside:
        piece: Any = factory.new("LWPOLYLINE", {"layer": entity.dxf.layer})
        piece.append_points(list(part.coords), format="xy")
        pieces.append(piece)
    return pieces


def _lines(entity: Any, shown: BaseGeometry) -> list[LineString]:
    x0, y0, x1, y1 = shown.bounds
    flat = FLAT * max(x1 - x0, y1 - y0)
    rows = [[(p.x, p.y) for p in path.flattening(flat)] for path in paths(entity)]
    return [LineString(row) for row in rows if len(set(row)) > 1]
