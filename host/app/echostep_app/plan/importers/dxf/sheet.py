# SPDX-License-Identifier: MIT
"""One drawing file, its entities sorted by the kind of their layers, and its scale.

In: a file, hints. Out: `Sheet`. Owns when a drawing is refused for its layers.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from echostep.errors import EchostepError
from echostep_app.plan.importers.dxf.entities import VisibleEntities, read_drawing
from echostep_app.plan.importers.dxf.frame import METRES, DrawingFrame
from echostep_app.plan.importers.dxf.layers import BESIDE, EXITS, faces_m, matches, meaning, patterns_of
from echostep_app.plan.importers.dxf.measures import lengths_of
from echostep_app.plan.importers.dxf.units import likely_unit, scale_of, stated_unit
from echostep_app.plan.importers.hints import Hints
from echostep_app.plan.importers.report import ImportReport

MOST_MORE = 3.0  # ratio of wall-like lines on other layers to the walls used, from which the import asks; assumed
MOST_NAMES = 20  # of layers in an error
Layered = list[tuple[Any, str]]  # entities with their layers


@dataclass(frozen=True, slots=True)
class Sheet:
    """`kinds`: entities by the meaning of their layers; `others`: those on layers without one.

    `alike`: other layers that look like walls. `unit`: as the file states it; None if missing, or if hints overrule it.
    """

    file: Path
    kinds: Mapping[str, Layered]
    others: Layered
    scale_m: float
    words: str
    unit: str | None
    alike: tuple[str, ...] = ()

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
    known: dict[str, str | None] = {}
    for entity, layer in visible(lambda layer: meaning(layer, patterns) == "doors"):
        kind = known[layer] if layer in known else known.setdefault(layer, meaning(layer, patterns))
        if entity.dxftype() != "INSERT" or kind == "doors":
            (others if kind is None else kinds[kind]).append((entity, layer))
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
    sheet = Sheet(file, kinds, others, scale_m, words, unit)
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
    used_m = sum(line.length for entity in sheet.walls for line in frame.raw(entity))
    words = ", ".join(f"{layer} ({length:.0f} m)" for layer, length in alike[:4])
    advice = " ".join(
        f"--layer walls={_quoted(layer)}" for layer in [*report.layers["walls"], *(name for name, _ in alike)][:6]
    )
    if asks and sum(length for _, length in alike) > MOST_MORE * used_m:
        raise EchostepError(
            f"{sheet.file}: the layers named as walls have {used_m:.0f} m of lines; more that looks like walls is on {words}: give {advice}, "
            "or only the layers that are right"
        )
    report.doubt(f"what looks like walls was left out: {words}; {advice} takes it in")
    return tuple(layer for layer, _ in alike)


def _like_walls(pairs: Layered, frame: DrawingFrame) -> list[tuple[str, float]]:
    """Layers whose lines look like faces of walls, and their length (m), the longest first."""
    by_layer: dict[str, list[Any]] = {}
    for entity, layer in pairs:
        if not matches(layer, (*BESIDE, *EXITS)):
            by_layer.setdefault(layer, []).append(entity)
    lengths = {
        layer: faces_m([line for entity in entities for line in frame.raw(entity)])
        for layer, entities in by_layer.items()
    }
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
    if not everything and any(len(drawing.layouts.get(name)) > 1 for name in drawing.layout_names() if name != "Model"):
        return EchostepError(f"{file}: it is on a layout (paper space) alone: copy it to the model space (CHSPACE)")
    names = [layer for layer, _ in Counter(layer for _, layer in everything).most_common(MOST_NAMES)]
    unit = likely_unit(lengths_of({"walls": [entity for entity, _ in everything], "doors": [], "rooms": []}, file))
    alike = _like_walls(everything, DrawingFrame(METRES[unit or stated_unit(drawing) or "m"]))
    columns = " but columns" if kinds["columns"] else ""
    if alike:
        words = ", ".join(f"{layer} ({length:.0f} m)" for layer, length in alike[:4])
        advice = " ".join(f"--layer walls={_quoted(layer)}" for layer, _ in alike[:4])
        return EchostepError(
            f"{file}: no layer has the name of walls{columns}; what looks like walls is on {words}: give {advice}"
        )
    named = " or ".join(patterns["walls"][:6])
    return EchostepError(
        f"{file}: nothing{columns} on a layer named {named}; give --layer walls=NAME; layers: {(', '.join(names) or 'none')[:400]}"
    )


def _quoted(layer: str) -> str:
    return f"'{layer}'" if any(letter in layer for letter in " '*?[]()&;|$") else layer
