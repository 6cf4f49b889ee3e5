# SPDX-License-Identifier: MIT
"""Doors of a drawing: the gap in the walls that each door symbol belongs to.

In: door symbols, walls. Out: `Door`s, and symbols in no wall. Owns how far a symbol may be off its gap. A swing gives the hinge and the width; the
end of its arc that the drawn leaf does not reach is the closed one. From the hinge along the wall the gap ends at the other jamb. Without a swing the
longest line is the door, or its leaf drawn open.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
import shapely
from shapely.geometry import LineString
from shapely.geometry.base import BaseGeometry

from echostep.plan import Door, Question
from echostep_app.plan.importers.drawn_level import opening
from echostep_app.plan.importers.dxf.gaps import BY_M, NEAR_M, THICKEST_M, Gap, WallBands
from echostep_app.plan.importers.dxf.symbols import NARROWEST_M, Point, Swing, Symbol

LONG = 2.5  # least ratio of a leaf's length to its thickness; assumed
WIDEST_M = 12.0  # of a door without a swing: gates
LEAST_SHARE, MOST_SHARE = 0.6, 1.3  # ratio of a gap's width to the width of its leaf; assumed
CORNER_M = 0.2  # from a door in a corner to the axis of a thick wall there; assumed
MOST_OFF_M = 0.3  # from both jambs together; assumed
TIP_M = 0.1  # least visible part of a sliding leaf in its gap; assumed
FRAME_M = 0.2  # width that a gap may have beyond that: frame; assumed
BESIDE_M = 6.0  # greatest width of a hole in which a door stands beside a window; assumed
BEYOND_M = 0.3  # so far a wall goes on beyond a leaf that is drawn in it; assumed
SAME_M = 0.25  # two doors with nearer middles are one, as are two lines across one wall; assumed
NEAR_JAMB_M = 0.02  # closer faces need no end between them
# Of folding doors: least width, ratio of widths, ratio of panels to their part of the gap; assumed
THINNEST_PANEL_M, EVEN, FOLDED = (0.1, 1.3, 1.3)
THROUGH = "a wall was drawn through this door, and cut: is it a door?", "an arc like a door's at a wall: is it a door?"
Line = tuple[float, float, float, float]


@dataclass(slots=True)
class PlacedDoors:
    """Doors in walls; `jambs`: ends of the adjacent walls, from face to face; `cuts`: areas of walls that are drawn through the `cut_doors`.

    `strays`: middles of symbols in no wall, and their possible doors. `asked`: lines of arcs like swings without a leaf at walls drawn through them.
    `marks`: number of small shapes that are not doors: frames of numbers, jambs.
    """

    doors: list[Door] = field(default_factory=list)
    jambs: list[LineString] = field(default_factory=list)
    cuts: list[BaseGeometry] = field(default_factory=list)
    cut_doors: list[Line] = field(default_factory=list)
    strays: list[tuple[Point, Line]] = field(default_factory=list)
    asked: list[Line] = field(default_factory=list)
    marks: int = 0

    def add(self, symbol: Symbol, walls: WallBands) -> None:
        """Place the doors of a symbol."""
        lines = (
            list(_lines(symbol, walls)) or list(_lines(symbol, walls.wider())) or list(_of_panels(symbol.lines, walls))
        )
        if not lines and not (symbol.swings or _is_long(symbol.lines)):
            self.marks += 1
        elif not lines:
            middle = shapely.union_all(symbol.lines).envelope.centroid
            self.strays.append(((round(middle.x, 2), round(middle.y, 2)), _drawn_line(symbol)))
        for line in _joined(lines):
            width_m = math.dist(line[:2], line[2:])
            if walls.gap(line[:2], _along(line), width_m / 2, width_m) is not None:
                self._place(line, walls)
            elif not self._has(line):
                self._cut(line, walls)

    def add_swing(self, swing: Swing, walls: WallBands) -> Line | None:
        """Place a swing on no layer of doors, and return its line: in a gap that it fits exactly, or, with a leaf, at a wall drawn through it.

        Without a leaf the latter is asked about.
        """
        if (line := _exact(swing, walls) or _exact(swing, walls.wider())) is not None:
            self._place(line, walls)
            return line
        closed = [end for k, end in enumerate(swing.ends) if k != swing.leaf and walls.is_at_wall(end)]
        if len(closed) != 1 or not walls.is_at_wall(swing.hinge):
            return None
        line = (*swing.hinge, *closed[0])
        if walls.gap(line[:2], _along(line), swing.radius_m / 2, swing.radius_m) is not None or self._has(line):
            return None
        if swing.leaf is None:
            self.asked.append(line)
            return None
        self._cut(line, walls)
        return line

    def add_pair(self, symbol: Symbol, walls: WallBands) -> Line | None:
        """Place two swings that meet and lie on no layer of doors, if they fit a gap exactly; returns the gap or None."""
        leaves = [_of_swing(_meeting(swing, symbol.swings), walls) for swing in symbol.swings]
        lines = _joined([leaf for leaf in leaves if leaf is not None])
        if len(symbol.swings) != 2 or None in leaves or len(lines) != 1:
            return None
        width_m = math.dist(lines[0][:2], lines[0][2:])
        gap = walls.gap(lines[0][:2], _along(lines[0]), width_m / 2, width_m)
        if gap is None or abs(gap.begin_m) > BY_M or abs(gap.end_m - width_m) > BY_M:
            return None
        self._place(lines[0], walls)
        return lines[0]

    def _cut(self, line: Line, walls: WallBands) -> None:
        self.doors.append(Door(line))
        self.cuts.append(walls.faces(line, THICKEST_M))
        self.cut_doors.append(line)

    def _has(self, line: Line) -> bool:
        return any(_same(line, other.line) for other in self.doors)

    def _place(self, line: Line, walls: WallBands) -> None:
        """Add a door in a gap, in the middle of the wall, wherever its symbol is drawn, and the ends of the wall."""
        (u, v), ends = _along(line), (line[:2], line[2:])
        spans = [walls.wall_at(end, (side * u, side * v)) for end, side in zip(ends, (-1, 1), strict=True)]
        left = [
            None if span is None else (span if side > 0 else (-span[1], -span[0]))
            for span, side in zip(spans, (-1, 1), strict=True)
        ]
        found = [span for span in left if span is not None]
        off = sum(low + high for low, high in found) / (2 * len(found) or 1)
        moved = _line((line[0] - off * v, line[1] + off * u), (u, v), 0.0, math.dist(*ends))
        if self._has(moved):
            return
        self.doors.append(Door(moved))
        for (x, y), span in zip(ends, left, strict=True):
            if span is not None and span[1] - span[0] > NEAR_JAMB_M:
                self.jambs.append(LineString([(x - o * v, y + o * u) for o in span]))

    def questions(self) -> Iterator[Question]:
        """Questions for a person: symbols in no wall, and doors that a wall is drawn through."""
        for at, line in self.strays:
            if math.dist(line[:2], line[2:]) > BY_M:
                yield Question("door in no wall, left out: is it a door?", "door", at, (line,), is_proposed=True)
        for line in (*self.cut_doors, *self.asked):
            at = (line[0] + line[2]) / 2, (line[1] + line[3]) / 2
            yield Question(THROUGH[line in self.asked], "door", at, (line,), is_proposed=line in self.asked)


def _lines(symbol: Symbol, walls: WallBands) -> Iterator[Line]:
    """A line from jamb to jamb for each leaf of a symbol that hangs in a wall."""
    for swing in symbol.swings:
        line = _of_swing(_meeting(swing, symbol.swings), walls)
        if line is not None:
            yield line
    if not symbol.swings:
        line = _of_line(symbol.lines, walls)
        if line is not None:
            yield line


def _drawn_line(symbol: Symbol) -> Line:
    """The line of a door that lies in no wall: from the hinge to the closed end of its arc, else along its longest side."""
    if symbol.swings:
        swing = symbol.swings[0]
        return (*swing.hinge, *swing.ends[0 if swing.leaf == 1 else 1])
    return opening(shapely.union_all([line.buffer(0.01, cap_style="flat") for line in symbol.lines]))


def _meeting(swing: Swing, swings: Sequence[Swing]) -> Swing:
    """A swing without a drawn leaf whose arc meets the other leaf's arc: both leaves are closed there."""
    for k, end in enumerate(swing.ends):  # a leaf that swings both ways is drawn closed, with two arcs
        same = (other for other in swings if other is not swing and math.dist(other.hinge, swing.hinge) < BY_M)
        if any(math.dist(end, other) < BY_M for one in same for other in one.ends):
            return replace(swing, leaf=1 - k)
    if swing.leaf is None:
        for k, end in enumerate(swing.ends):
            others = (other_end for other in swings if other is not swing for other_end in other.ends)
            if any(math.dist(end, other) < BY_M for other in others):
                return replace(swing, leaf=1 - k)
    return swing


