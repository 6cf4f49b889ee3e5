# SPDX-License-Identifier: MIT
"""Entities of a DXF drawing with blocks expanded, and the layers that they lie on.

In: a file. Out: visible entities with their effective layers. Owns the limits for untrusted drawings. Entities that the drawing hides (layers that
are frozen or off) and external references, which are not in the file, are reported. Of a block with a clip (XCLIP), the part inside is read.
"""

from __future__ import annotations

import io
import logging
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import shapely
from shapely.geometry import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from echostep.errors import EchostepError
from echostep_app.extras import require
from echostep_app.plan.importers.dxf.frame import paths
from echostep_app.plan.importers.parsing import read_bytes
from echostep_app.plan.importers.report import ImportReport

FLAT = 1e-3  # greatest distance of a curve from its pieces, as a share of the clip's size
BINARY = b"AutoCAD Binary DXF"
MOST_PARTS = 300_000  # entities in blocks
DEEPEST_BLOCK = 16
REMOVED = re.compile(r"Removed invalid DXF entity (\w+)\(")  # ezdxf's message on entities of an unknown kind
DELETED = re.compile(r"Deleted entity (\w+)\(")  # ezdxf's message on entities that refer to nothing


def read_drawing(file: Path, report: ImportReport) -> Any:
    """Read a drawing, repaired where ezdxf can; raises EchostepError when the file is not a drawing."""
    require(f"{file}: DXF", "ezdxf")
    from ezdxf import recover
    from ezdxf.filemanagement import readfile
    from ezdxf.lldxf.const import DXFError

    raw = read_bytes(file)
    if not raw.startswith(BINARY) and b"SECTION" not in raw:
        raise EchostepError(
            f"{file}: not a DXF drawing: {'no SECTION in it' if raw.strip() else 'it is empty'}: save it as DXF"
        )
    logging.getLogger("ezdxf").setLevel(logging.CRITICAL)  # no messages about single values; the audit counts them
    try:
        if raw.startswith(BINARY):
            drawing = readfile(str(file))
            auditor = drawing.audit()
        else:
            drawing, auditor = recover.read(io.BytesIO(raw))
    except Exception as error:  # a damaged drawing breaks ezdxf in many ways
        reason = " ".join(str(error).split())[:200] if isinstance(error, DXFError | OSError) else type(error).__name__
        raise EchostepError(f"{file}: not a DXF drawing: {reason}") from error
    if not len(drawing.modelspace()) and auditor.has_errors:
        raise EchostepError(f"{file}: the drawing is damaged: {auditor.errors[0].message[:200]}")
    for fix in auditor.fixes:
        if deleted := DELETED.search(fix.message):
            report.leave_out(f"{deleted[1][:40]} (damaged)")
        if removed := REMOVED.search(fix.message):
            report.leave_out(f"{removed[1][:40]} (object of another program)")
            report.doubt(f"{removed[1][:40]} and its like are not read: save as plain DXF (AutoCAD: -EXPORTTOAUTOCAD)")
    return drawing


class VisibleEntities:
    """The entities of a drawing's model space that are shown; iterating once reports the others.

    `references`: files that the drawing refers to but does not contain.
    """

    def __init__(self, drawing: Any, file: Path, report: ImportReport) -> None:
        self._space, self._file, self._report = drawing.modelspace(), file, report
        self._hidden = {}
        for layer in drawing.layers:
            if layer.is_frozen() or layer.is_off():
                self._hidden[str(layer.dxf.name).casefold()] = "frozen" if layer.is_frozen() else "off"
        self.references: list[str] = []

    def __call__(self, whole: Callable[[str], bool]) -> Iterator[tuple[Any, str, Sequence[str]]]:
        """Each entity with its layer, and the names of the blocks around it, the outermost first; layer "0" inside a block means the block's layer.

        Blocks are expanded unless `whole(layer)`.
        """
        stack: list[tuple[Any, str, tuple[str, ...], int, BaseGeometry | None]]
        stack = [(entity, "0", (), 0, None) for entity in reversed(list(self._space))]
        count = inserts = 0
        while stack:
            entity, outer, blocks, depth, shown = stack.pop()
            count += depth > 0
            if count > MOST_PARTS:
                raise EchostepError(f"{self._file}: its blocks have more than {MOST_PARTS} parts")
            own = str(_stated(entity, "layer", "0"))
            layer = outer if own == "0" else own
            is_block = entity.dxftype() == "INSERT"
            hidden = self._hidden.get(layer.casefold()) or ("invisible" if _stated(entity, "invisible", 0) else None)
            if hidden and not (is_block and hidden == "off"):
                self._report.leave_out(f"{entity.dxftype()} on {layer[:40]} ({hidden})")
                continue
            if is_block:
                inserts += 1
                for attribute in entity.attribs:
                    attribute.dxf.owner = f"insert {inserts}"  # those of one block name one room; copies have no owner
                    stack.append((attribute, layer, blocks, depth + 1, shown))
                if self._is_reference(entity):
                    continue
                shown = shown_of(entity, shown)
            for seen in [entity] if shown is None or is_block else clipped(entity, shown):
                yield seen, layer, blocks
            if is_block and not whole(layer):
                inner = parts(entity, self._file) if depth < DEEPEST_BLOCK else []
                around = (*blocks, str(entity.dxf.name))
                stack += [(part, layer, around, depth + 1, shown) for part in inner]
                if not inner and not entity.attribs:
                    self._report.leave_out(f"INSERT without contents on {layer[:40]}")

    def _is_reference(self, insert: Any) -> bool:
        """Whether a block is a file of its own; notes the file."""
        block = insert.block()
        path = "" if block is None else str(block.block.dxf.get("xref_path") or "")
        if not path and not (block is not None and block.block.is_xref):
            return False
        name = path.replace("\\", "/").rsplit("/", 1)[-1] or str(insert.dxf.name)
        if name not in self.references:
            self.references.append(name[:60])
        return True


def _stated(entity: Any, name: str, otherwise: Any) -> Any:
    """An attribute of an entity; `otherwise` for unknown kinds, which ezdxf keeps without attributes."""
    from ezdxf.lldxf.const import DXFError

    try:
        return entity.dxf.get(name, otherwise)
    except (AttributeError, DXFError):
        return otherwise


def parts(insert: Any, file: Path) -> list[Any]:
    """The entities of a block reference, one level deep; empty for a damaged one."""
    if insert.mcount > MOST_PARTS // 10:
        block = f"layer {insert.dxf.layer!r}: block {insert.dxf.name!r}"
        raise EchostepError(f"{file}: {block} is repeated {insert.mcount} times")
    try:
        return [
            part
            for one in (insert.multi_insert() if insert.mcount > 1 else [insert])
            for part in one.virtual_entities()
        ]
    except Exception:  # a block that refers to nothing, or to itself
        return []


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
    """The visible part of an entity: itself when it lies inside, polylines where the edge crosses it, nothing outside."""
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
