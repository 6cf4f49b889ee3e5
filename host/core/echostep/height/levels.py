# SPDX-License-Identifier: MIT
"""Height and level of each particle, from the rise that the foot measured and the height by air pressure.

In: particles after a move, and the `HeightChange` over it. Out: heights, log-weights, and levels (the level shows in x on the sheet). Owns nothing.

On a level a particle has the height of that level, and a rise of the foot is unlikely. The height changes only in a connector: on stairs and ramps
by the foot's rise, or by pressure without a foot; in a lift by pressure. It ends at the lowest and the highest level that the connector serves: a
rise beyond is as unlikely as one on a level. A particle that leaves a connector must have the height of the level it enters. Weather slowly shifts
the height by pressure, so each particle estimates this offset, `lag`: a Kalman filter of one state, whose variance is the same for all particles
[Schoen et al. 2005, the linear part of a marginalised particle filter].
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.jit import kernel, lean_kernel, part
from echostep.particles.arrays import Move, ParticleArrays
from echostep.particles.limits import HALF_STOREY_M, THREE_SD2
from echostep.walls.floor import Floor, inside_grid
from echostep.walls.level_sheet import (
    LIFT,
    LevelSheet,
    connector_at,
    end_of_connector,
    level_of,
    level_on_sheet,
    nearest_level,
)

PRESSURE_TAIL = 3.0  # degrees of freedom of the Student t density of the height by pressure: doors slam
UNKNOWN_LAG_M2 = 1e6  # variance of `lag` before the first height by pressure: no information
# Standard deviation of the height by pressure's speed: a front changes the pressure by 0.4 hPa in an hour
WEATHER_M_S = 1e-3
FALL_PER_M = 1.0  # log-weight lost on a metre of path, assumed: a corner that the plan lacks is passed


@dataclass(frozen=True, slots=True)
class Air:
    """The height by pressure that one barometer shows at the plan's height 0, and its standard deviation (m): the weather, and its own error."""

    zero_m: float
    sd_m: float


@dataclass(frozen=True, slots=True)
class ClimbSettings:
    """Standard deviations in metres, and a limit.

    `flat_sd_m`: rise of the foot after a stride on a level, with door sills. `landing_sd_m`: between a particle's height and the level it enters.
    `drift_m`: random walk of the height by pressure in a second, from weather, doors and fans. `unlikely`: most log-weight that each of the three
    can cost.
    """

    flat_sd_m: float = 0.06
    landing_sd_m: float = 0.35
    drift_m: float = 0.02
    unlikely: float = 8.0


def drift_m(climbing: ClimbSettings, pause_s: float) -> float:
    """Standard deviation of the drift of the height by pressure over a pause without measurements."""
    return math.hypot(climbing.drift_m * math.sqrt(pause_s), WEATHER_M_S * pause_s)


class HeightChange(NamedTuple):
    """Measured change of height over a path segment of duration `span_s`.

    `felt_m`: rise by the foot, with its standard deviation (infinite: no foot). `height_m`: height by pressure on the segment, with its standard
    deviation (infinite: no pressure). `riding_m`: the same at the segment's end, where the height changes (`riding_height`).
    """

    felt_m: float
    felt_sd_m: float
    height_m: float
    height_sd_m: float
    riding_m: float
    span_s: float


class LevelChangeModel(NamedTuple):
    """`ClimbSettings` as the kernel takes them."""

    flat_sd_m: float
    landing_sd_m: float
    unlikely: float


def level_change_model(s: ClimbSettings) -> LevelChangeModel:
    """The settings in the kernel's form."""
    return LevelChangeModel(s.flat_sd_m, s.landing_sd_m, s.unlikely)


class HeightArrays(NamedTuple):
    """Of n particles, each (n,) in metres: height in the plan, and offset of the height by pressure."""

    z_m: Floats
    lag_m: Floats


@kernel
def rise_cost(rise_m: float, change: HeightChange, model: LevelChangeModel) -> float:
    """Log-weight that a rise of the foot costs where none is possible; 0 without a foot."""
    if not math.isfinite(change.felt_sd_m):
        return 0.0
    sd_m = math.hypot(model.flat_sd_m, change.felt_sd_m)
    return min(0.5 * (rise_m / sd_m) ** 2, model.unlikely)


@kernel
def pressure_cost(innovation_m: float, variance_m2: float, model: LevelChangeModel) -> float:
    """Log-weight that an innovation of the height by pressure costs; 0 where its variance is infinite: no pressure."""
    if math.isinf(variance_m2):
        return 0.0
    return min(2.0 * math.log1p(innovation_m * innovation_m / (PRESSURE_TAIL * variance_m2)), model.unlikely)


