# SPDX-License-Identifier: MIT
"""One drawing file, its entities sorted by the kind of their layers and by the storeys that are drawn over each other, and its scale.

In: a file, hints. Out: `Sheet`s. Owns when a drawing is refused for its layers, and by what its storeys are told apart.
"""

from __future__ import annotations

import math
import shlex
from bisect import bisect_right
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

from shapely.geometry import LineString

from echostep.errors import EchostepError
from echostep_app.plan.importers.dxf.entities import VisibleEntities, read_drawing
from echostep_app.plan.importers.dxf.frame import METRES, DrawingFrame
from echostep_app.plan.importers.dxf.layers import BESIDE, WAYS, faces_m, matches, meaning, patterns_of
from echostep_app.plan.importers.dxf.measures import lengths_of
from echostep_app.plan.importers.dxf.storeys import bounds_of, drawn_over, has_room, window_words
from echostep_app.plan.importers.dxf.units import likely_unit, scale_of, stated_unit
from echostep_app.plan.importers.report import Hints, ImportReport
from echostep_app.plan.importers.storey_names import StoreyName, storey_of

MOST_MORE = 3.0  # ratio of wall-like lines on other layers to the walls used, from which the import asks; assumed
MOST_NAMES = 20  # of layers in an error
MOST_STOREYS = 200  # over each other
LEAST_STOREY_M = 2.0  # of a floor from the one below; assumed
TOUCH_M = 0.05  # of the head of a wall from what stands on it; assumed
Layered = list[tuple[Any, str]]  # entities with their layers


@dataclass(frozen=True, slots=True)
class Sheet:
    """`kinds`: entities by the meaning of their layers; `others`: those on layers without one.

    `alike`: other layers that look like walls. `unit`: as the file states it; None if missing, or if hints overrule it. `named`: the storeys that
    layers or blocks name, by the entities' ids. `storey`: the words for this one, `height_m`: of its walls, where it is one of several.
    """

    file: Path
    kinds: Mapping[str, Layered]
    others: Layered
    scale_m: float
    words: str
    unit: str | None
    alike: tuple[str, ...] = ()
    named: Mapping[int, StoreyName] = field(default_factory=dict)
    storey: str = ""
    height_m: float | None = None

    @property
    def walls(self) -> list[Any]:
        """Entities of walls and columns."""
        return [entity for kind in ("walls", "columns") for entity, _ in self.kinds[kind]]


def read_sheet(file: Path, hints: Hints, report: ImportReport) -> Sheet:
    """Read and sort a drawing; raises EchostepError when walls or units are missing or doubtful."""
    drawing = read_drawing(file, report)
    patterns = patterns_of(hints.layers)
    visible = VisibleEntities(drawing, file, report)
    kinds: dict[str, Layered] = {kind: [] for kind in patterns}
    others: Layered = []
    known, storey = cache(lambda layer: meaning(layer, patterns)), cache(storey_of)
    named: dict[int, StoreyName] = {}
    for entity, layer, blocks in visible(lambda layer: known(layer) == "doors"):
        kind = known(layer)
        if entity.dxftype() != "INSERT" or kind == "doors":
            (others if kind is None else kinds[kind]).append((entity, layer))
            own = next((found for name in (layer, *blocks) if (found := storey(name))), None)
            named |= {} if own is None else {id(entity): own}
    for name in visible.references:
        report.doubt(f"{name} is an external reference, so not in the file: bind it (XREF, Bind) or give that drawing")
    if not kinds["walls"]:
        raise _no_walls(file, drawing, kinds, others, visible.references, patterns)
    lengths = lengths_of({kind: [entity for entity, _ in pairs] for kind, pairs in kinds.items()}, file)
    if hints.scale_m is not None:
        scale_m, words, unit = hints.scale_m, f"{hints.scale_m:g} m a unit (--scale)", None
    else:
        scale_m, words = scale_of(drawing, lengths, hints.units, file, report)
        unit = None if hints.units else stated_unit(drawing)
    sheet = Sheet(file, kinds, others, scale_m, words, unit, (), named)
    return replace(sheet, alike=_tell(sheet, report, asks="walls" not in hints.layers))