def _of_swing(swing: Swing, walls: WallBands) -> Line | None:
    """The gap that a swing closes: towards the closed end of its arc, else along a wall at the hinge."""
    hinge, radius = swing.hinge, swing.radius_m
    closed = [end for k, end in enumerate(swing.ends) if k != swing.leaf]
    towards = [_unit(hinge, end) for end in closed]
    gaps = [
        (u, gap) for u in (*towards, *walls.directions(hinge)) if (gap := walls.gap(hinge, u, radius / 2, 2 * radius))
    ]
    fitting = [(u, gap) for u, gap in gaps if _fits(gap, radius)]
    if fitting:
        in_arc = [pair for pair in fitting if pair[0] in towards]
        u, gap = min(in_arc or fitting[:1], key=lambda pair: abs(pair[1].width_m - radius))
        return _line(hinge, u, gap.begin_m, gap.end_m)
    if (shut := _leaf_in_wall(swing, walls)) is not None:
        return shut
    if (
        swing.leaf is not None
    ):  # the drawn leaf shows the closed end: in a larger hole, or in a wall drawn through the door
        u = towards[0]
        gap = walls.gap(hinge, u, radius / 2, BESIDE_M)
        if gap is not None and gap.begin_m >= -NEAR_M and gap.end_m < BESIDE_M and gap.width_m > radius:
            return _line(hinge, u, min(gap.begin_m, 0.0), radius)
    through = [end for end in closed if walls.is_at_wall(hinge) and walls.is_at_wall(end)]
    drawn_through = [end for end in through if walls.gap(hinge, _unit(hinge, end), radius / 2, radius) is None]
    return (*hinge, *drawn_through[0]) if drawn_through else None


