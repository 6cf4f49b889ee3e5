# SPDX-License-Identifier: MIT
"""The board's own sensors: gyros, barometer, compass.

In: true values, a seeded generator for each sensor. Out: counts as the device would give them. Owns each sensor's constant errors and drift.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import accumulate
from typing import Literal

import numpy as np

from echostep.arrays import Floats, Ints
from echostep_simulation.world.magnetic_field import EARTH, MagneticField

GYRO_RAD_S = math.radians(0.2439)  # per count [ADIS16100 data sheet]
GYRO_LIMIT = 1230  # counts: 300 deg/s
GYRO_NOISE_RAD_S = math.radians(0.5)  # rms in its 40 Hz
GYRO_BIAS_RAD_S = math.radians(1.0)
JITTER_SMOOTH_MS = 401  # the trunk's angle to the feet changes within a step

GROUND_PRESSURE_PA = 101_325.0  # at height 0
Mode = Literal["high-speed", "high-resolution"]
# 15 bit, 17 bit [SCP1000 data sheet]
PRESSURE_NOISE_PA: dict[Mode, float] = {"high-speed": 3.0, "high-resolution": 1.5}
PRESSURE_DRIFT_PA = 0.1  # random walk in a second: weather and doors
TEMPERATURE_NOISE_C = 0.1

COMPASS_NOISE_RAD = math.radians(0.5)
HARD_IRON = 0.02  # of the wearer's gear, in units of the earth's field


@dataclass(frozen=True, slots=True)
class WornGyro:
    """Errors of a yaw gyro at the belt beyond its data sheet's noise and bias, all as standard deviations.

    `scale`: sensitivity and tilt of its axis. `wander_rad_s`: of its bias within a run, correlated over `wander_s`. `walking_rad_s`: bias that
    walking adds, by the rotations about the other axes. `jitter_rad`: of the trunk against the feet, correlated over `jitter_s`.
    """

    # Two belts of real walks: 0.7 % between them, 2.3 % against motion capture [legs_qmt, legs_gaittoolbox]
    scale: float = 0.02
    wander_rad_s: float = math.radians(0.03)  # of a gyro of its class, 0.02 to 0.1
    wander_s: float = 100.0
    # Two belts on one pelvis differ by 0.08 deg/s in walking, by 0.01 at rest [legs_qmt]
    walking_rad_s: float = math.radians(0.06)
    jitter_rad: float = math.radians(1.0)  # 0.9 to 1.2 degrees from stride to stride [legs_qmt]
    jitter_s: float = 1.0

    def rates(self, rate_rad_s: Floats, rate_hz: float, rng: np.random.Generator) -> Floats:
        """Rates about its axis, from the trunk's rates (n,); walking where the trunk's rate has not been zero within half a second."""
        n = len(rate_rad_s)
        scale, walking = self.scale * rng.standard_normal(), self.walking_rad_s * rng.standard_normal()
        moving = np.convolve(rate_rad_s != 0.0, np.ones(int(rate_hz)), "same") > 0.5
        wander = _correlated(n, self.wander_rad_s, self.wander_s * rate_hz, rng)
        jitter = _correlated(n, self.jitter_rad, self.jitter_s * rate_hz, rng)
        shaken = np.convolve(np.where(moving, jitter, 0.0), np.ones(JITTER_SMOOTH_MS) / JITTER_SMOOTH_MS, "same")
        measured: Floats = (1.0 + scale) * rate_rad_s + walking * moving + wander + np.gradient(shaken) * rate_hz
        return measured


def _correlated(n: int, sd: float, over: float, rng: np.random.Generator) -> Floats:
    """A Gauss-Markov series (n,) of a standard deviation, correlated over `over` samples."""
    correlation = math.exp(-1.0 / over)
    drawn = sd * math.sqrt(1.0 - correlation * correlation) * rng.standard_normal(n)
    drawn[0] = sd * rng.standard_normal()
    return np.fromiter(accumulate(drawn.tolist(), lambda last, new: correlation * last + new), np.float64, n)


class Adis16100Model:
    """A rate gyro."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._bias_rad_s = GYRO_BIAS_RAD_S * rng.standard_normal()

    def counts(self, rate_rad_s: Floats) -> Ints:
        """Ints (n,) of rates (n,)."""
        noisy = rate_rad_s + self._bias_rad_s + GYRO_NOISE_RAD_S * self._rng.standard_normal(len(rate_rad_s))
        return np.clip(np.rint(noisy / GYRO_RAD_S), -GYRO_LIMIT, GYRO_LIMIT).astype(np.int64)


class Scp1000Model:
    """A barometer."""

    def __init__(self, rng: np.random.Generator, mode: Mode = "high-speed", noise_pa: float | None = None) -> None:
        """`noise_pa`: rms noise of another part."""
        self._rng = rng
        self._noise_pa = PRESSURE_NOISE_PA[mode] if noise_pa is None else noise_pa
        self._drift_pa = 0.0

    def counts(
        self, height_m: Floats | float, temperature_c: float, n: int, air_pa: Floats | None = None
    ) -> tuple[Ints, Ints]:
        """Pressure (0.25 Pa) and temperature (0.05 degC) of n milliseconds at one height or at n [ISO 2533, standard atmosphere].

        `air_pa` (n,): the true pressures, instead of heights and the barometer's own weather.
        """
        drawn = self._rng.standard_normal((n, 3))
        drift = self._drift_pa + PRESSURE_DRIFT_PA * math.sqrt(1e-3) * np.cumsum(drawn[:, 0])
        self._drift_pa = float(drift[-1])
        true = GROUND_PRESSURE_PA * (1.0 - 2.25577e-5 * height_m) ** 5.25588 + drift if air_pa is None else air_pa
        pressure = true + self._noise_pa * drawn[:, 1]
        temperature = temperature_c + TEMPERATURE_NOISE_C * drawn[:, 2]
        return np.rint(4.0 * pressure).astype(np.int64), np.rint(20.0 * temperature).astype(np.int64)


class CompassModel:
    """A magnetic compass on the trunk: the field of the place, the iron that the wearer carries, noise."""

    def __init__(self, magnetism: MagneticField | None, rng: np.random.Generator) -> None:
        self._rng = rng
        self._magnetism = magnetism
        self._iron = HARD_IRON * rng.standard_normal(2)

    def bearings(self, trunk_m: Floats, heading_rad: Floats) -> Ints:
        """Bearings (n,), clockwise from magnetic north in tenths of a degree, 0 to 3599."""
        n = len(heading_rad)
        field = self._magnetism.field(trunk_m) if self._magnetism else np.tile(EARTH, (n, 1))
        c, s = np.cos(heading_rad), np.sin(heading_rad)
        ahead = field[:, 0] * c + field[:, 1] * s + self._iron[0]
        left = field[:, 1] * c - field[:, 0] * s + self._iron[1]
        bearing = np.arctan2(left, ahead) + COMPASS_NOISE_RAD * self._rng.standard_normal(n)
        return np.rint(np.degrees(bearing) * 10.0).astype(np.int64) % 3600
