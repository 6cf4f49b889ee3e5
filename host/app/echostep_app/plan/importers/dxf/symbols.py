# SPDX-License-Identifier: MIT
"""Door symbols: the swings in drawn lines, whatever entity they were drawn with.

In: polylines in metres. Out: `Swing`s, `Symbol`s. Owns which curves are swings. Arcs, bulges, splines, ellipses and chains of short pieces are all
polylines here: a swing is a run of corners on one circle, and the hinge its centre.

            ,-'| leaf
          ,'   |        arc: from the leaf's end to the jamb
    =====+.....o=====   o: hinge, +: end of the arc at the wall, .....: the door's line
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry import LineString

from echostep.arrays import Floats

NARROWEST_M, WIDEST_M = 0.4, 2.5  # radius of a swing: width of a leaf; assumed
LEAST_SWEEP_RAD, MOST_SWEEP_RAD = math.radians(20), math.radians(200)  # assumed
# At a corner of a curve that is drawn as a polyline; assumed
LEAST_TURN_RAD, MOST_TURN_RAD = (math.radians(0.5), math.radians(46))
OFF = 0.04  # greatest distance of a swing's corners from its circle, relative to its radius: splines are not circles; assumed
JOIN_M = 0.06  # drawn lines nearer than this are one symbol; assumed
LEAF_M = 0.15  # greatest distance of a leaf's ends from the hinge and the end of the arc; assumed
MOST_LEAF = 2.4  # length of a leaf's outline relative to its width: a rectangle
MOST_CORNERS = 2000  # of a polyline that is searched
Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Swing:
    """A leaf's swing: the hinge, both ends of the arc, and its radius. `leaf`: which end (0, 1) the drawn leaf reaches, None without one."""

    hinge: Point
    ends: tuple[Point, Point]
    radius_m: float
    leaf: int | None = None


@dataclass(frozen=True, slots=True)
class Symbol:
    """Lines that belong together, and the swings in them."""

    lines: tuple[LineString, ...]
    swings: tuple[Swing, ...]


def symbol_of(lines: Sequence[LineString]) -> Symbol:
    """The lines of one block as a symbol."""
    swings = [swing for line in lines for swing in swings_in(line)]
    return Symbol(tuple(lines), tuple(with_leaf(swing, lines) for swing in swings))


def is_swing(symbol: Symbol) -> bool:
    """Whether a symbol is little more than one swing: arc, leaf, threshold; not a wall with a round corner."""
    return len(symbol.swings) == 1 and sum(line.length for line in symbol.lines) < 4.0 * symbol.swings[0].radius_m


def draws_open_leaf(lines: Sequence[LineString], swing: Swing, closed: Point) -> bool:
    """Whether lines are no more than the leaf of a swing, drawn open; `closed`: the end of its arc that is at the jamb."""
    open_end = max(swing.ends, key=lambda end: math.dist(end, closed))
    pieces = [LineString(pair) for line in lines for pair in _straight(line)]
    is_small = sum(line.length for line in lines) < MOST_LEAF * swing.radius_m
    return is_small and any(_is_leaf(piece, swing.hinge, open_end) for piece in pieces)


def symbols_of(lines: Sequence[LineString]) -> list[Symbol]:
    """Loose lines as symbols: those that touch belong together."""
    if not lines:
        return []
    blots = shapely.get_parts(shapely.union_all([line.buffer(JOIN_M / 2) for line in lines]))
    groups: dict[int, list[LineString]] = {}
    which, blot = shapely.STRtree(blots).query(np.array(lines, dtype=object), predicate="intersects")
    for k, number in zip(which, blot, strict=True):
        groups.setdefault(int(number), []).append(lines[int(k)])
    return [symbol_of(group) for group in groups.values()]


