# SPDX-License-Identifier: MIT
"""Drawings (DXF, one file or one window of a file per level) -> `Plan`.

In: files, hints. Out: `Plan`, and the report. Owns nothing. Lines, polylines, arcs, circles, ellipses, splines, multilines and narrow hatches on a
layer of walls become walls, also inside blocks; the meaning of a layer is recognised by its name.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import shapely
from shapely.affinity import translate
from shapely.geometry import LineString, MultiLineString, Point, box
from shapely.geometry.base import BaseGeometry

from echostep.errors import EchostepError
from echostep.plan import ConnectorKind, Plan, Question
from echostep_app.plan.georeference import IN_GRID
from echostep_app.plan.importers.connector_shapes import plan_of
from echostep_app.plan.importers.drawn_level import ConnectorShape, DrawnLevel, areas
from echostep_app.plan.importers.dxf.doors import PlacedDoors
from echostep_app.plan.importers.dxf.entities import parts
from echostep_app.plan.importers.dxf.frame import DrawingFrame
from echostep_app.plan.importers.dxf.gaps import WallBands
from echostep_app.plan.importers.dxf.layers import WAYS, matches
from echostep_app.plan.importers.dxf.rooms import Written, named_spaces, names_of_blocks, rooms_of, written
from echostep_app.plan.importers.dxf.sheet import Layered, Sheet, read_sheet, storeys_of
from echostep_app.plan.importers.dxf.storeys import (
    Box,
    alignment,
    beside_house,
    bounds_of,
    lies_over,
    storey_boxes,
    window_words,
)
from echostep_app.plan.importers.dxf.symbols import (
    LEAF_M,
    Swing,
    Symbol,
    draws_open_leaf,
    is_swing,
    paired,
    symbol_of,
    symbols_of,
    with_leaf,
)
from echostep_app.plan.importers.report import Hints, ImportReport
from echostep_app.plan.importers.straight import pieces_of

HALF_TREAD_M = 0.3  # half the greatest distance between neighbouring lines of one staircase: a tread
CURVES = ("ARC", "ELLIPSE", "SPLINE", "LWPOLYLINE", "POLYLINE")  # entities that a swing may be drawn with
DEEPEST_SYMBOL = 4  # nesting depth of one door's blocks
SHOWN_STRAYS = 3
MOST_PIECES = 2000  # of walls in a question


@dataclass(slots=True)
class _Storey:
    """One level to be drawn: a sheet, the window of it (map metres) that holds the level, and the frame."""

    sheet: Sheet
    frame: DrawingFrame
    window: BaseGeometry | None = None
    swings: set[int] = field(default_factory=set)  # ids of entities on other layers that turned out to be doors
    _lines: dict[int, list[LineString]] = field(default_factory=dict)  # by id of the entities, which the sheet keeps

    def lines(self, *kinds: str) -> list[LineString]:
        """The lines of kinds of entities, in map metres, inside the window."""
        return [line for kind in kinds for entity, _ in self.sheet.kinds[kind] for line in self.of(entity)]

    def of(self, entity: Any) -> list[LineString]:
        """The lines of an entity inside the window; none for a door's swing."""
        if id(entity) in self.swings:
            return []
        if id(entity) not in self._lines:
            self._lines[id(entity)] = self.of_part(entity)
        return self._lines[id(entity)]

    def of_part(self, part: Any) -> list[LineString]:
        """The lines of a block's part inside the window: the part exists only briefly, so its lines are not kept."""
        return [line for line in self.frame.lines(part, self.sheet.file) if self.holds(line)]

    def texts(self) -> list[Written]:
        """The texts among the walls, and on layers that mean nothing else; those of ways out are no names."""
        pairs = (pair for pair in (*self.sheet.others, *self.sheet.kinds["walls"]) if not matches(pair[1], WAYS))
        found = (written(entity, layer, self.frame) for entity, layer in pairs)
        return names_of_blocks([text for text in found if text is not None and self.holds(Point(text.room.at_m))])

    def holds(self, shape: BaseGeometry) -> bool:
        """Whether a shape belongs to this level."""
        return self.window is None or bool(self.window.intersects(shape.centroid))


