# SPDX-License-Identifier: MIT
"""Shapes of a model's elements as triangles, and their sections.

In: a model. Out: `SolidBody`s. Owns nothing. Elements without a usable shape are reported.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry import MultiPoint, Polygon

from echostep.arrays import Floats, Ints
from echostep.errors import EchostepError
from echostep.fields import LIMIT_M
from echostep_app.plan.georeference import grid_origin
from echostep_app.plan.importers.drawn_level import areas
from echostep_app.plan.importers.report import ImportReport

SAMPLES = 20  # walls that decide the origin


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


class Shapes:
    """Makes the bodies of elements, in the model's world coordinates in metres, from `origin_m` on."""

    def __init__(self, path: Path) -> None:
        self._geometry: Any = import_module("ifcopenshell.geom")
        self._settings = self._geometry.settings()
        self._settings.set("use-world-coords", True)
        self._path = path
        self.origin_m = (0.0, 0.0)

    def body(self, element: Any) -> SolidBody | None:
        """The body of an element; None when it has no usable shape."""
        if getattr(element, "Representation", None) is None:
            return None
        try:
            corners, faces = self._triangles(element)
        except RuntimeError:
            return None
        if not len(corners) or not len(faces):
            return None
        corners[:, :2] -= self.origin_m
        if not (np.abs(corners) <= LIMIT_M).all():
            where = f"{self._path}: {element.is_a()} #{element.id()}"
            raise EchostepError(f"{where}: further than {LIMIT_M / 1000:.0f} km from the origin")
        return SolidBody(element, corners, faces)

    def _triangles(self, element: Any) -> tuple[Floats, Ints]:
        """Corners (n, 3) in the model's own coordinates, and triangles (m, 3); raises RuntimeError for a shape that cannot be made."""
        shape = self._geometry.create_shape(self._settings, element).geometry
        faces = np.array(shape.faces, dtype=np.int64)
        return np.array(shape.verts, dtype=np.float64).reshape(-1, 3), faces.reshape(-1, 3)

    def find_origin(self, elements: list[Any]) -> None:
        """The origin by some of the elements, where these lie in a national grid."""
        points = []
        for element in elements[:: max(1, len(elements) // SAMPLES)]:
            with suppress(RuntimeError):
                points += [corner[:2] for corner in self._triangles(element)[0][:1]]
        self.origin_m = grid_origin(np.array(points).reshape(-1, 2))

    def bodies(self, elements: Iterable[Any], report: ImportReport) -> Iterator[SolidBody]:
        """Bodies of elements; without a shape, the bodies of their parts (elemented walls) or of the opening that they fill. Others are reported."""
        for element in elements:
            body = self.body(element)
            parts = [child for child in parts_of(element) if child.is_a("IfcBuildingElementPart")]
            holes = [relation.RelatingOpeningElement for relation in getattr(element, "FillsVoids", ())]
            whole = [body] if body else [part for one in (*parts, *holes) if (part := self.body(one))]
            yield from (SolidBody(element, part.corners, part.faces) for part in whole)
            if not whole and not parts_of(element):
                report.leave_out(f"{element.is_a()} without a shape")


def parts_of(element: Any) -> list[Any]:
    """The elements that an element is made of."""
    return [part for relation in element.IsDecomposedBy for part in relation.RelatedObjects]


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
