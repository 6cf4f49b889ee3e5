# SPDX-License-Identifier: MIT
"""Doors of a drawing: the line from jamb to jamb, derived from the door's symbol.

In: blocks, arcs and lines on the layers of doors; walls. Out: `Door`s. Owns nothing. A swing is an arc about the hinge: the door goes from the hinge
to the end of the arc that is nearer to a wall. Two swings of one block are a double door. A door without a swing goes along its longest side.

            ,-'| leaf
          ,'   |        arc: from the leaf's end to the jamb
    =====+.....o=====   o: hinge, +: end of the arc at the wall, .....: the door's line
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry import LineString, Point
from shapely.geometry.base import BaseGeometry

from echostep.plan.importers.drawn_level import opening
from echostep.plan.importers.dxf.entities import DrawingFrame, parts
from echostep.plan.model import Door

NARROWEST_M, WIDEST_M = 0.3, 12.0
LEAF_M = 0.1  # greatest distance of a leaf's line from the hinge; assumed
Line = tuple[float, float, float, float]


def doors_of(entities: Sequence[Any], walls: Sequence[BaseGeometry], frame: DrawingFrame, file: Path) -> list[Door]:
    """Doors of blocks, then of swings outside blocks, then of other lines outside blocks that belong to no swing."""
    stone = shapely.STRtree(list(walls))
    blocks = [entity for entity in entities if entity.dxftype() == "INSERT"]
    lines: list[Line] = []
    for block in blocks:
        swings, rest = _shapes(_drawn(block, file), frame, file)
        lines += _double(swings) or [_gap(swing, stone) for swing in swings] or _longest(rest, LEAF_M)
    swings, rest = _shapes([entity for entity in entities if entity.dxftype() != "INSERT"], frame, file)
    hinges = shapely.union_all([Point(swing[0]) for swing in swings])
    loose = [line for line in rest if hinges.is_empty or line.distance(hinges) > LEAF_M]
    lines += [_gap(swing, stone) for swing in swings] + _longest(loose, 0.01)
    sound = [line for line in dict.fromkeys(lines) if NARROWEST_M <= math.dist(line[:2], line[2:]) <= WIDEST_M]
    return [Door(line) for line in sound]


def _drawn(block: Any, file: Path, depth: int = 4) -> list[Any]:
    """All entities of a block and of the blocks inside it, `depth` levels deep."""
    inner = parts(block, file)
    deeper = [part for part in inner if part.dxftype() == "INSERT"] if depth else []
    return [part for part in inner if part.dxftype() != "INSERT"] + [
        p for part in deeper for p in _drawn(part, file, depth - 1)
    ]


Swing = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]  # hinge, both ends of the arc


def _shapes(drawn: Sequence[Any], frame: DrawingFrame, file: Path) -> tuple[list[Swing], list[LineString]]:
    """Swings (arcs with hinge), and all other lines."""
    swings, rest = [], []
    for entity in drawn:
        line = frame.line(entity, file)
        if line is None:
            continue
        if entity.dxftype() == "ARC":
            centre = frame.metres(entity.ocs().to_wcs(entity.dxf.center))
            swings.append((_mm(centre), _mm(line.coords[0]), _mm(line.coords[-1])))
        else:
            rest.append(line)
    return swings, rest


def _double(swings: list[Swing]) -> list[Line]:
    """A double door from hinge to hinge, when two swings meet in the middle; else empty."""
    if len(swings) != 2:
        return []
    (a, *ends_a), (b, *ends_b) = swings
    apart = math.dist(a, b)
    reach = math.dist(a, ends_a[0]) + math.dist(b, ends_b[0])
    return [(*a, *b)] if abs(apart - reach) < 0.1 * reach else []


def _gap(swing: Swing, stone: shapely.STRtree) -> Line:
    """From the hinge to the end of the arc that is nearer to a wall."""
    hinge, *ends = swing
    distances = [_distance(end, stone) for end in ends]
    return (*hinge, *ends[int(np.argmin(distances))])


def _distance(point: tuple[float, float], stone: shapely.STRtree) -> float:
    nearest = stone.query_nearest(Point(point), return_distance=True)[1]
    return float(nearest[0]) if len(nearest) else 0.0


def _longest(lines: list[LineString], join_m: float) -> list[Line]:
    """The centre line of each group of connected lines, along its longer side."""
    blots = shapely.get_parts(shapely.union_all([line.buffer(join_m) for line in lines]))
    sides = []
    for blot in blots:
        x0, y0, x1, y1 = opening(blot)
        long_m = math.dist((x0, y0), (x1, y1))
        if long_m > 4 * join_m:  # the blot is wider than the drawing by join_m at each end
            x, y = (x1 - x0) * join_m / long_m, (y1 - y0) * join_m / long_m
            sides.append((round(x0 + x, 3), round(y0 + y, 3), round(x1 - x, 3), round(y1 - y, 3)))
    return sides


def _mm(point: Sequence[float]) -> tuple[float, float]:
    return round(float(point[0]), 3), round(float(point[1]), 3)
