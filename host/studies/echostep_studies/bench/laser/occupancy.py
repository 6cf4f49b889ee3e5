# SPDX-License-Identifier: MIT
"""Counts of laser beams that ended in or passed each cell of a grid, and the occupied places [the counting model of Haehnel 2003].

In: scans with poses. Out: occupied places (n, 2), one a cell. Owns nothing. A cell is occupied, and no
passer-by, where at least STANDING of the beams that reached it ended in it.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.errors import EchostepError
from echostep.jit import kernel
from echostep_studies.bench.laser.carmen_log import CarmenLog

CELL_M = 0.1
STANDING = 0.25  # [GMapping's threshold of an occupied cell]
USED_M = 10.0  # longer beams are left out: half a degree of pose error is 9 cm there
NO_RETURN = 0.98  # a range above this share of the log's greatest is none
MOST_CELLS = 40_000_000


def standing_places(log: CarmenLog, scans: Ints) -> Floats:
    """Mean end point (n, 2) of the beams in each cell that stands, from the scans of these numbers."""
    pose, range_m = log.pose[scans], log.range_m[scans]
    bearing = pose[:, 2:] + log.angles_rad
    usable = (range_m > 0.0) & (range_m < min(USED_M, NO_RETURN * float(log.range_m.max())))
    ends = pose[:, None, :2] + range_m[..., None] * np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)
    begins = np.broadcast_to(pose[:, None, :2], ends.shape)[usable]
    ends = ends[usable]
    both = np.vstack([begins, ends]) if len(ends) else np.zeros((1, 2))
    low = both.min(0) - CELL_M
    columns, rows = (int(v) for v in np.ceil((both.max(0) + CELL_M - low) / CELL_M))
    if columns * rows > MOST_CELLS:
        raise EchostepError(f"{log.name}: scans over {columns * CELL_M:.0f} x {rows * CELL_M:.0f} m: too large a map")
    hits, passes, sums = np.zeros((rows, columns)), np.zeros((rows, columns)), np.zeros((rows, columns, 2))
    _count_beams((begins - low) / CELL_M, (ends - low) / CELL_M, hits, passes, sums)
    stands = hits > STANDING * (hits + passes)
    return np.asarray(low + CELL_M * sums[stands] / hits[stands, None])


@kernel
def _count_beams(begins: Floats, ends: Floats, hits: Floats, passes: Floats, sums: Floats) -> None:
    """Add beams (n, 2), in cells, to the counts; a beam passes each cell before its last once. `sums`: of the end points in each cell."""
    for k in range(len(ends)):
        dx, dy = ends[k, 0] - begins[k, 0], ends[k, 1] - begins[k, 1]
        last_row, last_column = int(ends[k, 1]), int(ends[k, 0])
        steps = 2 * int(math.hypot(dx, dy)) + 1
        row, column = -1, -1
        for i in range(steps):
            s = i / steps
            r, c = int(begins[k, 1] + s * dy), int(begins[k, 0] + s * dx)
            if (r != row or c != column) and (r != last_row or c != last_column):
                passes[r, c] += 1.0
            row, column = r, c
        hits[last_row, last_column] += 1.0
        sums[last_row, last_column, 0] += ends[k, 0]
        sums[last_row, last_column, 1] += ends[k, 1]