def _tell(sheet: Sheet, report: ImportReport, *, asks: bool) -> tuple[str, ...]:
    """Report the layers used, entities on others, and layers that look like walls, which are returned.

    Raises EchostepError when most walls seem to be on these.
    """
    for kind, pairs in sheet.kinds.items():
        for layer, _ in Counter(layer for _, layer in pairs).most_common():
            if kind != "rooms":
                report.use(kind, layer)
    for what, count in Counter(f"{entity.dxftype()} on {layer[:40]}" for entity, layer in sheet.others).items():
        report.leave_out(what, count)
    frame = DrawingFrame.about(sheet.walls, sheet.scale_m)
    alike = _like_walls(sheet.others, frame)
    if not alike:
        return ()
    used_m = sum(line.length for line in _lines(sheet.walls, frame))
    words = ", ".join(f"{layer} ({length:.0f} m)" for layer, length in alike[:4])
    advice = _advice([*report.layers["walls"], *(name for name, _ in alike)][:6])
    if asks and sum(length for _, length in alike) > MOST_MORE * used_m:
        raise EchostepError(
            f"{sheet.file}: the layers named as walls have {used_m:.0f} m of lines; more that looks like walls is on {words}: give {advice}, "
            "or only the layers that are right"
        )
    report.doubt(f"what looks like walls was left out: {words}; {advice} takes it in")
    return tuple(layer for layer, _ in alike)


def storeys_of(sheet: Sheet, report: ImportReport) -> list[Sheet]:
    """A sheet for each storey that is drawn over another one, the lowest first; they are told. One where none is."""
    frame, by = DrawingFrame(sheet.scale_m), "names of layers or blocks"
    names, homes = _named(sheet, frame)
    if len(names) < 2:
        by = "heights of walls"
        names, homes = _lifted(sheet, frame)
    if len(names) < 2:
        return [sheet]
    parts = [_part(sheet, homes, names, number) for number in sorted(names)]
    lines = [_lines(part.walls, frame) for part in parts]
    told = f"{sheet.file.name}: by the {by} it has the storeys {', '.join(part.storey for part in parts)[:99]}"
    if not any(drawn_over(low, high) for low, high in pairwise(lines)):
        report.doubt(f"{told}, but they do not lie over each other: taken as one level")
        return [sheet]
    both = sorted({layer for row in sheet.kinds.values() for entity, layer in row if id(entity) not in homes})
    window = window_words([bounds_of([line for row in lines for line in row])], sheet.scale_m)
    on_all = f"; on all of them: {', '.join(both)[:99]}" if both else ""
    report.doubt(f"{told}, over each other: each is a level; {window} takes them as one{on_all}")
    lows = [min(frame.heights(entity)[0] for entity in part.walls) for part in parts]
    if all(high - low >= LEAST_STOREY_M for low, high in pairwise(lows)):
        parts = [replace(part, height_m=low - lows[0]) for part, low in zip(parts, lows, strict=True)]
    return parts


def _part(sheet: Sheet, homes: Mapping[int, int], names: Mapping[int, str], number: int) -> Sheet:
    """What is on one storey, or on none of those that walls are on."""
    rows = {"": sheet.others, **sheet.kinds}
    own = {kind: [pair for pair in row if homes.get(id(pair[0])) in (number, None)] for kind, row in rows.items()}
    return replace(sheet, others=own.pop(""), kinds=own, storey=names[number])


def _named(sheet: Sheet, frame: DrawingFrame) -> tuple[dict[int, str], dict[int, int]]:
    """Words of the storeys that walls name, by their numbers, and the numbers of entities, by their ids; walls without one may be one more."""
    homes = {key: storey.number for key, storey in sheet.named.items()}
    walls = [entity for entity in sheet.walls if id(entity) in homes and frame.raw(entity)]
    names = {homes[id(entity)]: sheet.named[id(entity)].words for entity in walls}
    rest = [pair for pair in sheet.kinds["walls"] if id(pair[0]) not in homes]
    own = _lines([entity for entity, _ in rest if names], frame)
    if has_room(own) and drawn_over(own, _lines(walls, frame)):
        lowest = min(0, *names) - 1
        names[lowest] = rest[0][1]
        homes |= {id(entity): lowest for entity, _ in rest}
    return names, {key: number for key, number in homes.items() if number in names}