def import_dxf(files: Sequence[Path], hints: Hints, report: ImportReport) -> Plan:
    """Import a building from drawings, the lowest level first; raises EchostepError that names the file and the layer."""
    if hints.windows and len(files) > 1:
        raise EchostepError(f"{files[1]}: --window is for one drawing with several storeys: give one file")
    sheets = [read_sheet(file, hints, report) for file in files]
    if not hints.windows:
        sheets = [storey for sheet in sheets for storey in storeys_of(sheet, report)]
    report.units = "; ".join(dict.fromkeys(sheet.words for sheet in sheets))
    frame = DrawingFrame.about(sheets[0].walls, sheets[0].scale_m)
    if (frame.x0_m, frame.y0_m) != (0.0, 0.0):
        report.doubt(IN_GRID.format("the drawing", frame.x0_m, frame.y0_m))
    storeys = [_Storey(sheet, replace(frame, scale_m=sheet.scale_m)) for sheet in sheets]
    if hints.windows:
        storeys = [_in_window(storeys[0], window) for window in hints.windows]
    _lay_over(storeys, hints, report)
    usual = [
        f"level {i}" if hints.windows[1:] else one.sheet.storey or one.sheet.file.stem for i, one in enumerate(storeys)
    ]
    names = [*hints.level_names, *usual[len(hints.level_names) :]]
    heights = [one.sheet.height_m for one in storeys]  # known where one drawing has all of them
    if None in heights or heights.count(0.0) > 1:
        heights = [k * hints.storey_height_m for k in range(len(storeys))]
    drawn_levels = [
        _drawn_level(storey, DrawnLevel(name, round(height_m or 0.0, 6)), report)
        for storey, name, height_m in zip(storeys, names, heights, strict=False)
    ]
    plan = plan_of(files[0].stem, drawn_levels, report)
    return plan if any(level.rooms for level in plan.levels) else _with_names(plan, storeys, report)


def _with_names(plan: Plan, storeys: list[_Storey], report: ImportReport) -> Plan:
    """The plan with the names that are written into its rooms, whatever their layer."""
    levels = []
    for i, (level, storey) in enumerate(zip(plan.levels, storeys, strict=True)):
        rooms = named_spaces(plan, i, storey.texts(), report)
        levels.append(replace(level, rooms=tuple(rooms)))
    if count := sum(len(level.rooms) for level in levels):
        report.doubt(f"no layer is named for rooms: the names of {count} are the texts inside them")
    return replace(plan, levels=tuple(levels))


def _in_window(storey: _Storey, window: Sequence[float]) -> _Storey:
    """The part of a drawing inside a window of drawing units."""
    s, x0, y0 = storey.frame.scale_m, storey.frame.x0_m, storey.frame.y0_m
    area = box(window[0] * s - x0, window[1] * s - y0, window[2] * s - x0, window[3] * s - y0)
    found = _Storey(storey.sheet, storey.frame, area)
    if not found.lines("walls", "columns"):
        raise EchostepError(
            f"{storey.sheet.file}: --window {','.join(f'{v:g}' for v in window)}: no walls in it; it is in the drawing's units"
        )
    return found


def _lay_over(storeys: list[_Storey], hints: Hints, report: ImportReport) -> None:
    """Align levels where asked or drawn side by side; else report those that lie elsewhere, and refuse units that contradict each other."""
    walls = [storey.lines("walls", "columns") for storey in storeys]
    first = storeys[0].sheet
    for storey, lines in zip(storeys, walls, strict=True):
        if not lines:
            raise EchostepError(f"{storey.sheet.file}: the layers of walls have no lines: give --layer walls=NAME")
        if storey.window is not None:
            continue
        if len(boxes := storey_boxes([*lines, *storey.lines("doors")])) > 1:  # a door joins the walls beside it
            report.doubt(
                f"{storey.sheet.file.name} looks like {len(boxes)} storeys beside each other: import them as levels with "
                + _windows(storey, boxes)
            )
        elif found := beside_house(lines):
            report.doubt(
                f"{storey.sheet.file.name}: {found[0]} lines on the layers of walls lie around or beside the house (a frame, a title, an arrow?): "
                f"{_windows(storey, [found[1]])} leaves them out"
            )
    for k in range(1, len(storeys)):
        storey = storeys[k]
        over = lies_over(bounds_of(walls[k]), bounds_of(walls[0]))
        if storey.sheet.unit != first.unit and not (over and _as_large(walls[k], walls[0])) and not hints.align:
            raise EchostepError(
                f"{storey.sheet.file}: its units ({storey.sheet.unit}) are not those of {first.file.name} ({first.unit}), and the storeys "
                "do not lie over each other: give --units, or --align when both are right"
            )
        if hints.align or storey.window is not None:
            dx, dy = alignment(walls[k], walls[0])
            frame = replace(storey.frame, x0_m=storey.frame.x0_m - dx, y0_m=storey.frame.y0_m - dy)
            storeys[k] = _Storey(storey.sheet, frame, storey.window and translate(storey.window, dx, dy))
        elif not over:
            one, other = (sheet.storey or sheet.file.name for sheet in (storey.sheet, first))
            report.doubt(f"{one} does not lie over {other}: --align lays the storeys over each other")


