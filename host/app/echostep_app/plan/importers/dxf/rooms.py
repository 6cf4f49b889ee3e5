# SPDX-License-Identifier: MIT
"""Rooms of a drawing: names where their texts are written, and closed outlines.

In: entities on the layers of rooms. Out: `Room`s. Owns the least area of an outline.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from shapely.geometry import Point, Polygon

from echostep.fields import LIMIT_M
from echostep.plan import Plan, Room
from echostep_app.plan.importers.drawn_level import areas, room
from echostep_app.plan.importers.dxf.frame import DrawingFrame
from echostep_app.plan.importers.report import ImportReport
from echostep_app.plan.places.faces import OUTSIDE
from echostep_app.plan.places.spaces import find_spaces

LEAST_M2 = 1.0  # smaller closed lines are frames of texts, symbols, furniture; assumed
SAME_HEIGHT = 0.8  # ratio of letters to the largest ones in a room, down to which they belong to its name; assumed
MEASURE = re.compile(r"\W*\d[\d.,'x× ]*[.,]\d+\.?$")
UNIT = r"(?:mm|cm|m|m2|m²|qm|sqm|sq ?ft|sf|['\"])"
KINDS = r"(?:[AFHUP]|NGF|BGF|[LR]H|[OU]K\w*)"  # areas, perimeters and heights, in English and German
# What is no name on any layer
SIZE = re.compile(
    rf"\W*(?:{KINDS} ?[=:] ?[+±-]?\d[\d.,]*(?: ?{UNIT})?|\d[\d.,'x× ]*{UNIT}|(?<=[+±])\d[\d.,]*)\W*", re.IGNORECASE
)
SIZES = re.compile("AREA|FLAE|FLÄ|SUPERF|SURF|HEIGHT|HOEHE|HÖHE", re.IGNORECASE)  # in the tag of an attribute
TEXTS = ("TEXT", "MTEXT", "ATTRIB")


class Written(NamedTuple):
    """A text as a room, the height of its letters (m), and what it is called where it is left out."""

    room: Room
    height_m: float
    what: str


def rooms_of(
    entities: Sequence[tuple[Any, str]], frame: DrawingFrame, file: Path, report: ImportReport, texts: Sequence[Written]
) -> list[Room]:
    """A room for each text, with the smallest outline around it, and for each outline without one, named by the `texts` of other layers in it."""
    names: dict[tuple[str, tuple[float, float]], Room] = {}  # one of each that is drawn twice
    outlines: list[Polygon] = []
    for entity, layer in entities:
        named = _named(entity, frame)
        closed = [
            area for line in frame.lines(entity, file) if line.is_closed for area in areas([Polygon(line.coords)])
        ]
        large = [area for area in closed if area.area >= LEAST_M2]
        if named:
            names[named.name, named.at_m] = named
        outlines += large
        if not named and not large:
            report.leave_out(f"{entity.dxftype()} on {layer[:40]}")
        else:
            report.use("rooms", layer)
    return _matched([*names.values()], outlines, texts, report)


def _matched(names: list[Room], outlines: list[Polygon], texts: Sequence[Written], report: ImportReport) -> list[Room]:
    """Each outline gets the texts inside it that no smaller outline has; an outline without a text is numbered."""
    left, rooms = list(names), []
    for outline in sorted(outlines, key=lambda area: area.area):
        inside = [name for name in left if outline.intersects(Point(name.at_m))]
        left = [name for name in left if name not in inside]
        inside = inside or _lines_of([text for text in texts if outline.intersects(Point(text.room.at_m))], report)
        rooms.append(room(" ".join(name.name for name in inside)[:80], outline))
    numbered = [one if one.name else Room(f"room {k}", one.at_m, one.outline_m) for k, one in enumerate(rooms, 1)]
    return [*left, *numbered]


def named_spaces(plan: Plan, level_index: int, texts: Sequence[Written], report: ImportReport) -> list[Room]:
    """The enclosed spaces of a level by the texts inside them, where no layer is named for rooms."""
    spaces = find_spaces(plan, level_index) if texts else None
    if spaces is None:
        return []
    by_face: dict[int, list[Written]] = {}
    for text in texts:
        by_face.setdefault(spaces.face_at(*text.room.at_m), []).append(text)
    rooms = []
    for face, inside in sorted(by_face.items()):
        if face != OUTSIDE and face not in spaces.hollow and (lines := _lines_of(inside, report)):
            rooms.append(Room(" ".join(line.name for line in lines)[:80], lines[0].at_m))
    return rooms


def _lines_of(texts: Sequence[Written], report: ImportReport) -> list[Room]:
    """The lines of a room's name, from the top: its largest letters; measures are no names."""
    words = [text for text in texts if not MEASURE.match(text.room.name)]
    largest = SAME_HEIGHT * max((text.height_m for text in words), default=0.0)
    lines = [text for text in words if text.height_m >= largest]
    for line in lines:
        report.take_back(line.what)
    return sorted((line.room for line in lines), key=lambda one: (-one.at_m[1], one.at_m[0]))


def written(entity: Any, layer: str, frame: DrawingFrame) -> Written | None:
    """A text of any layer; None when the entity is no text."""
    named = _named(entity, frame)
    height = entity.dxf.get("char_height" if entity.dxftype() == "MTEXT" else "height", 0.0) if named else 0.0
    return Written(named, float(height) * frame.scale_m, f"{entity.dxftype()} on {layer[:40]}") if named else None


def _named(entity: Any, frame: DrawingFrame) -> Room | None:
    """A text entity as a room; None when it is empty, a size, far away, or not a text."""
    if entity.dxftype() not in TEXTS or (
        entity.dxftype() == "ATTRIB" and (entity.is_invisible or SIZES.search(entity.dxf.tag))
    ):
        return None
    lines = [line for line in entity.plain_text().splitlines() if not SIZE.fullmatch(line)]
    words = " ".join(" ".join(lines).split())[:80]
    x, y = frame.metres(entity.dxf.insert if entity.dxftype() == "MTEXT" else entity.ocs().to_wcs(entity.dxf.insert))
    return Room(words, (round(x, 3), round(y, 3))) if words and max(abs(x), abs(y)) < LIMIT_M else None
