"""Up and down: how high each particle is, and what the foot and the barometer say of it.

In: a particle's way over a leg, the rise that the foot felt, the height that the air pressure gives. Out: heights, log-weights, and the level that
each particle is on now (its x on the sheet). Owns nothing.

On a level a particle is as high as its floor, and a foot that rises there is unlikely. Only in a connector its height changes: on stairs and ramps by
what the foot felt, in a lift by the pressure, which is also all there is on stairs when no foot tells. Who leaves a connector must be as high as the
floor that he steps on. Weather moves the pressure's height slowly, so each particle knows by how much it is off: `lag`, a Kalman filter of one state
whose variance is the same for all [Schoen et al. 2005, the linear part of a marginalised particle filter].
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.jit import kernel
from echostep.walls.level_sheet import LIFT, LevelSheet, connector_at, nearest_level


@dataclass(frozen=True, slots=True)
class ClimbSettings:
    """`flat_sd_m`: how far the foot's height is off after a stride on the flat, thresholds and all; `landing_sd_m`: how far a stairwell's floor
    may be from where particles think that they are; `drift_m`: wandering of the pressure's height in a second, weather, doors, fans; it counts
    with `unlikely` at most in log-weight, each of them.
    """

    flat_sd_m: float = 0.06
    landing_sd_m: float = 0.35
    drift_m: float = 0.02
    unlikely: float = 8.0


class HeightChange(NamedTuple):
    """What is known of height over a leg: `felt_m` by the foot with its standard deviation (infinite: no foot), `height_m` by the pressure at its
    end with its standard deviation (infinite: no pressure), and how long it took.
    """

    felt_m: float
    felt_sd_m: float
    height_m: float
    height_sd_m: float
    span_s: float


class LevelChangeModel(NamedTuple):
    """`ClimbSettings` as the kernel takes them."""

    flat_sd_m: float
    landing_sd_m: float
    unlikely: float


def climb_model(s: ClimbSettings) -> LevelChangeModel:
    """The settings in the kernel's form."""
    return LevelChangeModel(s.flat_sd_m, s.landing_sd_m, s.unlikely)


@kernel
def climb(
    x: Floats, y: Floats, turn: Floats, scale: Floats, z: Floats, lag: Floats, log_weight: Floats,
    dx: float, dy: float, noise: Floats, rise: HeightChange, lag_variance: float, m: LevelChangeModel, s: LevelSheet,
) -> float:  # fmt: skip
    """Heights, levels and weights after a move (dx, dy) in the walk frame that led to (x, y) on the sheet; `noise` (n,) standard normal.

    Returns the variance of `lag` afterwards; the greatest log-weight is 0 again.
    """
    has_foot, has_air = math.isfinite(rise.felt_sd_m), math.isfinite(rise.height_sd_m)
    spread = lag_variance + rise.height_sd_m**2 if has_air else np.inf
    gain = lag_variance / spread if has_air else 0.0
    flat_sd, last, top = math.hypot(m.flat_sd_m, rise.felt_sd_m), len(s.height_m) - 1, -np.inf
    for i in range(len(x)):
        level = min(max(math.floor((x[i] - s.x0_m) / s.pitch_m), 0), last)
        shift = level * s.pitch_m
        way = connector_at(x[i] - shift, y[i], level, s)
        passing = way
        if way < 0:
            to_x = scale[i] * (math.cos(turn[i]) * dx - math.sin(turn[i]) * dy)
            to_y = scale[i] * (math.sin(turn[i]) * dx + math.cos(turn[i]) * dy)
            passing = connector_at(x[i] - 0.5 * to_x - shift, y[i] - 0.5 * to_y, level, s)
            if passing < 0:
                passing = connector_at(x[i] - to_x - shift, y[i] - to_y, level, s)
        if passing >= 0:
            if s.kind[passing] != LIFT and has_foot:
                z[i] += rise.felt_m + rise.felt_sd_m * noise[i]
            elif has_air:
                z[i] = rise.height_m - lag[i]
            now = nearest_level(z[i], passing, s)
            x[i] += (now - level) * s.pitch_m
            level = now
        elif has_foot:
            log_weight[i] -= min(0.5 * (rise.felt_m / flat_sd) ** 2, m.unlikely)
        if way < 0:
            log_weight[i] -= min(0.5 * ((z[i] - s.height_m[level]) / m.landing_sd_m) ** 2, m.unlikely)
            z[i] = s.height_m[level]
        if has_air:
            off = rise.height_m - z[i] - lag[i]
            log_weight[i] -= min(2.0 * math.log1p(off * off / (3.0 * spread)), m.unlikely)
            if off * off < 9.0 * spread:
                lag[i] += gain * off
        top = max(top, log_weight[i])
    for i in range(len(x)):
        log_weight[i] -= top
    return (1.0 - gain) * lag_variance


@kernel
def carry(x: Floats, z: Floats, lag: Floats, height_m: float, s: LevelSheet) -> None:
    """Put each particle on the level that the pressure gives, after a time that nobody watched."""
    last = len(s.height_m) - 1
    for i in range(len(x)):
        level = min(max(math.floor((x[i] - s.x0_m) / s.pitch_m), 0), last)
        now = int(np.argmin(np.abs(s.height_m - (height_m - lag[i]))))
        x[i] += (now - level) * s.pitch_m
        z[i] = s.height_m[now]
