# SPDX-License-Identifier: MIT
"""The place of a beacon that was first received from afar, or was moved, from several of its readings along the path.

In: readings, each with the boot's place. Out: the beacon's place, or None while several places fit. Owns nothing.
Ranges along a straight path fit two places, one on either side: bearings decide, or a bend of the path does.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.elementary import wrap_angle
from echostep.jit import kernel, part
from echostep.particles.limits import THREE_SD2

# Columns of readings (n, 4): place of the boot (m), range (m), bearing (rad, NaN: not measured)
X, Y, RANGE, BEARING = 0, 1, 2, 3

# Assumed, not measured.
FEWEST = 12  # readings
PATH_M = 3.0  # between the outermost places of the boot
GRID_M = 0.25
FINER = 5.0  # the second grid
READING_SD_M = 0.3
BEARING_SD_RAD = math.radians(30.0)
APART_M = 1.5  # places further apart are two hypotheses
MARGIN = 12.0  # by which the cost of any other hypothesis must be higher
FITTING = 0.6  # share of ranges that must fit within three standard deviations


class LocatedBeacon(NamedTuple):
    """A place (m), and whether the readings allow it and no other."""

    x_m: float
    y_m: float
    sure: bool


@kernel
def locate_beacon(readings: Floats) -> LocatedBeacon:
    """The beacon's place that fits readings (n, 4) best; not sure while they are too few or another place fits nearly as well."""
    if len(readings) < FEWEST or _extent(readings) < PATH_M:
        return LocatedBeacon(np.nan, np.nan, False)
    x, y, far = 0.0, 0.0, 0.0
    for k in range(len(readings)):
        x += readings[k, X] / len(readings)
        y += readings[k, Y] / len(readings)
        far = max(far, readings[k, RANGE])
    cells = int((far + 1.0) / GRID_M)
    x, y, only = _search(readings, x, y, cells, GRID_M)
    if not only:
        return LocatedBeacon(x, y, False)
    x, y, _ = _search(readings, x, y, int(2.0 * FINER), GRID_M / FINER)
    fitting = 0
    for k in range(len(readings)):
        away = math.hypot(readings[k, X] - x, readings[k, Y] - y)
        fitting += abs(away - readings[k, RANGE]) < 3.0 * READING_SD_M
    return LocatedBeacon(x, y, fitting >= FITTING * len(readings))


@part
def _extent(readings: Floats) -> float:
    """Diagonal (m) of the box that holds the boot's places."""
    x, y = readings[:, X], readings[:, Y]
    return math.hypot(x.max() - x.min(), y.max() - y.min())


@part
def _search(readings: Floats, x: float, y: float, cells: int, step_m: float) -> tuple[float, float, bool]:
    """The place of least cost on a grid of `cells` cells to each side of (x, y), and whether all others cost more by MARGIN."""
    side = 2 * cells + 1
    cost, axes = np.empty((side, side)), np.empty(len(readings))
    best, at_i, at_j = np.inf, 0, 0
    for i in range(side):
        for j in range(side):
            cost[i, j] = _cost(readings, x + (i - cells) * step_m, y + (j - cells) * step_m, axes)
            if cost[i, j] < best:
                best, at_i, at_j = cost[i, j], i, j
    only = True
    for i in range(side):
        for j in range(side):
            apart = math.hypot(i - at_i, j - at_j) * step_m > APART_M
            only = only and not (apart and cost[i, j] - best < MARGIN)
    return x + (at_i - cells) * step_m, y + (at_j - cells) * step_m, only


@part
def _cost(readings: Floats, x: float, y: float, axes: Floats) -> float:
    """Cost of a place: squared normalised residuals of the ranges, and of the bearings from their mean axis. `axes` (n,) is overwritten."""
    cost, sine, cosine = 0.0, 0.0, 0.0
    for k in range(len(readings)):
        dx, dy = readings[k, X] - x, readings[k, Y] - y
        residual = (math.sqrt(dx * dx + dy * dy) - readings[k, RANGE]) / READING_SD_M
        cost += min(residual * residual, THREE_SD2)
        axes[k] = math.atan2(dy, dx) - readings[k, BEARING]  # the beacon's axis by this reading
        if not math.isnan(axes[k]):
            sine += math.sin(axes[k])
            cosine += math.cos(axes[k])
    axis = math.atan2(sine, cosine)
    for k in range(len(readings)):
        if not math.isnan(axes[k]):
            residual = wrap_angle(axes[k] - axis) / BEARING_SD_RAD
            cost += min(residual * residual, THREE_SD2)
    return cost
