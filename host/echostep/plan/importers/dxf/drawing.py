"""Drawings (DXF, one a storey) -> `Plan`.

In: files, patterns of layers, units. Out: `Plan`. Lines, polylines, arcs, circles, ellipses and splines on a layer of walls become walls, also those
inside blocks; what a layer means is told by its name.
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
from echostep.plan.importers.dxf.doors import doors_of
from echostep.plan.importers.dxf.entities import METRES, DrawingFrame, entities, read_drawing
from echostep.plan.importers.storey import Storey, Way, areas
from echostep.plan.importers.walkways import connect
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
REACH_M = 0.3  # lines of one staircase are so near to each other, twice


def import_dxf(files: Sequence[Path], storey_m: float, layers: Mapping[str, Sequence[str]], units: str | None) -> Plan:
    """The building of drawings, the lowest storey first; raises EchostepError that names the file and the layer."""
    patterns = {kind: tuple(name.casefold() for name in (layers.get(kind) or LAYERS[kind])) for kind in LAYERS}
    storeys, frame = [], None
    for i, file in enumerate(files):
        drawing = read_drawing(file)
        found = _sorted(drawing, patterns, file)
        scale_m = METRES[units or _units(drawing, file)]
        frame = replace(frame, scale_m=scale_m) if frame else DrawingFrame.about(found["walls"], scale_m)
        storeys.append(_storey(found, frame, Storey(file.stem, round(i * storey_m, 6)), file))
    return Plan(files[0].stem, tuple(storey.level() for storey in storeys), None, "", connect(storeys))


def _sorted(drawing: Any, patterns: Mapping[str, Sequence[str]], file: Path) -> dict[str, list[Any]]:
    """Entities by what their layers mean."""
    found: dict[str, list[Any]] = {kind: [] for kind in patterns}
    seen: dict[str, str | None] = {}
    for entity, layer in entities(drawing.modelspace(), file, lambda layer: meaning(layer, patterns) == "doors"):
        if layer not in seen:
            seen[layer] = meaning(layer, patterns)
        kind = seen[layer]
        if kind is not None:
            found[kind].append(entity)
    if not found["walls"]:
        known = ", ".join(sorted(seen)[:20]) or "none"
        raise EchostepError(
            f"{file}: nothing on a layer named {' or '.join(patterns['walls'])}; give --layer walls=NAME; layers: {known[:400]}"
        )
    return found


def meaning(layer: str, patterns: Mapping[str, Sequence[str]]) -> str | None:
    """What a layer of this name holds, None if nothing that a plan has."""
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


def _storey(found: Mapping[str, list[Any]], frame: DrawingFrame, storey: Storey, file: Path) -> Storey:
    lines = {
        kind: [line for entity in found[kind] if (line := frame.line(entity, file))]
        for kind in found
        if kind not in ("doors", "rooms")
    }
    if not lines["walls"]:
        raise EchostepError(f"{file}: the layers of walls hold no lines")
    storey.walls, storey.windows = list(lines["walls"]), list(lines["windows"])
    storey.doors = doors_of(found["doors"], [*storey.walls, *storey.windows], frame, file)
    storey.obstacles = areas(shapely.get_parts(shapely.polygonize(_noded(lines["obstacles"]))))
    storey.rooms = [room for entity in found["rooms"] if (room := _room(entity, frame))]
    for kind, layer in (("stairs", "stairs"), ("lift", "lifts")):
        blots = shapely.union_all([line.buffer(REACH_M) for line in lines[layer]])
        hulls = [blot.convex_hull.buffer(-REACH_M) for blot in shapely.get_parts(blots)]
        storey.ways += [Way(cast(ConnectorKind, kind), "", area) for area in areas(hulls)]
    return storey


def _room(entity: Any, frame: DrawingFrame) -> Room | None:
    """A text as the name of a room."""
    if entity.dxftype() not in ("TEXT", "MTEXT", "ATTRIB"):
        return None
    words = " ".join((entity.plain_text() if entity.dxftype() == "MTEXT" else entity.dxf.text).split())[:80]
    x, y = frame.metres(entity.dxf.insert)
    return Room(words, (round(x, 3), round(y, 3))) if words and max(abs(x), abs(y)) < LIMIT_M else None


def _noded(lines: list[LineString]) -> list[Any]:
    return list(shapely.get_parts(shapely.node(MultiLineString(lines)))) if lines else []
