# SPDX-License-Identifier: MIT
"""Echo sources that can be detected from somewhere in one tile, and the walls (screens) that may hide each from there.

In: the walls of a `WallIndex` and a tile. Out: its faces and points as two `SourceTable`s. Owns nothing.
A face is a wall that can reflect sound straight back, a point is a place where walls end or meet. All answers are safe: a source that is left out can
be detected from nowhere in the tile, and a wall that is not among the screens hides nothing from anywhere in it. So a query from a place in the tile
gets the exact answer from a few walls [potentially visible sets, Teller and Sequin 1991].
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Int32s
from echostep.jit import part
from echostep.walls.index import EAR_REACH_M, JOIN_M, TILE_M, SourceTable, WallIndex
from echostep.walls.tile_faces import tile_faces
from echostep.walls.tile_geometry import SLACK_M
from echostep.walls.tile_points import tile_points


@part
def tile_sources(tile: int, index: WallIndex, slant: float) -> tuple[SourceTable, SourceTable]:
    """Faces and points that can be detected from a tile, for sound up to `slant` (tangent) off the normal of a wall."""
    corners = np.empty((4, 2))
    x, y = index.x0_m + tile % index.columns * TILE_M, index.y0_m + tile // index.columns * TILE_M
    for k in range(4):
        corners[k, 0] = x + (TILE_M + SLACK_M if k in (1, 2) else -SLACK_M)
        corners[k, 1] = y + (TILE_M + SLACK_M if k in (2, 3) else -SLACK_M)
    near = _walls_near(tile, index)
    return tile_faces(corners, near, index.walls, slant), tile_points(corners, near, index)


@part
def _walls_near(tile: int, index: WallIndex) -> Int32s:
    """Numbers of the walls that may be within EAR_REACH_M of a tile, ascending."""
    reach = math.ceil((EAR_REACH_M + JOIN_M) / TILE_M)
    column, row = tile % index.columns, tile // index.columns
    left, right = max(column - reach, 0), min(column + reach + 1, index.columns)
    numbers = np.empty(64, np.int32)
    count = 0
    for r in range(max(row - reach, 0), min(row + reach + 1, index.rows)):
        for k in range(index.start[r * index.columns + left], index.start[r * index.columns + right]):
            if count == len(numbers):
                numbers = np.concatenate((numbers, numbers))
            numbers[count] = index.ids[k]
            count += 1
    numbers = np.sort(numbers[:count])
    unique = 0
    for k in range(count):
        if unique == 0 or numbers[k] != numbers[unique - 1]:
            numbers[unique] = numbers[k]
            unique += 1
    return numbers[:unique]