def paired(symbols: Sequence[Symbol]) -> list[Symbol]:
    """Symbols; two of one leaf each whose arcs meet become one: a double door that is drawn as two blocks."""
    single = [symbol for symbol in symbols if len(symbol.swings) == 1]
    left = [symbol for symbol in symbols if len(symbol.swings) != 1]
    ends = shapely.points(np.array([symbol.swings[0].ends for symbol in single]).reshape(-1, 2))
    near = shapely.STRtree(ends).query(ends, predicate="dwithin", distance=LEAF_M) if single else ()
    taken: set[int] = set()
    for k, other in sorted({(int(a) // 2, int(b) // 2) for a, b in zip(*near, strict=True)} if single else ()):
        one, two = single[k].swings[0], single[other].swings[0]
        apart = math.dist(one.hinge, two.hinge)
        if k < other and not taken & {k, other} and abs(apart - one.radius_m - two.radius_m) < LEAF_M:
            taken |= {k, other}
            left.append(Symbol(single[k].lines + single[other].lines, (one, two)))
    return left + [symbol for k, symbol in enumerate(single) if k not in taken]


def swings_in(line: LineString) -> Iterator[Swing]:
    """The swings along a polyline."""
    points = shapely.get_coordinates(line)
    if not 4 <= len(points) <= MOST_CORNERS:
        return
    for first, last in _runs(points):
        swing = _circle(points[first : last + 1])
        if swing is not None:
            yield swing


def _runs(points: Floats) -> Iterator[tuple[int, int]]:
    """First and last index of the points of each stretch that turns the same way by small angles."""
    steps = np.diff(points, axis=0)
    heading = np.arctan2(steps[:, 1], steps[:, 0])
    turn = (np.diff(heading) + math.pi) % (2 * math.pi) - math.pi
    curved = (np.abs(turn) >= LEAST_TURN_RAD) & (np.abs(turn) <= MOST_TURN_RAD)
    side = np.where(curved, np.sign(turn), 0.0)
    begin = 0
    for k in range(1, len(side) + 1):
        if k == len(side) or side[k] != side[begin]:
            if side[begin] and k - begin >= 2:
                yield begin, k + 1
            begin = k


def _circle(points: Floats) -> Swing | None:
    """The circle through points (n, 2) by least squares [Kasa 1976]; None when they are on no circle, or it is not a swing."""
    middle = points.mean(axis=0)
    near = points - middle
    system = np.column_stack((2 * near, np.ones(len(near))))
    (a, b, c), _, rank, _ = np.linalg.lstsq(system, (near**2).sum(axis=1), rcond=None)
    if rank < 3 or c + a * a + b * b <= 0.0:
        return None
    radius = math.sqrt(c + a * a + b * b)
    off = np.abs(np.hypot(near[:, 0] - a, near[:, 1] - b) - radius).max()
    angle = np.unwrap(np.arctan2(near[:, 1] - b, near[:, 0] - a))
    sweep = abs(float(angle[-1] - angle[0]))
    if not (NARROWEST_M <= radius <= WIDEST_M and LEAST_SWEEP_RAD <= sweep <= MOST_SWEEP_RAD) or off > OFF * radius:
        return None
    ends = (_point(points[0]), _point(points[-1]))
    return Swing(_point((a + middle[0], b + middle[1])), ends, radius)


def with_leaf(swing: Swing, lines: Sequence[LineString]) -> Swing:
    """The swing with the end that a drawn leaf, a line from the hinge, reaches.

    A threshold may also be drawn to the other end: then no end is chosen.
    """
    straight = [LineString(pair) for line in lines for pair in _straight(line)]
    reached = [k for k, end in enumerate(swing.ends) if any(_is_leaf(line, swing.hinge, end) for line in straight)]
    return replace(swing, leaf=reached[0]) if len(reached) == 1 else swing


def _is_leaf(line: LineString, hinge: Point, end: Point) -> bool:
    a, b = line.coords
    return min(_apart(a, hinge, b, end), _apart(b, hinge, a, end)) < LEAF_M


def _apart(a: Point, hinge: Point, b: Point, end: Point) -> float:
    return max(math.dist(a, hinge), math.dist(b, end))


def _straight(line: LineString) -> Iterator[tuple[Point, Point]]:
    """The pieces of a polyline that are long enough for a leaf."""
    points = [_point(p) for p in line.coords]
    return ((a, b) for a, b in zip(points, points[1:], strict=False) if math.dist(a, b) > NARROWEST_M)


def _point(values: Sequence[float] | Floats) -> Point:
    return round(float(values[0]), 3), round(float(values[1]), 3)
