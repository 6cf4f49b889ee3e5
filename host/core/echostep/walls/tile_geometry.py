# SPDX-License-Identifier: MIT
"""Geometry for faces and points: a wall's own axes, spans that cover a stretch, rows by bearing.

In: walls, spans, bearings of rows. Out: frames, whether spans cover, order of rows. Owns nothing.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats, Int32s
from echostep.jit import inline_part, lean_part, part
from echostep.walls.index import BEARINGS, CONE_RAD

SLACK_M = 1e-6  # rounding of lengths


@inline_part
def frame(walls: Floats, w: int) -> tuple[float, float, float, float, float]:
    """Start of a wall, its unit tangent and its length."""
    ux, uy = walls[w, 2] - walls[w, 0], walls[w, 3] - walls[w, 1]
    length = math.hypot(ux, uy)
    return walls[w, 0], walls[w, 1], ux / length, uy / length, length


@lean_part
def covered(spans: Floats, low: float, high: float, overlap: float) -> bool:
    """Whether spans (from, to, h there, h there) leave no gap between low and high; two that do not join must overlap by `overlap`."""
    reach, height = low, np.nan
    while reach < high:
        best, best_height = reach, height
        for k in range(len(spans)):
            joined = spans[k, 0] <= reach and abs(spans[k, 2] - height) < SLACK_M
            if (joined or spans[k, 0] <= max(reach - overlap, low)) and spans[k, 1] > best:
                best, best_height = spans[k, 1], spans[k, 3]
        if best == reach:
            return False
        reach, height = best, best_height
    return True


@part
def by_bearing(rows: Floats, at: int) -> tuple[Int32s, Int32s]:
    """For each bearing of an axis, the rows that may be within CONE_RAD of it, nearest first, as starts and row numbers.

    Their columns from `at` on: distance, bearing from the tile, the greatest deviation from it.
    """
    start, order, count = np.zeros(BEARINGS + 1, np.int32), np.empty(BEARINGS * len(rows), np.int32), 0
    width = 2.0 * math.pi / BEARINGS
    for b in range(BEARINGS):
        for i in range(len(rows)):
            off = (b + 0.5) * width - rows[i, at + 1]
            off = abs(off - 2.0 * math.pi * math.floor(off / (2.0 * math.pi) + 0.5))
            if off <= CONE_RAD + 0.5 * width + rows[i, at + 2] + SLACK_M:
                slot = count
                while slot > start[b] and rows[order[slot - 1], at] > rows[i, at]:
                    order[slot] = order[slot - 1]
                    slot -= 1
                order[slot] = i
                count += 1
        start[b + 1] = count
    return start, order[:count].copy()
