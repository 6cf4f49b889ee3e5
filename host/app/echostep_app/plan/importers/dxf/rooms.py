# SPDX-License-Identifier: MIT
"""Rooms of a drawing: names in the middle of their texts, and closed outlines.

In: entities on the layers of rooms. Out: `Room`s. Owns the least area of an outline.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import shapely
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
INDENT, NEXT_LINE = 0.5, 2.5  # of a line from the one above it, in heights of letters; assumed
LETTER = 0.8  # width of a letter and the gap beside it, of its height, in any font: Arial's are 0.7, those of simplex 0.9; assumed
MEASURE = re.compile(r"\W*\d[\d.,'x× ]*[.,]\d+\.?$")
UNIT = r"(?:mm|cm|m|m2|m²|qm|sqm|sq ?ft|sf|['\"])"
KINDS = r"(?:[AFHUP]|NGF|BGF|[LR]H|[OU]K\w*)"  # areas, perimeters and heights, in English and German
# What is no name on any layer
SIZE = re.compile(
    rf"\W*(?:{KINDS} ?[=:] ?[+±-]?\d[\d.,]*(?: ?{UNIT})?|\d[\d.,'x× ]*{UNIT}|(?<=[+±])\d[\d.,]*)\W*", re.IGNORECASE
)
# In the tag of an attribute: what is no name, what is one, and what is a part of one
SIZES = re.compile("AREA|FLAE|FLÄ|SURF|SUPERF|HEIGHT|HOEHE|HÖHE|PERI|UMF|DEP|FINIS|BELAG|BODEN", re.IGNORECASE)
NAME, PART = (re.compile("NAME|NOM|DESC|BEZ|NUTZ" + number, re.IGNORECASE) for number in ("", "|NUM|NR|^NO|NO$"))
TEXTS = ("TEXT", "MTEXT", "ATTRIB")


class Written(NamedTuple):
    """A text as a room at its middle, the point (map m) that it is aligned about, height (m) and direction (rad) of its letters.

    `what`: its name in the list of omissions; `block`, `tag`: an attribute's.
    """

    room: Room
    about_m: tuple[float, float]
    height_m: float
    turn: float
    what: str
    block: str = ""
    tag: str = ""

    def read_at(self) -> tuple[float, float]:
        """Its place along and across the direction of reading."""
        x, y, c, s = *self.about_m, math.cos(self.turn), math.sin(self.turn)
        return c * x + s * y, c * y - s * x


def rooms_of(
    entities: Sequence[tuple[Any, str]], frame: DrawingFrame, file: Path, report: ImportReport, texts: list[Written]
) -> list[Room]:
    """A room for each text, with the smallest outline around it, and for each outline without one, named by enclosed `texts` of other layers."""
    names: dict[tuple[str, tuple[float, float]], Written] = {}  # one of each that is drawn twice
    outlines: list[Polygon] = []
    for entity, layer in entities:
        named = written(entity, layer, frame)
        rings = (Polygon(line.coords) for line in frame.lines(entity, file) if line.is_closed)
        large = [area for area in areas(rings) if area.area >= LEAST_M2]
        if named:
            names[named.room.name, named.room.at_m] = named
        outlines += large
        if not named and not large:
            report.leave_out(f"{entity.dxftype()} on {layer[:40]}")
        else:
            report.use("rooms", layer)
    chosen = names_of_blocks([*names.values()])
    report.leave_out("ATTRIB beside a room's name", len(names) - len(chosen))
    return _matched(chosen, outlines, texts, report)


def names_of_blocks(texts: Sequence[Written]) -> list[Written]:
    """Texts without a block's attributes other than those that its tags call name and number."""
    named = {text.block for text in texts if NAME.search(text.tag)}
    return [text for text in texts if text.block not in named or PART.search(text.tag)]


def _matched(names: list[Written], outlines: list[Polygon], texts: list[Written], report: ImportReport) -> list[Room]:
    """Each outline gets the texts inside it that no smaller outline has; one without a text is numbered, if it holds less than two others."""
    left, rooms, seen = list(names), [], list[Point]()
    for outline in sorted({area.normalize(): area for area in outlines}.values(), key=lambda area: area.area):
        own = [name for name in left if outline.intersects(Point(name.room.at_m))]
        left = [name for name in left if name not in own]
        others = [text for text in texts if outline.intersects(Point(text.room.at_m))]
        inside = [name.room for name in own] or _names_of(others, report)
        if inside or shapely.covers(outline, seen).sum() < 2:
            rooms.append(room(" ".join(name.name for name in inside)[:80], outline))
        seen.append(outline.representative_point())
    numbered = [one if one.name else Room(f"room {k}", one.at_m, one.outline_m) for k, one in enumerate(rooms, 1)]
    return [*_stamps(left, report), *numbered]


