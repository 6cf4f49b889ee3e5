# SPDX-License-Identifier: MIT
"""Entities of a DXF drawing with blocks expanded, and their lines in metres.

In: a file. Out: entities with their effective layers; polylines. Owns the limits for untrusted drawings.
"""

from __future__ import annotations

import io
import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry import LineString

from echostep.errors import EchostepError
from echostep.extras import require
from echostep.plan.importers.parsing import read_bytes
from echostep.plan.json_fields import LIMIT_M

METRES = {"mm": 0.001, "cm": 0.01, "m": 1.0, "in": 0.0254, "ft": 0.3048}
FLAT_M = 0.005  # greatest distance of an arc from the straight pieces that replace it
FAR_M = 1e4  # larger coordinates are of a national grid: the origin is then moved to the first wall
STRAY_M = 1e8  # a line beyond is no building, in whatever grid: twice around the Earth
STRAY = LineString([(0.0, 0.0), (STRAY_M, 0.0)])  # in the place of a line beyond
MOST_PARTS = 300_000  # entities in blocks
DEEPEST_BLOCK = 16


@dataclass(frozen=True, slots=True)
class DrawingFrame:
    """Drawing units -> map metres."""

    scale_m: float
    x0_m: float = 0.0
    y0_m: float = 0.0

    @classmethod
    def about(cls, walls: Sequence[Any], scale_m: float) -> DrawingFrame:
        """The drawing's own origin, or the first wall's position in whole metres when the drawing is in a national grid."""
        line = next((line for entity in walls if (line := cls(scale_m).raw(entity))), None)
        if line is None or np.abs(shapely.get_coordinates(line)).max() < FAR_M:
            return cls(scale_m)
        x, y = np.floor(shapely.get_coordinates(line)[0])
        return cls(scale_m, float(x), float(y))

    def metres(self, point: Any) -> tuple[float, float]:
        """A point of the drawing in map metres."""
        return float(point.x) * self.scale_m - self.x0_m, float(point.y) * self.scale_m - self.y0_m

    def raw(self, entity: Any) -> LineString | None:
        """The entity as a polyline in metres, `STRAY` for one that no building has; None for an entity without a line."""
        from ezdxf import path
        from ezdxf.lldxf.const import DXFError

        try:
            if not abs(float(getattr(entity.dxf, "radius", 0.0))) * self.scale_m <= STRAY_M:
                return STRAY
            drawn = path.make_path(entity)
            ends = np.array([self.metres(p) for p in drawn.control_vertices()])
            if len(ends) and not np.abs(ends).max() <= STRAY_M:  # its pieces could not be counted
                return STRAY
            points = [self.metres(p) for p in drawn.flattening(FLAT_M / self.scale_m)]
        except (TypeError, ValueError, ArithmeticError, IndexError, AttributeError, DXFError):
            return None
        return LineString(points) if len(set(points)) > 1 and np.isfinite(points).all() else None

    def line(self, entity: Any, file: Path) -> LineString | None:
        """As `raw`; raises EchostepError when the line is beyond the limit of plans."""
        line = self.raw(entity)
        if line is not None and np.abs(shapely.get_coordinates(line)).max() > LIMIT_M:
            raise EchostepError(
                f"{file}: layer {entity.dxf.layer!r}: {entity.dxftype()} is {LIMIT_M / 1000:.0f} km away: other units, or a stray line?"
            )
        return line


def read_drawing(file: Path) -> Any:
    """Read a drawing, repaired where ezdxf can; raises EchostepError when the file is not a drawing."""
    require(f"{file}: DXF", "ezdxf")
    from ezdxf import recover
    from ezdxf.lldxf.const import DXFError

    raw = read_bytes(file)
    logging.getLogger("ezdxf").setLevel(logging.CRITICAL)  # no messages about single values; the audit counts them
    try:
        drawing, auditor = recover.read(io.BytesIO(raw))
    except Exception as error:  # a damaged drawing breaks ezdxf in many ways
        reason = " ".join(str(error).split())[:200] if isinstance(error, DXFError | OSError) else type(error).__name__
        raise EchostepError(f"{file}: not a DXF drawing: {reason}") from error
    if not len(drawing.modelspace()) and auditor.has_errors:
        raise EchostepError(f"{file}: the drawing is damaged: {auditor.errors[0].message[:200]}")
    return drawing


def entities(space: Any, file: Path, whole: Callable[[str], bool]) -> Iterator[tuple[Any, str]]:
    """Each entity with its layer; layer "0" inside a block means the block's layer. Blocks are expanded unless `whole(layer)`."""
    stack = [(entity, "0", 0) for entity in reversed(list(space))]
    count = 0
    while stack:
        entity, outer, depth = stack.pop()
        count += depth > 0
        if count > MOST_PARTS:
            raise EchostepError(f"{file}: its blocks have more than {MOST_PARTS} parts")
        own = _layer_of(entity)
        layer = outer if own == "0" else own
        yield entity, layer
        if entity.dxftype() == "INSERT":
            stack += [(attribute, layer, depth + 1) for attribute in entity.attribs]
        if entity.dxftype() == "INSERT" and depth < DEEPEST_BLOCK and not whole(layer):
            stack += [(part, layer, depth + 1) for part in parts(entity, file)]


def _layer_of(entity: Any) -> str:
    """The layer of an entity; "0" for one of an unknown kind, which ezdxf keeps without attributes."""
    from ezdxf.lldxf.const import DXFError

    try:
        return str(entity.dxf.layer)
    except (AttributeError, DXFError):
        return "0"


def parts(insert: Any, file: Path) -> list[Any]:
    """The entities of a block reference, one level deep; empty for a damaged one."""
    if insert.mcount > MOST_PARTS // 10:
        raise EchostepError(
            f"{file}: layer {insert.dxf.layer!r}: block {insert.dxf.name!r} is repeated {insert.mcount} times"
        )
    try:
        return [
            part
            for one in (insert.multi_insert() if insert.mcount > 1 else [insert])
            for part in one.virtual_entities()
        ]
    except Exception:  # a block that refers to nothing, or to itself
        return []