def _windows(storey: _Storey, boxes: Sequence[Box]) -> str:
    """Options for rectangles on the plan."""
    x, y = storey.frame.x0_m, storey.frame.y0_m
    return window_words([(x0 + x, y0 + y, x1 + x, y1 + y) for x0, y0, x1, y1 in boxes], storey.frame.scale_m)


def _as_large(one: list[LineString], other: list[LineString]) -> bool:
    """Whether two levels are of about the same size: within a factor of 2."""
    sizes = [max(b[2] - b[0], b[3] - b[1]) for b in (bounds_of(one), bounds_of(other))]
    return max(sizes) < 2 * min(sizes)


def _drawn_level(storey: _Storey, drawn: DrawnLevel, report: ImportReport) -> DrawnLevel:
    sheet = storey.sheet
    _without_lines(storey, report)
    doors = _doors(storey, report)
    drawn.doors, drawn.cuts = doors.doors, doors.cuts
    drawn.questions = [*doors.questions(), *_left_out_walls(storey)]
    drawn.walls, drawn.windows = [*storey.lines("walls", "columns"), *doors.jambs], list(storey.lines("windows"))
    obstacles = shapely.node(MultiLineString(storey.lines("obstacles")))
    drawn.obstacles = areas(shapely.get_parts(shapely.polygonize(shapely.get_parts(obstacles))))
    rooms = rooms_of(sheet.kinds["rooms"], storey.frame, sheet.file, report, storey.texts())
    drawn.rooms = [room for room in rooms if storey.holds(Point(room.at_m))]
    house = MultiLineString(storey.lines("walls", "columns", "windows")).convex_hull
    if beside := [room.name for room in drawn.rooms if not house.intersects(Point(room.at_m))]:
        report.doubt(
            f"{len(beside)} names lie beside the walls ({', '.join(beside)[:100]}): are they rooms? echostep plan edit moves or deletes them"
        )
    for kind, layer in (("stairs", "stairs"), ("lift", "lifts")):
        blots = shapely.union_all([line.buffer(HALF_TREAD_M) for line in storey.lines(layer)])
        hulls = [blot.convex_hull.buffer(-HALF_TREAD_M) for blot in shapely.get_parts(blots)]
        drawn.connectors += [ConnectorShape(cast(ConnectorKind, kind), "", area) for area in areas(hulls)]
    return drawn


def _without_lines(storey: _Storey, report: ImportReport) -> None:
    """Report entities without lines on the layers used: texts, pictures, bodies, unknown objects."""
    for kind in ("walls", "columns", "windows", "stairs", "lifts", "obstacles"):
        for entity, layer in storey.sheet.kinds[kind]:
            if storey.window is None and not storey.of(entity):
                report.leave_out(f"{entity.dxftype()} on {layer[:40]}")


def _doors(storey: _Storey, report: ImportReport) -> PlacedDoors:
    """Doors on their layers, then swings on others, or among the walls, that fit a gap exactly."""
    placed = PlacedDoors()
    curves = [pair for pair in _besides_doors(storey) if pair[0].dxftype() in CURVES]
    swings = [(*pair, symbol) for pair in curves if is_swing(symbol := symbol_of(storey.of(pair[0])))]
    storey.swings.update(id(entity) for entity, *_ in swings)  # not walls while doors are looked for
    walls = WallBands(storey.lines("walls", "columns", "windows"))
    for symbol in _symbols(storey):
        placed.add(symbol, walls)
    _swings_elsewhere(storey, swings, placed, walls, report)
    _tell_doors(placed, report)
    return placed


def _left_out_walls(storey: _Storey) -> Iterator[Question]:
    """A question about each layer that looks like walls and was left out."""
    for layer in storey.sheet.alike:
        lines = [line for entity, own in storey.sheet.others if own == layer for line in storey.of(entity)]
        pieces = np.round(pieces_of(lines), 3)
        pieces = pieces[(pieces[:, :2] != pieces[:, 2:]).any(axis=1)]
        if 0 < len(pieces) <= MOST_PIECES:
            x0, y0, x1, y1 = pieces[np.hypot(*(pieces[:, 2:] - pieces[:, :2]).T).argmax()]
            text = f"layer {layer[:40]} looks like walls and was left out: take it in?"
            at = round(float(x0 + x1) / 2, 3), round(float(y0 + y1) / 2, 3)
            yield Question(text, "wall", at, tuple((a, b, c, d) for a, b, c, d in pieces.tolist()), is_proposed=True)


