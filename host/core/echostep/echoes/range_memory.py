# SPDX-License-Identifier: MIT
"""What the last echoes of a ranger tell of its next one, without a plan: the wall that answered goes on, and silence does.

In: `PlacedPings` in order of time. Out: for each the probabilities and densities STRAY to LOG_BLURRED. Owns nothing: what is remembered of each
ranger is a row of `new_memory`.

A smooth wall answers from the foot of the perpendicular, whatever the ranger's axis: so its distance shrinks by the way along its normal. An extended
Kalman filter of distance and direction of the normal. An edge or a corner answers as a wall whose normal turns, which TURN_SD_RAD allows.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.echoes.likelihood import STRAY_ON, EchoModel, detection, normal
from echostep.elementary import wrap_angle
from echostep.jit import kernel, lean_part
from echostep.walls.index import CONE_RAD
from echostep.walls.tile_points import WALL

# Assumed, not measured.
# Of a new wall's normal about the ranger's axis: half of the angle at which walls answer
AXIS_SD_RAD = math.radians(20.0)
TURN_SD_RAD = 0.05  # change of the normal on a metre of path
VIEW_M = 2.5  # mean length of the path between two changes of a view: walls, doors, corners
VIEW_RAD = 2.0 * CONE_RAD  # mean turn of a ranger between two changes of its view: the width of its cone
# Pings: a ranger in order misses one echo in two hundred; a faulty one is known after two seconds
PRIOR_MISSED, PRIOR_HEARD = 0.1, 20.0
LIKE_M = 0.15  # difference of two echoes from one wall: three errors of their difference
SURE_M = 3.0  # range within which a wall is detected surely: half of the ranger's
MOST_SILENT = 8  # pings between two such echoes: more mean a door
REMEMBERED = 200.0  # pings: tens of metres of path
# Of a ranger: place and axis of its last ping in the walk frame; distance and normal of the wall that answered it as seen from there, NaN for none,
# and their covariance; echoes missed and heard, the last echo, silent pings since
X, Y, AXIS, DISTANCE, NORMAL, DISTANCE_VAR, COVARIANCE, NORMAL_VAR, MISSED, HEARD, LAST, SILENT = range(12)
# Of a ping: probability of a second reflection where nothing answers; odds that a silent one missed its echo, 0 for an echo; its density if like the
# ping before, without these two; its density to its power, anywhere or like the ping before; the log of it, and of it blurred
STRAY, ODDS, ALIKE, DENSITY, LOG, LOG_BLURRED = range(6)


class PlacedPings(NamedTuple):
    """Pings (k,): `ranger`; place and axis in the walk frame; `range_m`, 0: no echo; `power`."""

    ranger: Ints
    x_m: Floats
    y_m: Floats
    axis_rad: Floats
    range_m: Floats
    power: Floats


def new_memory() -> Floats:
    """Of both rangers (2, SILENT + 1), before their first ping."""
    memory = np.full((2, SILENT + 1), np.nan)
    memory[:, [MISSED, HEARD, SILENT]] = PRIOR_MISSED, PRIOR_HEARD, 0.0
    return memory


@kernel
def remembered_densities(
    memory: Floats, pings: PlacedPings, log_anywhere: Floats, blur_m: float, m: EchoModel
) -> Floats:
    """Rows STRAY to LOG_BLURRED of pings (k,), whose densities anywhere in the building have these logs; blurred by a standard deviation.

    Changes the memory.
    """
    of = np.empty((LOG_BLURRED + 1, len(log_anywhere)))
    for k in range(len(log_anywhere)):
        ranger, range_m, axis_rad, power = memory[pings.ranger[k]], pings.range_m[k], pings.axis_rad[k], pings.power[k]
        anywhere = math.exp(log_anywhere[k])
        stray = m.stray * (STRAY_ON if math.isnan(ranger[DISTANCE]) else 1.0)
        missed = ranger[MISSED] / ranger[HEARD] if range_m <= 0.0 else 0.0
        _count(ranger, range_m)
        changed = 1.0 - (1.0 - m.outlier) * _go_on(ranger, pings.x_m[k], pings.y_m[k], axis_rad)
        alike, blurred = _densities_alike(ranger, range_m, axis_rad, stray, blur_m, m)
        _update(ranger, range_m, axis_rad, power, (1.0 - changed) * (alike + missed) > changed * anywhere, m)
        new = changed * (anywhere + missed) ** power
        of[STRAY, k], of[ODDS, k], of[ALIKE, k] = stray, missed, alike
        of[DENSITY, k] = new + (1.0 - changed) * (alike + missed) ** power
        of[LOG, k] = math.log(of[DENSITY, k])
        of[LOG_BLURRED, k] = math.log(new + (1.0 - changed) * (blurred + missed) ** power)
    return of


@lean_part
def _count(ranger: Floats, range_m: float) -> None:
    """Count a ping as heard or silent, and silent ones between two like echoes as missed."""
    if range_m <= 0.0:
        ranger[SILENT] += 1.0
        return
    if range_m < SURE_M and abs(range_m - ranger[LAST]) < LIKE_M and ranger[SILENT] <= MOST_SILENT:
        missed, heard = ranger[MISSED] + ranger[SILENT], ranger[HEARD] + 1.0
        kept = min(1.0, REMEMBERED / (missed + heard))
        ranger[MISSED], ranger[HEARD] = kept * missed, kept * heard
    ranger[LAST], ranger[SILENT] = range_m, 0.0


@lean_part
def _go_on(ranger: Floats, x_m: float, y_m: float, axis_rad: float) -> float:
    """Advance to the place and axis of the next ping; returns the probability that the view is the same there, 0 for the first one."""
    dx_m, dy_m, turn_rad = x_m - ranger[X], y_m - ranger[Y], abs(wrap_angle(axis_rad - ranger[AXIS]))
    ranger[X], ranger[Y], ranger[AXIS] = x_m, y_m, axis_rad
    if math.isnan(dx_m):
        return 0.0
    c, s = math.cos(ranger[NORMAL]), math.sin(ranger[NORMAL])
    across = s * dx_m - c * dy_m  # change of the distance with the normal
    ranger[DISTANCE] -= c * dx_m + s * dy_m
    ranger[DISTANCE_VAR] += across * (2.0 * ranger[COVARIANCE] + across * ranger[NORMAL_VAR])
    ranger[COVARIANCE] += across * ranger[NORMAL_VAR]
    ranger[NORMAL_VAR] += TURN_SD_RAD**2 * math.hypot(dx_m, dy_m)
    return math.exp(-math.hypot(dx_m, dy_m) / VIEW_M - turn_rad / VIEW_RAD)


@lean_part
def _densities_alike(
    ranger: Floats, range_m: float, axis_rad: float, stray: float, blur_m: float, m: EchoModel
) -> tuple[float, float]:
    """Density (1/m) of a range if the view goes on, and blurred; range 0: the probability of no echo. The wall is detected as one of a plan is."""
    if math.isnan(ranger[DISTANCE]):
        density = 1.0 - stray if range_m <= 0.0 else stray / (m.maximum_m - m.minimum_m)
        return density, density
    if range_m <= 0.0:
        return 0.0, 0.0
    slant_rad, off_m = abs(wrap_angle(ranger[NORMAL] - axis_rad)), range_m - ranger[DISTANCE]
    detected = detection(ranger[DISTANCE], slant_rad, WALL, m)
    variance_m2 = ranger[DISTANCE_VAR] + (m.sd_m + m.slant_m * slant_rad) ** 2
    blurred = normal(off_m, math.sqrt(variance_m2 + blur_m**2))
    return detected * normal(off_m, math.sqrt(variance_m2)), detected * blurred


@lean_part
def _update(ranger: Floats, range_m: float, axis_rad: float, power: float, goes_on: bool, m: EchoModel) -> None:
    """Correct the wall by an echo, whose error counts by `power`, for errors of successive echoes are alike; begin with it, or with silence."""
    if range_m <= 0.0:
        if not goes_on:  # otherwise it is likelier that an echo was missed
            ranger[DISTANCE] = math.nan
    elif goes_on and not math.isnan(ranger[DISTANCE]):
        error_m = m.sd_m + m.slant_m * abs(wrap_angle(ranger[NORMAL] - axis_rad))
        total, difference = ranger[DISTANCE_VAR] + error_m**2 / power, range_m - ranger[DISTANCE]
        gain_m, gain_rad = ranger[DISTANCE_VAR] / total, ranger[COVARIANCE] / total
        ranger[DISTANCE] += gain_m * difference
        ranger[NORMAL] += gain_rad * difference
        ranger[NORMAL_VAR] -= gain_rad * ranger[COVARIANCE]
        ranger[COVARIANCE] -= gain_m * ranger[COVARIANCE]
        ranger[DISTANCE_VAR] -= gain_m * ranger[DISTANCE_VAR]
    else:
        ranger[DISTANCE], ranger[NORMAL] = range_m, axis_rad
        ranger[DISTANCE_VAR], ranger[COVARIANCE], ranger[NORMAL_VAR] = m.sd_m**2, 0.0, AXIS_SD_RAD**2
