# SPDX-License-Identifier: MIT
"""Heights from a record of pressures; effects of weather, doors and fans are separated from vertical motion.

In: pressures with times, and temperatures where they are known. Out: rows of observations, and `Heights` above the start of any
building. Owns nothing.

Pressure to height is hypsometric, dh = -(R T / g) dp / p, summed from sample to sample, so that a change of temperature alone moves no
height. T is the air's: a device is never long colder than the air about it, but often warmer (body, electronics), so what it reads above 20 degC
counts half. Without a reading 20 degC are taken: an error of 3 K makes 1 % of the rise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep_studies.barometer import vertical_model as vertical
from echostep_studies.barometer.vertical_kernels import smooth

AIR_J_KG_K, G0_M_S2, ZERO_C_K = 287.053, 9.80665, 273.15
INDOORS_C, COLDEST_C, WARMEST_C = 20.0, -30.0, 45.0
HIGH_SPEED_PA = 3.0  # noise of the SCP1000's high-speed mode [SCP1000 data sheet]
QUIETEST_PA = 0.2
LOWEST_PA, HIGHEST_PA = 20_000.0, 120_000.0
FIRST_S = 0.05  # before the first sample
# A barometer's first readings may be its reset value, or of a filter that still settles: within SETTLING samples a step that no lift makes is no rise
SETTLING = 9  # samples: about a second of the SCP1000; assumed
FASTEST_PA_S = 120.0  # an express lift, 10 m/s; assumed
STEP_PA = 18.0  # that noise makes: six standard deviations of the high-speed mode


@dataclass(frozen=True, slots=True)
class Pressures:
    """Samples of a barometer (n,): possible pressures (Pa), times (s) ascending, temperatures (degC, NaN: unknown) or None."""

    t_s: Floats
    pressure_pa: Floats
    temperature_c: Floats | None = None


@dataclass(frozen=True, slots=True)
class Heights:
    """`height_m` above the first sample, `moving`: probability of being on stairs or in a lift; (n,) each."""

    t_s: Floats
    height_m: Floats
    moving: Floats


def observations(
    samples: Pressures, noise_pa: float, lowest_m: float = -math.inf, highest_m: float = math.inf
) -> Floats:
    """Rows (n, 5) for the filter: time since the sample before, claimed height, its noise, the lowest and the highest level.

    `noise_pa`: standard deviation of one sample.
    """
    t_s, pressure_pa = samples.t_s, samples.pressure_pa
    metres = AIR_J_KG_K * (_air_c(samples) + ZERO_C_K) / G0_M_S2
    step_s, step_pa = np.diff(t_s), np.abs(np.diff(pressure_pa))
    rise = -metres[1:] * np.log(pressure_pa[1:] / pressure_pa[:-1])
    settles = np.arange(1, len(t_s)) < SETTLING
    rise[settles & (step_pa > STEP_PA + FASTEST_PA_S * step_s)] = 0.0
    seen = np.empty((len(t_s), 5))
    seen[:, vertical.DT] = FIRST_S, *step_s
    seen[:, vertical.CLAIMED] = 0.0, *np.cumsum(rise)
    seen[:, vertical.NOISE] = noise_pa * metres / pressure_pa
    seen[:, vertical.LOWEST], seen[:, vertical.HIGHEST] = lowest_m, highest_m
    return seen


def _air_c(samples: Pressures) -> Floats:
    """The air's temperature (n,): by the last possible reading, INDOORS_C before the first."""
    if samples.temperature_c is None:
        return np.full(len(samples.t_s), INDOORS_C)
    possible = (samples.temperature_c >= COLDEST_C) & (samples.temperature_c <= WARMEST_C)
    last = np.maximum.accumulate(np.where(possible, np.arange(len(possible)), -1))
    warm = samples.temperature_c[last] - INDOORS_C
    return np.where(last < 0, INDOORS_C, INDOORS_C + np.where(warm < 0.0, warm, 0.5 * warm))


def heights_above_start(samples: Pressures, noise_pa: float) -> Heights:
    """Heights at all samples of a record, in a building of any storeys; motion is judged by the whole record."""
    states, w = smooth(observations(samples, noise_pa), np.zeros(1), np.ones(1), free=True)
    moving = w * (np.arange(vertical.MODES) % vertical.WAYS != vertical.ON)
    return Heights(samples.t_s, (w * states[:, :, vertical.RESULT_HEIGHT]).sum(axis=1), moving.sum(axis=1))


def noise_of(pressure_pa: Floats) -> float:
    """Noise (Pa, 1 sd) of a record by the median of what each sample is off its neighbours' mean; walking up hardly bends a line."""
    if len(pressure_pa) < 5:
        return HIGH_SPEED_PA
    off = pressure_pa[1:-1] - 0.5 * (pressure_pa[:-2] + pressure_pa[2:])
    return max(QUIETEST_PA, 1.4826 * float(np.median(np.abs(off))) / math.sqrt(1.5))