def _leaf_in_wall(swing: Swing, walls: WallBands) -> Line | None:
    """The line of a leaf that is drawn closed, in a wall that is drawn through it; the open end of its arc lies free in the room."""
    if swing.leaf is None or not walls.is_at_wall(swing.hinge):
        return None
    shut, free = swing.ends[swing.leaf], swing.ends[1 - swing.leaf]
    (u, v) = _unit(swing.hinge, shut)
    goes_on = walls.is_at_wall(shut) and walls.is_at_wall((shut[0] + BEYOND_M * u, shut[1] + BEYOND_M * v))
    is_free = goes_on and not walls.is_at_wall(free)
    is_walled = walls.gap(swing.hinge, (u, v), swing.radius_m / 2, swing.radius_m) is None
    return (*swing.hinge, *shut) if is_free and is_walled else None


def _exact(swing: Swing, walls: WallBands) -> Line | None:
    """The gap that an arc from jamb to open leaf fits exactly; None for arcs that are not doors: basins, chairs, curved walls."""
    hinge, radius = swing.hinge, swing.radius_m
    found = []
    for u in (_unit(hinge, end) for end in swing.ends):
        gap = walls.gap(hinge, u, radius / 2, 2 * radius)
        off = (math.inf,) if gap is None else (abs(gap.begin_m), abs(gap.end_m - radius))
        if gap is not None and max(off) < CORNER_M and sum(off) < MOST_OFF_M:
            found.append(_line(hinge, u, gap.begin_m, gap.end_m))
    return found[0] if len(found) == 1 else None


def _of_line(lines: Sequence[LineString], walls: WallBands) -> Line | None:
    """The gap of a symbol without a swing: its long side lies in the gap, or in a wall drawn through it, or it is a leaf drawn open."""
    x0, y0, x1, y1 = opening(shapely.union_all([line.buffer(0.01, cap_style="flat") for line in lines]))
    a, b = (x0, y0), (x1, y1)
    length = math.dist(a, b)
    if not NARROWEST_M - 0.1 <= length <= WIDEST_M:
        return None
    along = _unit(a, b)
    gap = walls.gap(a, along, length / 2, length)
    if gap is not None and _fits(gap, length) and _is_square(shut := _line(a, along, gap.begin_m, gap.end_m), walls):
        return shut
    for hinge in (a, b):
        for u in walls.directions(hinge):
            leaf = walls.gap(hinge, u, length / 2, 2 * length)
            if leaf is not None and _fits(leaf, length):
                return _line(hinge, u, leaf.begin_m, leaf.end_m)
    tips = [_at_tip(a, along, length, walls), _at_tip(b, (-along[0], -along[1]), length, walls)]
    if len(found := [tip for tip in tips if tip is not None]) == 1:
        return found[0]
    corner = next((line for hinge, end in ((a, b), (b, a)) if (line := _across_leaf(hinge, end, walls))), None)
    return corner or ((*a, *b) if gap is None and walls.is_at_wall(a) and walls.is_at_wall(b) else None)


def _of_panels(lines: Sequence[LineString], walls: WallBands) -> Iterator[Line]:
    """The gap of a folding door: panels of one width in a zigzag from a jamb, half of the gap or all of it."""
    panels = [math.dist(a, b) for line in lines for a, b in pairwise(line.coords)]
    zigzags = [line for line in lines if not line.is_ring]
    if len(panels) < 2 or len(zigzags) < len(lines) or not THINNEST_PANEL_M < max(panels) < EVEN * min(panels):
        return
    reach_m = sum(panels)
    for end in (end for line in zigzags for end in (line.coords[0], line.coords[-1])):
        for u in walls.directions(end):
            gap = walls.gap(end, u, min(panels), 2 * FOLDED * reach_m)
            if gap is not None and abs(gap.begin_m) < BY_M and reach_m / FOLDED <= gap.width_m <= 2 * FOLDED * reach_m:
                yield _line(end, u, gap.begin_m, gap.end_m)
                return


