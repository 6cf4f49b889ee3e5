# SPDX-License-Identifier: MIT
"""Lines to straight pieces; merges the pieces of a straight wall into one segment.

In: lines; segments (n, 4) in metres, in any order, overlapping or repeated. Out: fewer segments that cover the same points. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from echostep.arrays import Bools, Floats

OFF_M = 0.003  # usual greatest distance of a piece from the wall's line
ROUNDED_M = 1.1e-3  # of an end by the rounding of coordinates, whatever the length of its piece
GAP_M = 0.003  # greatest gap between two pieces along it


def pieces_of(lines: Sequence[BaseGeometry]) -> Floats:
    """The straight pieces (n, 4) of lines."""
    rows = [np.zeros((0, 4))]
    for line in lines:
        points = shapely.get_coordinates(line)
        rows.append(np.concatenate((points[:-1], points[1:]), axis=1))
    return np.concatenate(rows)


def merge_collinear(segments: Floats, off_m: float = OFF_M) -> Floats:
    """Join pieces that continue or cover each other, up to `off_m` from the line. Walls end where pieces do; the longest piece's comes first."""
    if not len(segments):
        return segments
    segments = segments[np.argsort(-np.hypot(*(segments[:, 2:] - segments[:, :2]).T), kind="stable")]
    tree = shapely.STRtree(shapely.linestrings(segments.reshape(-1, 2, 2)))
    free = np.ones(len(segments), dtype=bool)
    walls = [_grown(i, segments, tree, free, off_m) for i in range(len(segments)) if free[i]]
    return np.array(walls)


def _grown(i: int, segments: Floats, tree: shapely.STRtree, free: Bools, off_m: float) -> Floats:
    """The wall that grows from piece i by every free piece (mask `free`) that lies on its line and touches it."""
    wall, by_m = segments[i], max(GAP_M, off_m)
    free[i] = False
    while True:
        x0, y0, x1, y1 = wall.tolist()
        near = tree.query(shapely.box(min(x0, x1) - by_m, min(y0, y1) - by_m, max(x0, x1) + by_m, max(y0, y1) + by_m))
        near = near[free[near]]
        if len(near):
            near = near[_on_line(wall, segments[near], off_m)]
        if not len(near):
            return wall
        free[near] = False
        wall = _span(wall, segments[near])


def _on_line(wall: Floats, others: Floats, off_m: float) -> Bools:
    """Mask (n,) of the pieces that lie on the wall's line and touch the wall."""
    start, along = wall[:2], wall[2:] - wall[:2]
    length = np.hypot(*along)
    along = along / length
    ends = others.reshape(-1, 2, 2) - start
    off = np.abs(ends[..., 0] * along[1] - ends[..., 1] * along[0])
    way = ends @ along
    off, begin, end = np.maximum(*off.T), np.minimum(*way.T), np.maximum(*way.T)
    touching = (begin <= length + GAP_M) & (end >= -GAP_M)
    straight = off <= np.minimum(off_m, np.maximum(0.05 * (end - begin), ROUNDED_M))
    inside = (begin >= -GAP_M) & (end <= length + GAP_M) & (off <= off_m)
    return np.asarray(touching & (straight | inside))


def _span(wall: Floats, others: Floats) -> Floats:
    """The segment between the two outermost ends along the wall."""
    ends = np.concatenate((wall.reshape(2, 2), others.reshape(-1, 2)))
    way = (ends - wall[:2]) @ (wall[2:] - wall[:2])
    return np.concatenate((ends[way.argmin()], ends[way.argmax()]))
