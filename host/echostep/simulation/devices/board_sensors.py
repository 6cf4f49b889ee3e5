# SPDX-License-Identifier: MIT
"""The board's own sensors: gyros, barometer, compass.

In: what is true, a seeded generator for each sensor. Out: counts as the device would give them. Owns each sensor's constant errors and drift.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.simulation.world.magnetic_field import EARTH, MagneticField

GYRO_RAD_S = math.radians(0.2439)  # per count [ADIS16100 data sheet]
GYRO_LIMIT = 1230  # counts: 300 deg/s
GYRO_NOISE_RAD_S = math.radians(0.5)  # rms in its 40 Hz
GYRO_BIAS_RAD_S = math.radians(1.0)

PRESSURE_PA = 101_325.0  # at height 0
Mode = Literal["high-speed", "high-resolution"]
PRESSURE_NOISE_PA: dict[Mode, float] = {
    "high-speed": 3.0,
    "high-resolution": 1.5,
}  # 15 bit, 17 bit [SCP1000 data sheet]
PRESSURE_DRIFT_PA = 0.1  # random walk in a second: weather and doors
TEMPERATURE_NOISE_C = 0.1

COMPASS_NOISE_RAD = math.radians(0.5)
HARD_IRON = 0.02  # of the wearer's gear, in units of the earth's field


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
        """`noise_pa`: of another part, rms."""
        self._rng = rng
        self._noise_pa = PRESSURE_NOISE_PA[mode] if noise_pa is None else noise_pa
        self._drift_pa = 0.0

    def counts(
        self, height_m: Floats | float, temperature_c: float, n: int, air_pa: Floats | None = None
    ) -> tuple[Ints, Ints]:
        """Pressure (0.25 Pa) and temperature (0.05 degC) of n milliseconds at one height or at n [ISO 2533, standard atmosphere].

        `air_pa` (n,): the true pressures, in the place of heights and the barometer's own weather.
        """
        drawn = self._rng.standard_normal((n, 3))
        drift = self._drift_pa + PRESSURE_DRIFT_PA * math.sqrt(1e-3) * np.cumsum(drawn[:, 0])
        self._drift_pa = float(drift[-1])
        true = PRESSURE_PA * (1.0 - 2.25577e-5 * height_m) ** 5.25588 + drift if air_pa is None else air_pa
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
