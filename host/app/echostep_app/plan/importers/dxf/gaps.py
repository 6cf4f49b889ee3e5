# SPDX-License-Identifier: MIT
"""Gaps in the walls along a line: where the wall ends before a place on it, and where it begins again.

In: walls as lines, a place, a direction. Out: `Gap`s. Owns the width of the band that is searched.
Works for walls drawn as one line, as two faces with or without ends, and for a gap that ends at a corner.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from echostep.arrays import Floats
from echostep_app.plan.importers.straight import pieces_of

BAND_M = 0.1  # half the width of the band along a door's line in which walls count; assumed
NEAR_M = 0.35  # greatest distance of a hinge from the wall that it hangs on: frame and lining; assumed
JAMB_M = 0.3  # shorter pieces of a wall give no direction: its ends, jambs, linings; assumed
THICKEST_M = 0.95  # of a wall with a door, as of a castle; assumed
STOP_M, FLAT_M = 0.03, 2e-3  # a wall this near to a door's end stops there; closer faces are one
WIDE_BAND_M = 0.2  # half the thickness of an outer wall, and a margin; assumed
BY_M = 0.15  # a point nearer to a wall than this is at it
Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Gap:
    """Free of walls from `begin_m` to `end_m` along a line, both measured from the place asked about; infinite where no wall ends it."""

    begin_m: float
    end_m: float

    @property
    def width_m(self) -> float:
        """Its width."""
        return self.end_m - self.begin_m


class WallBands:
    """Finds gaps in the walls of a level."""

    def __init__(self, walls: Sequence[LineString]) -> None:
        self.band_m = BAND_M
        self.pieces = pieces_of(walls)
        self.pieces = self.pieces[np.hypot(*(self.pieces[:, 2:] - self.pieces[:, :2]).T) > 0.0]
        self._lines = shapely.linestrings(self.pieces.reshape(-1, 2, 2))
        self._tree = shapely.STRtree(self._lines)

    def gap(self, at: Point, along: Point, middle_m: float, reach_m: float) -> Gap | None:
        """The gap around the place `middle_m` from `at` in the direction `along`, within `reach_m` to both sides.

        None where a wall is at that place.
        """
        x, y = at
        u, v = along
        band = self._band(x, y, u, v, middle_m - reach_m, middle_m + reach_m)
        begin, end = -math.inf, math.inf
        for k in self._tree.query(band, predicate="intersects"):
            for low, high in _intervals(self._lines[k].intersection(band), x, y, u, v):
                if low < middle_m - 0.05 and high > middle_m + 0.05:
                    return None
                if high <= middle_m + 0.05:
                    begin = max(begin, high)
                else:
                    end = min(end, low)
        return Gap(begin, end) if end - begin > 0.0 else None

    def _band(self, x: float, y: float, u: float, v: float, begin: float, end: float) -> Polygon:
        corners = [(begin, -self.band_m), (end, -self.band_m), (end, self.band_m), (begin, self.band_m)]
        return Polygon([(x + s * u - t * v, y + s * v + t * u) for s, t in corners])

    def wider(self) -> WallBands:
        """The same walls, searched in a band that reaches from a face to the axis by which a thick wall is drawn."""
        wide = copy(self)
        wide.band_m = WIDE_BAND_M
        return wide

    def wall_at(self, end: Point, outward: Point) -> tuple[float, float] | None:
        """Offsets (m), to the left of `outward`, of both faces of the wall that stops at a door's end and continues in the direction `outward`.

        Both are equal for a wall drawn as one line; None if no wall stops there.
        """
        near = self.pieces[self._tree.query(shapely.Point(end), predicate="dwithin", distance=THICKEST_M)]
        if not len(near):
            return None
        rows = (near.reshape(-1, 2, 2) - end) @ np.array([outward, (-outward[1], outward[0])]).T
        # Each begins with its end nearer to the door
        rows = np.take_along_axis(rows, np.argsort(rows[:, :, :1], axis=1), axis=1)
        (begin, off), far = rows[:, 0].T, rows[:, 1]
        stops = (np.abs(begin) < STOP_M) & (far[:, 0] > STOP_M) & (np.abs(far[:, 1] - off) < 0.1 * (far[:, 0] - begin))
        return _faces(np.sort(off[stops]))

    def directions(self, at: Point) -> list[Point]:
        """Unit vectors along the walls near a point, each both ways, without repetition, the nearest wall first."""
        x, y = at
        point = shapely.Point(x, y)
        near = self._tree.query(point, predicate="dwithin", distance=NEAR_M)
        near = near[np.argsort(shapely.distance(self._lines[near], point), kind="stable")]
        found: list[Point] = []
        for x0, y0, x1, y1 in self.pieces[near].tolist():
            length = math.hypot(x1 - x0, y1 - y0)
            one = (x1 - x0) / length, (y1 - y0) / length
            if length >= JAMB_M and not any(abs(one[0] * v - one[1] * u) < 0.1 for u, v in found):
                found += [one, (-one[0], -one[1])]
        return found

    def is_at_wall(self, at: Point, within_m: float = BY_M) -> bool:
        """Whether a point is at a wall."""
        return len(self._tree.query(shapely.Point(*at), predicate="dwithin", distance=within_m)) > 0

    def faces(self, line: tuple[float, float, float, float], within_m: float) -> BaseGeometry:
        """The area of the wall that runs through a door's line: between the outermost of its faces along the line that pass both ends."""
        x0, y0, x1, y1 = line
        length = math.dist(line[:2], line[2:])
        u, v = (x1 - x0) / length, (y1 - y0) / length
        near = self.pieces[self._tree.query(LineString((line[:2], line[2:])), predicate="dwithin", distance=within_m)]
        along = np.stack((near[:, ::2] - x0, near[:, 1::2] - y0), axis=-1)
        way, off = along @ np.array((u, v)), along @ np.array((-v, u))
        passing = (way.min(axis=1) <= 0.05) & (way.max(axis=1) >= length - 0.05) & (np.ptp(off, axis=1) < 0.05)
        sides = np.append(off[passing].mean(axis=1), 0.0)
        low, high = sides.min() - 0.05, sides.max() + 0.05
        corners = [(0.0, low), (length, low), (length, high), (0.0, high)]
        return Polygon([(x0 + s * u - t * v, y0 + s * v + t * u) for s, t in corners])


def _faces(offsets: Floats) -> tuple[float, float] | None:
    """The two offsets of the wall that a door's end lies in: the nearest ones on both its sides, else the two nearest ones."""
    if not len(offsets):
        return None
    below, above = offsets[offsets < -FLAT_M], offsets[offsets > FLAT_M]
    if len(below) and len(above) and above[0] - below[-1] < THICKEST_M:
        return float(below[-1]), float(above[0])
    first = offsets[np.abs(offsets).argmin()]
    others = offsets[(np.abs(offsets - first) > FLAT_M) & (np.abs(offsets - first) < THICKEST_M)]
    second = others[np.abs(others - first).argmin()] if len(others) else first
    return float(min(first, second)), float(max(first, second))


def _intervals(part: BaseGeometry, x: float, y: float, u: float, v: float) -> list[tuple[float, float]]:
    """Extents of each piece along the line."""
    rows: list[Floats] = [shapely.get_coordinates(piece) for piece in shapely.get_parts(part)]
    ways = [(row[:, 0] - x) * u + (row[:, 1] - y) * v for row in rows if len(row)]
    return [(float(way.min()), float(way.max())) for way in ways]
