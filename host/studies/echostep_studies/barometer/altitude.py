# SPDX-License-Identifier: MIT
"""Heights from pressure, sample by sample; effects of weather, doors and fans are separated from vertical motion.

In: pressures with times, and what is known of temperature, gait, foot and plan. Out: `Heights`: height above the start with its variance,
vertical speed, probability of going up or down. Owns the pressure of the last sample (`AirColumn`) and the state of `vertical_filter`.

Pressure to height is hypsometric, dh = -(R T / g) dp / p, summed from sample to sample, so that a change of temperature alone moves no
height. T is the air's: a device is never long colder than the air about it, but often warmer (body, electronics), so what it reads above 20 degC
counts half. Without a reading 20 degC are taken: an error of 3 K makes 1 % of the rise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Bools, Floats
from echostep.jit import kernel
from echostep_studies.barometer import vertical_model as vertical
from echostep_studies.barometer.vertical_filter import Hypotheses

Codes = NDArray[np.int8]

# State of `AirColumn`: last sample's time and pressure, claimed height, temperature, number of samples.
LAST_T, LAST_PA, HEIGHT_M, AIR_C, COUNT = range(5)

AIR_J_KG_K, G0_M_S2, ZERO_C_K = 287.053, 9.80665, 273.15
INDOORS_C, COLDEST_C, WARMEST_C = 20.0, -30.0, 45.0
SCALE_SD = 0.015  # of a rise, by the air's temperature
RESOLUTION_M = 0.1
HIGH_SPEED_PA = 3.0  # noise of the SCP1000's high-speed mode [SCP1000 data sheet]
QUIETEST_PA = 0.2
LOWEST_PA, HIGHEST_PA = 20_000.0, 120_000.0
# A barometer's first readings may be its reset value, or of a filter that still settles: within so many samples a step that no lift makes is no rise
SETTLING = 9  # samples: about a second of the SCP1000; assumed
FASTEST_PA_S = 120.0  # an express lift, 10 m/s; assumed
STEP_PA = 18.0  # that noise makes: six standard deviations of the high-speed mode


@dataclass(frozen=True, slots=True)
class BarometerSettings:
    """`noise_pa`: sd of one sample; `air_c`: the air's temperature when known, believed more than the device's."""

    noise_pa: float = HIGH_SPEED_PA
    air_c: float | None = None


@dataclass(frozen=True, slots=True)
class Pressures:
    """Samples of a barometer (n,), times ascending, and what is known beside them; None: unknown throughout.

    `gait`: `vertical.UNKNOWN`, `WALKING`, `STILL`. `place`: 0, `vertical.CONNECTOR` (stairs, lift, ramp), `vertical.OUTSIDE` of any.
    `foot_m_s`, `foot_sd_m_s`: the foot's vertical speed since the sample before, and the sd of its mean over a second; NaN: unknown.
    """

    t_s: Floats
    pressure_pa: Floats
    temperature_c: Floats | None = None
    gait: Codes | None = None
    place: Codes | None = None
    foot_m_s: Floats | None = None
    foot_sd_m_s: Floats | None = None


@dataclass(frozen=True, slots=True)
class Heights:
    """`height_m` above the first sample with `variance_m2`, `speed_m_s` upwards, `moving`: probability of being on stairs or in a lift; (n,) each."""

    t_s: Floats
    height_m: Floats
    variance_m2: Floats
    speed_m_s: Floats
    moving: Floats

    def change(self, i: int, j: int) -> tuple[float, float]:
        """Rise (m) from sample i to a later j, and its variance: errors before i are common to both and cancel."""
        rise = float(self.height_m[j] - self.height_m[i])
        own = abs(float(self.variance_m2[j] - self.variance_m2[i]))
        return rise, own + RESOLUTION_M**2 + (SCALE_SD * rise) ** 2


class AirColumn:
    """The column of air between the samples: turns pressures into claimed heights, and samples into rows for the kernel."""

    def __init__(self, settings: BarometerSettings, lowest_m: float = -math.inf, highest_m: float = math.inf) -> None:
        self._settings = settings
        self._range = lowest_m, highest_m
        self._state = np.array([math.nan, math.nan, 0.0, math.nan, 0.0])

    def rows(self, samples: Pressures) -> tuple[Floats, Bools]:
        """Rows (m, 9) for the kernel, and which of the n samples they are: those that are numbers, possible and later than the one before."""
        n = len(samples.t_s)
        temperature = np.full(n, np.nan) if samples.temperature_c is None else samples.temperature_c
        if self._settings.air_c is not None:
            temperature = np.full(n, self._settings.air_c)
        seen = np.full((n, 9), np.nan)
        used = np.zeros(n, np.bool_)
        _claim(samples.t_s, samples.pressure_pa, temperature, self._settings.air_c is not None, self._state, seen, used)
        for column, values in ((vertical.GAIT, samples.gait), (vertical.PLACE, samples.place)):
            seen[:, column] = 0 if values is None else values
        if samples.foot_m_s is not None and samples.foot_sd_m_s is not None:
            seen[:, vertical.FOOT], seen[:, vertical.FOOT_SD] = samples.foot_m_s, samples.foot_sd_m_s
        seen[:, vertical.NOISE] *= self._settings.noise_pa
        seen[:, vertical.LOWEST], seen[:, vertical.HIGHEST] = self._range
        return seen[used], used


class Altitude:
    """Heights of one barometer, of any storeys; `feed` in any portions gives the same heights."""

    def __init__(self, settings: BarometerSettings | None = None) -> None:
        self._column = AirColumn(settings or BarometerSettings())
        self._hypotheses = Hypotheses(np.zeros(1), np.ones(1), free=True)

    def feed(self, samples: Pressures) -> Heights:
        """Heights at the samples that could be used; what is no pressure, or not later than the sample before, is left out."""
        seen, used = self._column.rows(samples)
        states = self._hypotheses.filter(seen)
        return _heights(samples.t_s[used], states, states[:, :, vertical.RESULT_WEIGHT])

    def smooth(self, samples: Pressures) -> Heights:
        """Heights at the samples of a whole record: motion is judged by all samples; the last call on an `Altitude`."""
        seen, used = self._column.rows(samples)
        return _heights(samples.t_s[used], *self._hypotheses.smooth(seen))


def noise_of(pressure_pa: Floats) -> float:
    """Noise (Pa, 1 sd) of a record by the median of what each sample is off its neighbours' mean; walking up hardly bends a line."""
    if len(pressure_pa) < 5:
        return HIGH_SPEED_PA
    off = pressure_pa[1:-1] - 0.5 * (pressure_pa[:-2] + pressure_pa[2:])
    return max(QUIETEST_PA, 1.4826 * float(np.median(np.abs(off))) / math.sqrt(1.5))


