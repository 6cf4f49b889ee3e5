"""Where a beacon lies that was first heard from afar: found from what it said along a piece of the way, before anybody is weighed by it.

In: places of the boot with the ranges and bearings measured there. Out: the beacon's place, or none while there are several that fit. Owns nothing.
Ranges along a straight way fit two places, one on either side: the bearings decide, or a bend of the way does.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats

FEWEST = 12
WAY_M = 3.0  # between the outermost places of the boot
GRID_M = 0.25
RANGE_SD_M = 0.3
BEARING_SD_RAD = math.radians(30.0)
WORST = 9.0  # squares: an outlier costs no more
APART_M = 1.5  # two places
SURER = 12.0  # by which the cost of any other place must be higher
FITTING = 0.6  # share of ranges that must fit


def found_place(words: Floats) -> tuple[float, float] | None:
    """The beacon (x, y) that explains words (n, 4): x, y of the boot, range (m), bearing (rad, NaN: not measured); None while it is not certain."""
    if len(words) < FEWEST or math.hypot(*np.ptp(words[:, :2], axis=0)) < WAY_M:
        return None
    best, cost, grid = _cheapest(words, words[:, :2].mean(0), float(words[:, 2].max()) + 1.0, GRID_M)
    apart = np.hypot(*(grid - best).T) > APART_M
    if apart.any() and cost[apart].min() - cost.min() < SURER:
        return None
    best, _, _ = _cheapest(words, best, 2.0 * GRID_M, GRID_M / 5.0)
    off = np.hypot(*(words[:, :2] - best).T) - words[:, 2]
    if (np.abs(off) < 3.0 * RANGE_SD_M).mean() < FITTING:
        return None
    return float(best[0]), float(best[1])


def _cheapest(words: Floats, middle: Floats, reach_m: float, step_m: float) -> tuple[Floats, Floats, Floats]:
    """The cheapest place of a grid about a middle, the costs (m,), and the grid (m, 2)."""
    side = np.arange(-reach_m, reach_m + 0.5 * step_m, step_m)
    grid = middle + np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    dx, dy = words[:, 0] - grid[:, :1], words[:, 1] - grid[:, 1:]
    cost = np.minimum(((np.hypot(dx, dy) - words[:, 2]) / RANGE_SD_M) ** 2, WORST).sum(1)
    told = ~np.isnan(words[:, 3])
    if told.any():
        gap = np.arctan2(dy, dx)[:, told] - words[told, 3]  # the axis, by each word
        axis = np.arctan2(np.sin(gap).sum(1), np.cos(gap).sum(1))
        off = np.angle(np.exp(1j * (gap - axis[:, None])))
        cost = cost + np.minimum((off / BEARING_SD_RAD) ** 2, WORST).sum(1)
    return grid[cost.argmin()], cost, grid
