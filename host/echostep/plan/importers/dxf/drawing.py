# SPDX-License-Identifier: MIT
"""Drawings (DXF, one file per level) -> `Plan`.

In: files, patterns of layer names, units. Out: `Plan`. Owns the default patterns. Lines, polylines, arcs, circles, ellipses and splines on a layer of
walls become walls, also inside blocks; the meaning of a layer is recognised by its name.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, cast

import shapely
from shapely.geometry import LineString, MultiLineString

from echostep.errors import EchostepError
from echostep.plan.importers.connector_shapes import join_connectors
from echostep.plan.importers.drawn_level import ConnectorShape, DrawnLevel, areas
from echostep.plan.importers.dxf.doors import doors_of
from echostep.plan.importers.dxf.entities import METRES, DrawingFrame, entities, read_drawing
from echostep.plan.json_fields import LIMIT_M
from echostep.plan.model import ConnectorKind, Plan, Room

LAYERS: dict[str, tuple[str, ...]] = {
    "walls": ("*wall*", "*wand*", "*waend*", "*wände*", "*mur*", "*cols*", "*column*"),
    "windows": ("*wind*", "*glaz*", "*fenster*"),
    "doors": ("*door*", "*tür*", "*tuer*"),
    "stairs": ("*stair*", "*strs*", "*trepp*"),
    "lifts": ("*lift*", "*elev*", "*aufzug*"),
    "rooms": ("*room*", "*raum*", "*space*", "*area-iden*", "*name*"),
    "obstacles": ("*obstacle*", "*hindernis*"),
}
INSUNITS = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m"}
HALF_TREAD_M = 0.3  # half the greatest distance between neighbouring lines of one staircase: a tread


def import_dxf(
    files: Sequence[Path], storey_height_m: float, layers: Mapping[str, Sequence[str]], units: str | None
) -> Plan:
    """Import a building from drawings, the lowest level first; raises EchostepError that names the file and the layer."""
    patterns = {kind: tuple(name.casefold() for name in (layers.get(kind) or LAYERS[kind])) for kind in LAYERS}
    drawn_levels, frame = [], None
    for i, file in enumerate(files):
        drawing = read_drawing(file)
        entities = _sorted(drawing, patterns, file)
        scale_m = METRES[units or _units(drawing, file)]
        frame = replace(frame, scale_m=scale_m) if frame else DrawingFrame.about(entities["walls"], scale_m)
        drawn_levels.append(_drawn_level(entities, frame, DrawnLevel(file.stem, round(i * storey_height_m, 6)), file))
    return Plan(files[0].stem, tuple(drawn.level() for drawn in drawn_levels), None, "", join_connectors(drawn_levels))


def _sorted(drawing: Any, patterns: Mapping[str, Sequence[str]], file: Path) -> dict[str, list[Any]]:
    """Entities by the meaning of their layers; raises EchostepError when there are no walls."""
    by_kind: dict[str, list[Any]] = {kind: [] for kind in patterns}
    seen: dict[str, str | None] = {}
    for entity, layer in entities(drawing.modelspace(), file, lambda layer: meaning(layer, patterns) == "doors"):
        if layer not in seen:
            seen[layer] = meaning(layer, patterns)
        kind = seen[layer]
        if kind is not None:
            by_kind[kind].append(entity)
    if not by_kind["walls"]:
        known = ", ".join(sorted(seen)[:20]) or "none"
        raise EchostepError(
            f"{file}: nothing on a layer named {' or '.join(patterns['walls'])}; give --layer walls=NAME; layers: {known[:400]}"
        )
    return by_kind


def meaning(layer: str, patterns: Mapping[str, Sequence[str]]) -> str | None:
    """The kind of element on a layer of this name; None when the name matches no pattern."""
    name = layer.casefold()
    return next(
        (kind for kind, names in patterns.items() if any(fnmatchcase(name, pattern) for pattern in names)), None
    )


def _units(drawing: Any, file: Path) -> str:
    try:
        code = int(drawing.header.get("$INSUNITS", 0))
    except (TypeError, ValueError):
        code = 0
    if code not in INSUNITS:
        raise EchostepError(
            f"{file}: the drawing does not say its units ($INSUNITS is {code}): give --units {'|'.join(METRES)}"
        )
    return INSUNITS[code]


def _drawn_level(entities: Mapping[str, list[Any]], frame: DrawingFrame, drawn: DrawnLevel, file: Path) -> DrawnLevel:
    lines = {
        kind: [line for entity in entities[kind] if (line := frame.line(entity, file))]
        for kind in entities
        if kind not in ("doors", "rooms")
    }
    if not lines["walls"]:
        raise EchostepError(f"{file}: the layers of walls have no lines: give the right ones with --layer walls=NAME")
    drawn.walls, drawn.windows = list(lines["walls"]), list(lines["windows"])
    drawn.doors = doors_of(entities["doors"], [*drawn.walls, *drawn.windows], frame, file)
    drawn.obstacles = areas(shapely.get_parts(shapely.polygonize(_noded(lines["obstacles"]))))
    drawn.rooms = [room for entity in entities["rooms"] if (room := _room(entity, frame))]
    for kind, layer in (("stairs", "stairs"), ("lift", "lifts")):
        blots = shapely.union_all([line.buffer(HALF_TREAD_M) for line in lines[layer]])
        hulls = [blot.convex_hull.buffer(-HALF_TREAD_M) for blot in shapely.get_parts(blots)]
        drawn.connectors += [ConnectorShape(cast(ConnectorKind, kind), "", area) for area in areas(hulls)]
    return drawn


def _room(entity: Any, frame: DrawingFrame) -> Room | None:
    """A text entity as a room; None when it is empty, far away, or not a text."""
    if entity.dxftype() not in ("TEXT", "MTEXT", "ATTRIB"):
        return None
    words = " ".join((entity.plain_text() if entity.dxftype() == "MTEXT" else entity.dxf.text).split())[:80]
    x, y = frame.metres(entity.dxf.insert)
    return Room(words, (round(x, 3), round(y, 3))) if words and max(abs(x), abs(y)) < LIMIT_M else None


def _noded(lines: list[LineString]) -> list[Any]:
    return list(shapely.get_parts(shapely.node(MultiLineString(lines)))) if lines else []