def _swings_elsewhere(
    storey: _Storey, swings: list[tuple[Any, str, Symbol]], placed: PlacedDoors, walls: WallBands, report: ImportReport
) -> None:
    """Place swings on layers that are not of doors, single or in pairs; swings that fit no gap keep their layer's kind."""
    doors: list[tuple[Any, str, Swing, tuple[float, float]]] = []
    left: dict[int, tuple[Any, str, Swing]] = {}  # by id of the line, which the symbols of pairs keep
    drawn = [(*pair, lines) for pair in _besides_doors(storey) if swings and (lines := storey.of(pair[0]))]
    tree = shapely.STRtree([lines[0] for *_, lines in drawn])
    for entity, layer, symbol in swings:
        near = tree.query(Point(symbol.swings[0].hinge), predicate="dwithin", distance=LEAF_M)
        swing = with_leaf(symbol.swings[0], [*symbol.lines, *(line for k in near for line in drawn[k][2])])
        if (gap := placed.add_swing(swing, walls)) is None:
            left |= {id(line): (entity, layer, swing) for line in symbol.lines}
        else:
            doors.append((entity, layer, swing, gap[2:]))
    for pair in symbols_of([line for _, _, symbol in swings for line in symbol.lines if id(line) in left]):
        if len(pair.swings) == 2 and placed.add_pair(pair, walls) is not None:
            for entity, layer, swing in (left.pop(id(line)) for line in pair.lines):
                other = next((one.hinge for one in pair.swings if one.hinge != swing.hinge), swing.hinge)
                doors.append((entity, layer, swing, other))
    storey.swings.difference_update(id(entity) for entity, _, _ in left.values())
    for entity, layer, swing, closed in doors:
        report.use("doors", layer)
        report.take_back(f"{entity.dxftype()} on {layer[:40]}")
        for k in tree.query(Point(swing.hinge), predicate="dwithin", distance=LEAF_M):
            other, on, lines = drawn[k]
            if id(other) not in storey.swings and draws_open_leaf(lines, swing, closed):
                storey.swings.add(id(other))  # an open leaf is neither wall nor window, nor left out
                report.take_back(f"{other.dxftype()} on {on[:40]}")


def _besides_doors(storey: _Storey) -> Layered:
    """Entities among which a swing or a leaf may be drawn, on no layer of doors."""
    return [*storey.sheet.others, *storey.sheet.kinds["walls"], *storey.sheet.kinds["windows"]]


def _tell_doors(placed: PlacedDoors, report: ImportReport) -> None:
    """Report doors that walls are drawn through, and symbols in no wall."""
    if placed.marks:
        report.leave_out("mark on a layer of doors", placed.marks)
    if placed.cuts:
        one = len(placed.cuts) == 1
        report.doubt(f"{len(placed.cuts)} door{' lies' if one else 's lie'} where a wall is drawn through: it was cut")
    if placed.asked:
        report.doubt(
            f"arcs like doors' in walls that are drawn through ({len(placed.asked)}): echostep plan edit asks about each"
        )
    if placed.strays:
        places = ", ".join(f"x {x:g} y {y:g}" for (x, y), _ in placed.strays[:SHOWN_STRAYS])
        one = len(placed.strays) == 1
        report.leave_out("door in no wall", len(placed.strays))
        report.doubts.insert(
            0,
            f"{len(placed.strays)} door{' stands' if one else 's stand'} in no wall and {'was' if one else 'were'} left out ({places}"
            f"{'' if len(placed.strays) <= SHOWN_STRAYS else ', ...'}): are all layers of walls used?",
        )


def _symbols(storey: _Storey) -> list[Symbol]:
    """The door symbols of a level: blocks, and loose lines that touch."""
    loose: list[LineString] = []
    symbols: list[Symbol] = []
    for entity, _ in storey.sheet.kinds["doors"]:
        if entity.dxftype() == "INSERT":
            lines = [line for part in _parts(entity, storey.sheet.file) for line in storey.of_part(part)]
            symbols += [symbol_of(lines)] if lines else []
        else:
            loose += storey.of(entity)
    return paired([*symbols, *symbols_of(loose)])


def _parts(block: Any, file: Path, depth: int = DEEPEST_SYMBOL) -> list[Any]:
    """All entities of a block and of the blocks inside it."""
    inner = parts(block, file)
    deeper = [part for part in inner if part.dxftype() == "INSERT"] if depth else []
    own = [part for part in inner if part.dxftype() != "INSERT"]
    return own + [found for part in deeper for found in _parts(part, file, depth - 1)]
