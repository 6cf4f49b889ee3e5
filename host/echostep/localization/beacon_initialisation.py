"""The place of a beacon that was first heard from afar, from several of its readings along the path.

In: readings, each with the boot's place. Out: the beacon's place, or None while several places fit. Owns nothing.
Ranges along a straight path fit two places, one on either side: bearings decide, or a bend of the path does.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats

X, Y, RANGE, BEARING = (
    0,
    1,
    2,
    3,
)  # columns of readings (n, 4): place of the boot (m), range (m), bearing (rad, NaN: not measured)

# All constants here are by reason.
FEWEST = 12  # readings
PATH_M = 3.0  # between the outermost places of the boot
GRID_M = 0.25
FINER = 5.0  # the second grid
RANGE_SD_M = 0.3
BEARING_SD_RAD = math.radians(30.0)
OUTLIER_COST = 9.0  # greatest cost of one reading: three standard deviations, squared
APART_M = 1.5  # places further apart are two hypotheses
MARGIN = 12.0  # by which the cost of any other hypothesis must be higher
FITTING = 0.6  # share of ranges that must fit within three standard deviations


def locate_beacon(readings: Floats) -> tuple[float, float] | None:
    """The beacon's place (x, y) that fits readings (n, 4) best; None while they are too few or another place fits nearly as well."""
    places = readings[:, : Y + 1]
    if len(readings) < FEWEST or math.hypot(*np.ptp(places, axis=0)) < PATH_M:
        return None
    best, cost, grid = _search(readings, places.mean(0), float(readings[:, RANGE].max()) + 1.0, GRID_M)
    others = np.hypot(*(grid - best).T) > APART_M
    if others.any() and cost[others].min() - cost.min() < MARGIN:
        return None
    best, _, _ = _search(readings, best, 2.0 * GRID_M, GRID_M / FINER)
    residual = np.hypot(*(places - best).T) - readings[:, RANGE]
    if (np.abs(residual) < 3.0 * RANGE_SD_M).mean() < FITTING:
        return None
    return float(best[0]), float(best[1])


def _search(readings: Floats, centre: Floats, reach_m: float, step_m: float) -> tuple[Floats, Floats, Floats]:
    """The place of least cost on a grid about a centre, the costs (m,), and the grid (m, 2)."""
    side = np.arange(-reach_m, reach_m + 0.5 * step_m, step_m)
    grid = centre + np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    dx, dy = readings[:, X] - grid[:, :1], readings[:, Y] - grid[:, 1:]
    cost = np.minimum(((np.hypot(dx, dy) - readings[:, RANGE]) / RANGE_SD_M) ** 2, OUTLIER_COST).sum(1)
    has_bearing = ~np.isnan(readings[:, BEARING])
    if has_bearing.any():
        axes = np.arctan2(dy, dx)[:, has_bearing] - readings[has_bearing, BEARING]  # the beacon's axis by each reading
        axis = np.arctan2(np.sin(axes).sum(1), np.cos(axes).sum(1))
        residual = np.angle(np.exp(1j * (axes - axis[:, None])))
        cost = cost + np.minimum((residual / BEARING_SD_RAD) ** 2, OUTLIER_COST).sum(1)
    return grid[cost.argmin()], cost, grid