def _lifted(sheet: Sheet, frame: DrawingFrame) -> tuple[dict[int, str], dict[int, int]]:
    """As `_named`, by the heights of the floors that walls stand on; walls that enclose no room stand on no floor of their own."""
    bands: list[tuple[float, float]] = []
    for low, high in sorted({frame.heights(entity) for entity in sheet.walls}):
        base, top = bands[-1] if bands else (-math.inf, -math.inf)
        if low < max(top - TOUCH_M, base + LEAST_STOREY_M) or (low == high and base < top and low - top < TOUCH_M):
            bands[-1] = base, max(top, high)
        else:
            bands.append((low, high))

    def home(entity: Any) -> int:
        return max(bisect_right(bases, frame.heights(entity)[0] + TOUCH_M) - 1, 0)

    bases = [base for base, _ in bands]
    on: dict[int, list[Any]] = {}
    for entity in sheet.walls if 1 < len(bases) <= MOST_STOREYS else ():
        on.setdefault(home(entity), []).append(entity)
    bases = [base for k, base in enumerate(bases) if has_room(_lines(on.get(k, []), frame))]
    pairs = [pair for row in (*sheet.kinds.values(), sheet.others) for pair in row if len(bases) > 1]
    return {k: f"{base:g} m" for k, base in enumerate(bases)}, {id(entity): home(entity) for entity, _ in pairs}


def _lines(entities: Sequence[Any], frame: DrawingFrame) -> list[LineString]:
    return [line for entity in entities for line in frame.raw(entity)]


def _like_walls(pairs: Layered, frame: DrawingFrame) -> list[tuple[str, float]]:
    """Layers whose lines look like faces of walls, and their length (m), the longest first."""
    by_layer: dict[str, list[Any]] = {}
    for entity, layer in pairs:
        if not matches(layer, (*BESIDE, *WAYS)):
            by_layer.setdefault(layer, []).append(entity)
    lengths = {layer: faces_m(_lines(entities, frame)) for layer, entities in by_layer.items()}
    return sorted(((layer, length) for layer, length in lengths.items() if length), key=lambda row: -row[1])


def _no_walls(
    file: Path,
    drawing: Any,
    kinds: Mapping[str, Layered],
    others: Layered,
    references: Sequence[str],
    patterns: Mapping[str, Sequence[str]],
) -> EchostepError:
    """Why a drawing has no walls, and what to give instead."""
    everything = [*others, *(pair for pairs in kinds.values() for pair in pairs)]
    if references and not everything:
        return EchostepError(
            f"{file}: the drawing only refers to {', '.join(references)[:200]} (external reference): bind it (XREF, Bind), or give that file"
        )
    least = max(1, len(everything))
    if any(len(drawing.layouts.get(name)) > least for name in drawing.layout_names() if name != "Model"):
        return EchostepError(f"{file}: it is on a layout (paper space) alone: copy it to the model space (CHSPACE)")
    names = [layer for layer, _ in Counter(layer for _, layer in everything).most_common(MOST_NAMES)]
    unit = likely_unit(lengths_of({"walls": [entity for entity, _ in everything], "doors": [], "rooms": []}, file))
    alike = _like_walls(everything, DrawingFrame(METRES[unit or stated_unit(drawing) or "m"]))
    columns = " but columns" if kinds["columns"] else ""
    if alike:
        words = ", ".join(f"{layer} ({length:.0f} m)" for layer, length in alike[:4])
        advice = _advice([layer for layer, _ in alike[:4]])
        return EchostepError(
            f"{file}: no layer has the name of walls{columns}; what looks like walls is on {words}: give {advice}"
        )
    named = " or ".join(patterns["walls"][:6])
    return EchostepError(
        f"{file}: nothing{columns} on a layer named {named}; give --layer walls=NAME; layers: {(', '.join(names) or 'none')[:400]}"
    )


def _advice(layers: Sequence[str]) -> str:
    """Options that take layers as walls."""
    return " ".join(f"--layer walls={shlex.quote(layer)}" for layer in layers)