def _is_square(line: Line, walls: WallBands) -> bool:
    """Whether a wall at an end of a door's line goes on along it or at right angles: a leaf drawn half open may fit between two walls askew."""
    (u, v), ends = _along(line), (line[:2], line[2:])
    found = [direction for end in ends for direction in walls.directions(end)]
    return any(min(abs(a * v - b * u), abs(a * u + b * v)) < 0.1 for a, b in found)


def _at_tip(begin: Point, along: Point, length: float, walls: WallBands) -> Line | None:
    """The gap that the far end of a panel reaches into: a sliding leaf, drawn half open or inside the wall."""
    gap = walls.gap(begin, along, length - TIP_M, 2 * length)
    if gap is None or gap.begin_m < TIP_M or not LEAST_SHARE * length <= gap.width_m <= MOST_SHARE * length + FRAME_M:
        return None
    return _line(begin, along, gap.begin_m, gap.end_m)


def _across_leaf(hinge: Point, end: Point, walls: WallBands) -> Line | None:
    """The gap from a hinge in a corner at right angles to a leaf that is drawn open against the other wall: the wall goes on at its far end."""
    (u, v), length = _unit(hinge, end), math.dist(hinge, end)
    for across in ((-v, u), (v, -u)):
        gap = walls.gap(hinge, across, length / 2, 2 * length)
        if gap is not None and max(abs(gap.begin_m), abs(gap.end_m - length)) < CORNER_M:
            line = _line(hinge, across, gap.begin_m, gap.end_m)
            if any(abs(a * u + b * v) < 0.1 for a, b in walls.directions(line[2:])):
                return line
    return None


def _is_long(lines: Sequence[LineString]) -> bool:
    """Whether lines may be a leaf or a threshold: as long as a door is wide, and narrow."""
    box = np.asarray(shapely.union_all([line.buffer(0.01) for line in lines]).minimum_rotated_rectangle.exterior.coords)
    sides = sorted((math.dist(box[0], box[1]), math.dist(box[1], box[2])))
    return sides[1] >= NARROWEST_M and sides[1] >= LONG * sides[0]


def _fits(gap: Gap, leaf_m: float) -> bool:
    """Whether a leaf of this width, hung at the place that the gap was asked for, closes the gap."""
    hangs = -NEAR_M <= gap.begin_m <= NEAR_M
    return hangs and LEAST_SHARE * leaf_m <= gap.width_m <= MOST_SHARE * leaf_m + FRAME_M


def _joined(lines: Sequence[Line]) -> list[Line]:
    """Leaves that meet in the middle of one gap are one door."""
    joined: list[Line] = []
    for line in lines:
        for k, other in enumerate(joined):
            spans = [(*q, *p) for p, m in _ends(line) for q, n in _ends(other) if math.dist(m, n) < BY_M]
            long = max((math.dist(s[:2], s[2:]) for s in spans), default=0.0)
            both = math.dist(line[:2], line[2:]) + math.dist(other[:2], other[2:])
            if spans and abs(long - both) < BY_M:
                joined[k] = max(spans, key=lambda s: math.dist(s[:2], s[2:]))
                break
        else:
            joined.append(line)
    return joined


def _ends(line: Line) -> tuple[tuple[Point, Point], tuple[Point, Point]]:
    """Each end, paired with the other end."""
    return (line[:2], line[2:]), (line[2:], line[:2])


def _same(one: Line, other: Line) -> bool:
    """Whether two lines are one door: their middles lie together, along them or across one wall, and they point the same way."""
    (x, y), (p, q) = (((x0 + x1) / 2, (y0 + y1) / 2) for x0, y0, x1, y1 in (one, other))
    if abs(p - x) + abs(q - y) > 2.0 * (SAME_M + THICKEST_M):
        return False
    (a, b), (c, d) = _along(one), _along(other)
    along, across = abs((p - x) * a + (q - y) * b), abs((q - y) * a - (p - x) * b)
    return along < SAME_M and across < THICKEST_M and abs(a * d - b * c) < 0.5


def _line(at: Point, along: Point, begin_m: float, end_m: float) -> Line:
    (x, y), (u, v) = at, along
    ends = (x + begin_m * u, y + begin_m * v, x + end_m * u, y + end_m * v)
    return round(ends[0], 3), round(ends[1], 3), round(ends[2], 3), round(ends[3], 3)


def _along(line: Line) -> Point:
    return _unit(line[:2], line[2:])


def _unit(a: Point, b: Point) -> Point:
    length = math.dist(a, b) or 1.0
    return (b[0] - a[0]) / length, (b[1] - a[1]) / length