@kernel
def climb(
    z_m: float, lag_m: float, rise_m: float, connector: int, knows_lag: bool, change: HeightChange, model: LevelChangeModel,
    sheet: LevelSheet,
) -> tuple[float, float, float]:  # fmt: skip
    """In a connector: the new height, how far a rise of the foot led beyond its ends, and the height by pressure to compare it with."""
    if sheet.kind[connector] != LIFT and math.isfinite(change.felt_sd_m):
        end_m = end_of_connector(z_m + rise_m, connector, model.landing_sd_m, sheet)
        return end_m, z_m + rise_m - end_m, change.height_m
    if knows_lag:
        z_m = end_of_connector(change.riding_m - lag_m, connector, model.landing_sd_m, sheet)
        return z_m, 0.0, change.riding_m
    return z_m, 0.0, change.height_m


@lean_kernel
def change_levels(
    particles: ParticleArrays, heights: HeightArrays, move: Move, noise: Floats, change: HeightChange,
    lag_variance: float, model: LevelChangeModel, sheet: LevelSheet,
) -> tuple[float, float]:  # fmt: skip
    """Update heights, levels and log-weights after a move that led to the particles' present places; `noise` (n,) is standard normal.
    Returns the variance of `lag` afterwards, and the log of the mean factor of the weights; the greatest log-weight is 0 again.
    """
    x, y, turn, scale, log_weight = particles
    z, lag = heights
    variance = lag_variance + change.height_sd_m**2
    gain = lag_variance / variance if math.isfinite(variance) else 0.0
    knows_lag = math.isfinite(variance) and lag_variance < UNKNOWN_LAG_M2
    top, before, after = -np.inf, 0.0, 0.0
    for i in range(len(x)):
        before += math.exp(log_weight[i])
        level = level_on_sheet(x[i], sheet)
        inside = connector_at(x[i] - level * sheet.pitch_m, y[i], level, sheet)
        connector, height, cost = inside, change.height_m, 0.0
        if inside < 0:
            dx = scale[i] * (math.cos(turn[i]) * move.dx_m - math.sin(turn[i]) * move.dy_m)
            dy = scale[i] * (math.sin(turn[i]) * move.dx_m + math.cos(turn[i]) * move.dy_m)
            connector = _connector_left(x[i], y[i], dx, dy, level, sheet)
        if connector >= 0:
            rise = change.felt_m + change.felt_sd_m * noise[i]
            z[i], beyond, height = climb(z[i], lag[i], rise, connector, knows_lag, change, model, sheet)
            cost += rise_cost(beyond, change, model)
            new_level = nearest_level(z[i], connector, sheet)
            x[i] += (new_level - level) * sheet.pitch_m
            level = new_level
        else:
            cost += rise_cost(change.felt_m, change, model)
        if inside < 0:
            cost += min(0.5 * ((z[i] - sheet.height_m[level]) / model.landing_sd_m) ** 2, model.unlikely)
            z[i] = sheet.height_m[level]
        innovation = height - z[i] - lag[i]
        cost += pressure_cost(innovation, variance, model)
        if innovation * innovation < THREE_SD2 * variance:
            lag[i] += gain * innovation
        log_weight[i] -= cost
        top = max(top, log_weight[i])
    for i in range(len(x)):
        log_weight[i] -= top
        after += math.exp(log_weight[i])
    return (1.0 - gain) * lag_variance, top + math.log(after / before)


@part
def _connector_left(x: float, y: float, dx: float, dy: float, level: int, sheet: LevelSheet) -> int:
    """The connector that held the middle of a move (dx, dy) to (x, y) on the sheet, else the one that held its start; -1: none."""
    shift = level * sheet.pitch_m
    connector = connector_at(x - 0.5 * dx - shift, y - 0.5 * dy, level, sheet)
    return connector if connector >= 0 else connector_at(x - dx - shift, y - dy, level, sheet)


@kernel
def set_levels_by_pressure(x: Floats, heights: HeightArrays, height_m: float, sheet: LevelSheet) -> None:
    """Put each particle on the level nearest to the height by pressure, after an unobserved move."""
    z, lag = heights
    for i in range(len(x)):
        level = level_on_sheet(x[i], sheet)
        new_level = int(np.argmin(np.abs(sheet.height_m - (height_m - lag[i]))))
        x[i] += (new_level - level) * sheet.pitch_m
        z[i] = sheet.height_m[new_level]


class UpperLevels:
    """The floor of a building, and which of its levels are above the ground."""

    def __init__(self, floor: Floor, sheet: LevelSheet) -> None:
        self._sheet = sheet
        self._grid = inside_grid(floor.x_m, floor.y_m)
        above = sheet.height_m > max(0.0, float(sheet.height_m.min())) + HALF_STOREY_M
        # A storey whose drawing is refused has no floor: there, nothing is known to be air
        self._is_above = above & (np.bincount(level_of(floor.x_m, sheet), minlength=len(above)) > 0)

    def log_loss(self, x_m: Floats, y_m: Floats, path_m: float) -> Floats | None:
        """Loss of log-weight (n,) of places on the sheet on this length of path; None if no place is in the air."""
        is_above = self._is_above[level_of(x_m, self._sheet)]
        if not is_above.any():
            return None
        in_air = is_above & ~self._grid.holds(x_m, y_m)
        return np.where(in_air, -FALL_PER_M * path_m, 0.0) if in_air.any() else None
