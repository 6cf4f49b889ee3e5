# SPDX-License-Identifier: MIT
"""The air of a building, as a carried barometer measures it.

In: times, true heights of the wearer, when in a stairwell or lift shaft, a seeded generator. Out: true pressures and the temperature that a
worn device reads. Owns the constants of the air. Nothing here depends on how heights are estimated from it.

The column of air is hydrostatic at the building's own temperature [ISO 2533 with another temperature]. On top of it: weather (a trend and a random
walk), doors (pulses of 5 to 50 Pa: the air swings and settles), a fan that goes on and off, shafts whose pressure differs from the floors' by the
stack effect [ASHRAE Fundamentals 2017, 16.4: 0.04 Pa per metre and kelvin], and the piston of a lift.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Bools, Floats

SEA_LEVEL_PA = 101_325.0
G0_M_S2, DRY_AIR_J_KG_K, ZERO_C_K = 9.80665, 287.053, 273.15
STACK_PA_M_K = 0.04
LEAKY = 0.3  # share of the stack effect that falls on the shaft's doors
PISTON_PA = 1.0  # in a lift at 1 m/s, growing with its square; assumed: the car is open to the air before and behind it
BODY_HEAT_C, WARMING_S = 6.0, 400.0


@dataclass(frozen=True, slots=True)
class Weather:
    """`trend_pa_h`: of the weather; `wander_pa`: its random walk in a second; `doors_s`, `fan_s`: mean time between pulses, and between the fan's
    switchings, inf: never.

    `air_c`: in the building; `colder_k`: outside by so much, which drives the stack effect.
    """

    trend_pa_h: float = 100.0
    wander_pa: float = 0.15
    doors_s: float = 90.0
    door_pa: tuple[float, float] = (5.0, 50.0)
    fan_s: float = 240.0
    fan_pa: float = 10.0
    air_c: float = 21.0
    colder_k: float = 15.0


def pressures(t_s: Floats, height_m: Floats, in_shaft: Bools, weather: Weather, rng: np.random.Generator) -> Floats:
    """True pressures (n,) in Pa at times and heights (n,) above the entrance, the neutral plane in the middle of the heights."""
    column = G0_M_S2 / (DRY_AIR_J_KG_K * (weather.air_c + ZERO_C_K))
    steps = np.diff(t_s, prepend=t_s[0])
    wander = np.cumsum(weather.wander_pa * np.sqrt(steps) * rng.standard_normal(len(t_s)))
    trend = weather.trend_pa_h / 3600.0 * (t_s - t_s[0])
    ground = (
        SEA_LEVEL_PA
        + 800.0 * rng.standard_normal()
        + trend
        + wander
        + _doors(t_s, weather, rng)
        + _fan(t_s, weather, rng)
    )
    neutral = 0.5 * (float(height_m.min()) + float(height_m.max()))
    stack = LEAKY * STACK_PA_M_K * weather.colder_k * (height_m - neutral) * _soft(t_s, in_shaft)
    speed = np.gradient(height_m, t_s) if len(t_s) > 1 else np.zeros(1)
    piston = PISTON_PA * np.where(np.abs(speed) > 0.6, speed * np.abs(speed), 0.0)
    pressure_pa: Floats = ground * np.exp(-column * height_m) + stack + piston
    return pressure_pa


def device_temperatures(t_s: Floats, air_c: float, rng: np.random.Generator) -> Floats:
    """What a worn device reads (n,), degC: it starts near the air's temperature and is warmed by the body."""
    heat = BODY_HEAT_C * rng.uniform(0.3, 1.0)
    return np.asarray(air_c + heat * (1.0 - np.exp(-(t_s - t_s[0]) / WARMING_S)))


def _doors(t_s: Floats, weather: Weather, rng: np.random.Generator) -> Floats:
    """Pulses: a push of some tenths of a second to some seconds, then the air settles, at times swinging back."""
    pulses_pa = np.zeros_like(t_s)
    at = float(t_s[0])
    while math.isfinite(weather.doors_s):
        at += rng.exponential(weather.doors_s)
        if at > t_s[-1]:
            break
        size = rng.choice((-1.0, 1.0)) * math.exp(rng.uniform(*np.log(weather.door_pa)))
        rise, held, fall = rng.uniform(0.05, 0.4), rng.choice((0.0, rng.uniform(0.5, 4.0))), rng.uniform(0.2, 1.5)
        near = slice(*np.searchsorted(t_s, (at, at + rise + held + 8.0 * fall)))
        since = t_s[near] - at
        after = np.maximum(since - rise - held, 0.0)
        swing = np.cos(2.0 * np.pi * after / 3.0) if rng.random() < 0.3 else 1.0
        pulses_pa[near] += size * np.minimum(since / rise, 1.0) * np.exp(-after / fall) * swing
    return pulses_pa


def _fan(t_s: Floats, weather: Weather, rng: np.random.Generator) -> Floats:
    """A fan that presses the building on and off, with a time constant of some seconds."""
    pressure_pa = np.zeros_like(t_s)
    at, on, sign = float(t_s[0]), False, rng.choice((-1.0, 1.0))
    while math.isfinite(weather.fan_s):
        at += rng.exponential(weather.fan_s)
        if at > t_s[-1]:
            break
        on = not on
        after = np.maximum(t_s - at, 0.0)
        pressure_pa += (1.0 if on else -1.0) * sign * weather.fan_pa * (1.0 - np.exp(-after / rng.uniform(1.0, 6.0)))
    return pressure_pa


def _soft(t_s: Floats, in_shaft: Bools) -> Floats:
    """1 in a shaft, 0 on a floor; the way through the door takes a second."""
    if len(t_s) < 3:
        return in_shaft.astype(float)
    wide = max(1, round(1.0 / float(np.median(np.diff(t_s)))))
    return np.asarray(np.convolve(in_shaft, np.full(wide, 1.0 / wide), mode="same"))