def _stamps(texts: Sequence[Written], report: ImportReport) -> list[Room]:
    """Texts beneath each other, or in one block, as lines of one room's name; of these, smaller letters and measures are none."""
    texts = sorted(texts, key=lambda one: (-one.read_at()[1], one.read_at()[0]))
    places = shapely.points(np.array([text.room.at_m for text in texts]).reshape(-1, 2))
    tree, reach_m = shapely.STRtree(places), 2.0 * NEXT_LINE * max((text.height_m for text in texts), default=0.0)
    stamps: dict[int, list[Written]] = {}  # by the number of each text
    blocks: dict[str, list[Written]] = {}
    for k, (text, place) in enumerate(zip(texts, places, strict=True)):
        near = (stamps[i] for i in tree.query(place, predicate="dwithin", distance=reach_m) if i < k)
        above = (stamp for stamp in near if _follows(text, stamp[-1]))
        below = min(above, key=lambda stamp: stamp[-1].read_at()[1], default=[])
        stamps[k] = blocks.setdefault(text.block, below) if text.block else below
        stamps[k].append(text)
    rooms = []
    for stamp in {id(stamp): stamp for stamp in stamps.values()}.values():
        least_m = SAME_HEIGHT * max(one.height_m for one in stamp)
        large = [text for text in stamp if text.height_m >= least_m or PART.search(text.tag)]
        lines = [text for text in large if text is large[0] or not MEASURE.match(text.room.name)]
        rooms.append(Room(" ".join(line.room.name for line in lines)[:80], lines[0].room.at_m))
        for text in stamp:
            report.leave_out(text.what, text not in lines)
    return rooms


def _follows(text: Written, last: Written) -> bool:
    """Whether a text is the next line below another one."""
    (a, b), (c, d), height = text.read_at(), last.read_at(), max(text.height_m, last.height_m)
    return abs(a - c) <= INDENT * height and 0.0 < d - b <= NEXT_LINE * height and abs(text.turn - last.turn) < 0.01


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
        if face != OUTSIDE and face not in spaces.hollow:
            rooms += _names_of(inside, report)
    return rooms


def _names_of(texts: Sequence[Written], report: ImportReport) -> list[Room]:
    """Names in a space, each of lines beneath each other: its largest letters; measures are no names."""
    words = [text for text in texts if not MEASURE.match(text.room.name)]
    largest = SAME_HEIGHT * max((text.height_m for text in words), default=0.0)
    lines = [text for text in words if text.height_m >= largest]
    for line in lines:
        report.take_back(line.what)
    return _stamps(lines, report)


def written(entity: Any, layer: str, frame: DrawingFrame) -> Written | None:
    """A text of any layer; None when it is empty, a size, far away, or not a text."""
    kind = entity.dxftype()
    if kind not in TEXTS or (kind == "ATTRIB" and (entity.is_invisible or SIZES.search(entity.dxf.tag))):
        return None
    lines = [line for line in entity.plain_text().replace("\\~", " ").splitlines() if not SIZE.fullmatch(line)]
    words = " ".join(" ".join(lines).split())[:80]
    height = float(entity.dxf.get("char_height" if kind == "MTEXT" else "height", 0.0))
    try:
        about, middle, turn = _placed(entity, height)
    except ArithmeticError:  # axes without a direction, sizes beyond all numbers
        about, middle, turn = entity.dxf.insert, entity.dxf.insert, 0.0
    x, y = frame.metres(middle)
    if not words or not max(abs(x), abs(y)) < LIMIT_M:
        return None
    named = Room(words, (round(x, 3), round(y, 3)))
    block, tag = (entity.dxf.owner, entity.dxf.tag) if kind == "ATTRIB" else ("", "")
    return Written(named, frame.metres(about), height * frame.scale_m, turn, f"{kind} on {layer[:40]}", block, tag)


def _placed(entity: Any, height: float) -> tuple[Any, Any, float]:
    """The point that a text is aligned about and the middle of its extent, in the drawing's units, and its direction (rad)."""
    from ezdxf.fonts.fonts import MonospaceFont
    from ezdxf.math import UCS, Vec3
    from ezdxf.tools.text import estimate_mtext_content_extents, unified_alignment

    dxf, (across, up) = entity.dxf, unified_alignment(entity)
    if entity.dxftype() == "MTEXT":
        own, column, font = entity.ucs(), dxf.get("width", 0.0), MonospaceFont(height, LETTER)
        column = column if column > height else 0.0
        wide, high = estimate_mtext_content_extents(entity.text, font, column, dxf.get_default("line_spacing_factor"))
    else:
        _, about, end = entity.get_placement()
        wide, high = len(entity.plain_text()) * height * LETTER * dxf.get_default("width"), height
        ocs, end = entity.ocs(), about if end is None else end
        line = Vec3.from_deg_angle(dxf.get("rotation", 0.0)) if end.isclose(about) else end - about
        own = UCS(ocs.to_wcs(about.lerp(end)), ocs.to_wcs(line), uz=dxf.extrusion)
    middle = own.to_wcs(Vec3((1 - across) * wide / 2, (1, 1, 0, -1, 0)[up] * high / 2))
    return own.origin, middle, math.atan2(-own.uy.x, own.uy.y)