def _heights(t_s: Floats, states: Floats, w: Floats) -> Heights:
    """Mean and variance over the hypotheses."""
    h, v = states[:, :, vertical.RESULT_HEIGHT], states[:, :, vertical.RESULT_RATE]
    mean = (w * h).sum(axis=1)
    variance = (w * (states[:, :, vertical.RESULT_VARIANCE] + (h - mean[:, None]) ** 2)).sum(axis=1)
    moving = w * (np.arange(vertical.MODES) % vertical.WAYS != vertical.ON)
    speed = (moving * v).sum(axis=1)
    return Heights(t_s, mean, variance, speed, moving.sum(axis=1))


@kernel
def _claim(
    t_s: Floats,
    pressure_pa: Floats,
    temperature_c: Floats,
    known: bool,
    state: Floats,
    seen: Floats,
    used: Bools,
) -> None:
    """Time since the last good sample, the height that pressure claims, and metres for a pascal, into `seen`."""
    for i in range(len(t_s)):
        if not (
            LOWEST_PA <= pressure_pa[i] <= HIGHEST_PA and (t_s[i] > state[LAST_T] or state[LAST_T] != state[LAST_T])
        ):
            continue
        if not math.isfinite(t_s[i]):
            continue
        if COLDEST_C <= temperature_c[i] <= WARMEST_C:
            warm = temperature_c[i] - INDOORS_C
            state[AIR_C] = INDOORS_C + (warm if known or warm < 0.0 else 0.5 * warm)
        elif state[AIR_C] != state[AIR_C]:
            state[AIR_C] = INDOORS_C
        metres = AIR_J_KG_K * (state[AIR_C] + ZERO_C_K) / G0_M_S2
        first = state[LAST_T] != state[LAST_T]
        settles = not first and state[COUNT] < SETTLING
        step_pa = abs(pressure_pa[i] - state[LAST_PA])
        if not first and not (settles and step_pa > STEP_PA + FASTEST_PA_S * (t_s[i] - state[LAST_T])):
            state[HEIGHT_M] -= metres * math.log(pressure_pa[i] / state[LAST_PA])
        seen[i, vertical.DT] = 0.05 if first else t_s[i] - state[LAST_T]
        seen[i, vertical.CLAIMED] = state[HEIGHT_M]
        seen[i, vertical.NOISE] = metres / pressure_pa[i]
        state[LAST_T], state[LAST_PA] = t_s[i], pressure_pa[i]
        state[COUNT] += 1.0
        used[i] = True
