"""Pieces of one straight wall -> one segment.

In: segments (n, 4) in metres, in any order, overlapping or doubled. Out: fewer segments that cover the same. Owns nothing.
"""

from __future__ import annotations

import numpy as np
import shapely

from echostep.arrays import Bools, Floats

OFF_M = 0.003  # pieces of one wall lie so close to its line
GAP_M = 0.003  # and so close to each other along it


def merge_collinear(segments: Floats) -> Floats:
    """Join pieces that continue or cover each other. Ends of the joined walls are ends of pieces; the order is that of the longest pieces."""
    if not len(segments):
        return segments
    segments = segments[np.argsort(-np.hypot(*(segments[:, 2:] - segments[:, :2]).T), kind="stable")]
    tree = shapely.STRtree(shapely.linestrings(segments.reshape(-1, 2, 2)))
    free = np.ones(len(segments), dtype=bool)
    walls = [_grown(i, segments, tree, free) for i in range(len(segments)) if free[i]]
    return np.array(walls)


def _grown(i: int, segments: Floats, tree: shapely.STRtree, free: Bools) -> Floats:
    """The wall that begins with piece i and takes every free piece on its line that it touches."""
    wall, fresh = segments[i], True
    free[i] = False
    while fresh:
        near = tree.query(shapely.box(*_bounds(wall)))
        near = near[free[near]]
        near = near[_on_line(wall, segments[near])]
        fresh = len(near) > 0
        if fresh:
            free[near] = False
            wall = _span(wall, segments[near])
    return wall


def _bounds(wall: Floats) -> tuple[float, float, float, float]:
    x, y = wall[::2], wall[1::2]
    return x.min() - GAP_M, y.min() - GAP_M, x.max() + GAP_M, y.max() + GAP_M


def _on_line(wall: Floats, others: Floats) -> Bools:
    """Which pieces lie on the wall's line and touch it."""
    start, along = wall[:2], wall[2:] - wall[:2]
    length = np.hypot(*along)
    along = along / length
    ends = others.reshape(-1, 2, 2) - start
    off = np.abs(ends[..., 0] * along[1] - ends[..., 1] * along[0]).max(1)
    way = ends @ along
    touching = (way.min(1) <= length + GAP_M) & (way.max(1) >= -GAP_M)
    straight = off <= np.minimum(OFF_M, 0.05 * np.maximum(np.ptp(way, axis=1), 1e-9)) + 1e-9
    inside = (way.min(1) >= -GAP_M) & (way.max(1) <= length + GAP_M) & (off <= OFF_M)
    return np.asarray(touching & (straight | inside))


def _span(wall: Floats, others: Floats) -> Floats:
    """From the first end to the last one."""
    ends = np.concatenate((wall.reshape(2, 2), others.reshape(-1, 2)))
    way = (ends - wall[:2]) @ (wall[2:] - wall[:2])
    return np.concatenate((ends[way.argmin()], ends[way.argmax()]))
