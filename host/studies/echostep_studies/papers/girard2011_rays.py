# SPDX-License-Identifier: MIT
"""Readings of both rangers at many poses, by rays that walk through the tiles of the wall index [Amanatides, Woo 1987].

In: poses, the walls. Out: for each ranger the shortest ray that counts [Girard 2011, eq. 3]. Owns nothing.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep.jit import kernel, part
from echostep.walls.index import TILE_M, WallIndex, tile_at

AHEAD_M = 1e-9  # a ray goes on so far behind the border of a tile


@kernel
def lambda_ray_ranges(
    x: Floats, y: Floats, heading_rad: Floats, index: WallIndex,
    rays: int = 7, aperture_rad: float = math.radians(55.0), maximum_m: float = 6.0,
) -> Floats:  # fmt: skip
    """Readings (n, 2) of the left and the right ranger at n poses (m, rad) [Girard 2011, eq. 3].

    Each ranger sends `rays` rays, `aperture_rad` / `rays` apart about its axis. A ray ends at the first wall it meets, and counts if it meets that
    within half the spacing from its normal. The reading is the shortest ray that counts, `maximum_m` if none does.
    """
    ranges = np.full((len(x), 2), maximum_m)
    least = math.cos(0.5 * aperture_rad / rays)
    for i in range(len(x)):
        for ranger in range(2):
            for k in range(rays):
                angle = heading_rad[i] + (0.5 - ranger) * math.pi + ((k + 0.5) / rays - 0.5) * aperture_rad
                length, cosine = _first_wall(x[i], y[i], math.cos(angle), math.sin(angle), index, ranges[i, ranger])
                if cosine >= least:
                    ranges[i, ranger] = length
    return ranges


@part
def _first_wall(px: float, py: float, ux: float, uy: float, index: WallIndex, limit_m: float) -> tuple[float, float]:
    """Distance of the first wall on a ray, and the cosine between the ray and its normal (-1: none within `limit_m`)."""
    walls, start, ids = index.walls, index.start, index.ids
    nearest, cosine, entered = limit_m, -1.0, 0.0
    while entered < nearest:
        tile = tile_at(px + (entered + AHEAD_M) * ux, py + (entered + AHEAD_M) * uy, index)
        if tile < 0:
            break
        for w in ids[start[tile] : start[tile + 1]]:
            ax, ay, vx, vy = walls[w, 0], walls[w, 1], walls[w, 2] - walls[w, 0], walls[w, 3] - walls[w, 1]
            across = ux * vy - uy * vx
            if across == 0.0:
                continue
            length = ((ax - px) * vy - (ay - py) * vx) / across
            place = ((ax - px) * uy - (ay - py) * ux) / across
            if 0.0 <= place <= 1.0 and 0.0 < length < nearest:
                nearest, cosine = length, abs(across) / math.sqrt(vx * vx + vy * vy)
        column, row = tile % index.columns, tile // index.columns
        to_x, to_y = np.inf, np.inf
        if ux != 0.0:
            to_x = (index.x0_m + (column + (1 if ux > 0.0 else 0)) * TILE_M - px) / ux
        if uy != 0.0:
            to_y = (index.y0_m + (row + (1 if uy > 0.0 else 0)) * TILE_M - py) / uy
        entered = max(min(to_x, to_y), entered + AHEAD_M)
    return nearest, cosine
