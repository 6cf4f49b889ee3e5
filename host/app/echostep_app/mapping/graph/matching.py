# SPDX-License-Identifier: MIT
"""How well a stretch of fragments fits older ones when it is moved and turned a little: log-likelihood ratio against a place never seen.

In: fragments in the map, a grid of shifts. Out: log-ratios. Owns the model. A fragment that lies on an older one seen from the same side is explained
by it; one in the space that an older echo found free is contradicted; one where nothing was seen is not evidence.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.jit import inline_part, kernel, part

OFF_SD_M, OFF_SD_RAD = 0.07, math.radians(2.5)  # of two fragments of one wall, each bent by its own stretch of path
CHANCE_M, CHANCE_RAD = 1.5, math.radians(45.0)  # half widths within which a fragment of another wall would lie anywhere
OUTLIER = 0.1  # share of fragments that no older wall explains where it should
FREE_RATIO = math.log(0.15)  # of a fragment in space that was free: furniture and persons move
FREE_M = 0.35  # a fragment this far before an older wall lies in free space
LEAST_HALF_M = 0.05  # length of a fragment seen from its end, by which shares are formed
POWER = 0.5  # of each metre of fragment: errors of a stretch are shared


class Pieces(NamedTuple):
    """Fragments in the map: `x_m`, `y_m` of the middle, `normal_rad`, `half_m`, `sd_rad`, `range_m` from the path to the wall, all (f,)."""

    x_m: Floats
    y_m: Floats
    normal_rad: Floats
    half_m: Floats
    sd_rad: Floats
    range_m: Floats


class PlacedFragment(NamedTuple):
    """One fragment of `Pieces`."""

    x_m: float
    y_m: float
    normal_rad: float
    half_m: float
    sd_rad: float


@kernel
def match(new: Pieces, old: Pieces, pivot: Floats, shifts_m: Floats, turns_rad: Floats) -> Floats:
    """Log-ratio (turns, shifts, shifts) of `new` turned about `pivot` and shifted by x and y.

    The best explanation by an older fragment counts; where none explains the fragment, the worst contradiction.
    """
    n, m = len(shifts_m), len(turns_rad)
    score, fits, free = np.zeros((m, n, n)), np.zeros((n, n)), np.zeros((n, n))
    for i in range(len(new.x_m)):
        power = POWER * min(2.0 * new.half_m[i], 2.0)
        for k in range(m):
            c, s = math.cos(turns_rad[k]), math.sin(turns_rad[k])
            dx, dy = new.x_m[i] - pivot[0], new.y_m[i] - pivot[1]
            x, y = pivot[0] + c * dx - s * dy, pivot[1] + s * dx + c * dy
            piece = PlacedFragment(x, y, new.normal_rad[i] + turns_rad[k], new.half_m[i], new.sd_rad[i])
            fits[:], free[:] = 0.0, 0.0
            for j in range(len(old.x_m)):
                _add_older(fits, free, piece, old, j, shifts_m)
            for a in range(n):
                for b in range(n):
                    score[k, a, b] += power * (fits[a, b] if fits[a, b] > 0.0 else free[a, b])
    return score


@part
def _add_older(fits: Floats, free: Floats, piece: PlacedFragment, old: Pieces, j: int, shifts_m: Floats) -> None:
    """Raise `fits` and lower `free` (shifts, shifts) by the evidence of the older fragment j for a fragment at each shift."""
    n, old_half = len(shifts_m), old.half_m[j]
    ex, ey = piece.x_m - old.x_m[j], piece.y_m - old.y_m[j]
    reach = piece.half_m + old_half + max(old.range_m[j], CHANCE_M) + 1.5 * shifts_m[n - 1]
    if ex * ex + ey * ey > reach * reach:
        return
    c, s = math.cos(old.normal_rad[j]), math.sin(old.normal_rad[j])
    turned = (piece.normal_rad - old.normal_rad[j] + math.pi) % (2.0 * math.pi) - math.pi
    sd = math.sqrt(OFF_SD_RAD**2 + piece.sd_rad**2 + old.sd_rad[j] ** 2)
    angle = normal(turned, sd) * 2.0 * CHANCE_RAD if abs(turned) < CHANCE_RAD else 0.0
    half = piece.half_m * abs(math.cos(turned))  # along the older wall
    # The ratio of the fit is above 1, and counts, within `near` of the older wall only.
    peak = 2.0 * CHANCE_M * angle * normal(0.0, OFF_SD_M)
    near = min(OFF_SD_M * math.sqrt(2.0 * math.log(peak)), CHANCE_M) if peak > 1.0 else 0.0
    for a in range(n):
        for b in range(n):
            fx, fy = ex + shifts_m[a], ey + shifts_m[b]
            off, along = c * fx + s * fy, -s * fx + c * fy
            fitting, freed = abs(off) < near, -old.range_m[j] + FREE_M < off < -FREE_M
            if not fitting and not freed:
                continue
            common = min(along + half, old_half) - max(along - half, -old_half)
            if common <= 0.0:
                continue
            shared = min(common / max(2.0 * half, LEAST_HALF_M), 1.0)
            if fitting:
                value = math.log(OUTLIER + (1.0 - OUTLIER) * normal(off, OFF_SD_M) * 2.0 * CHANCE_M * angle)
                fits[a, b] = max(fits[a, b], shared * value)
            if freed:
                free[a, b] = min(free[a, b], shared * FREE_RATIO)


@inline_part
def normal(x: float, sd: float) -> float:
    """Normal density about zero."""
    z = x / sd
    return math.exp(-0.5 * z * z) / (sd * 2.5066282746310002)
