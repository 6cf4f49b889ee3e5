# SPDX-License-Identifier: MIT
"""The sensors of the kit of 2026: pulse rangers, LSM6DSO on thigh, calf and belt, LIS3MDL at the belt, BMP390; none of them is built yet.

In: a walk, the levels of a building, a seeded generator. Out: extended rows for a board (docs/design/bench.md). Owns the parts' errors.

Axes: of thigh and calf x ahead, y up along the segment, z to the side; of the belt x ahead, y to the left, z up, tilted as a belt is. The forces on
thigh and calf are gravity alone; the trunk's include its horizontal acceleration.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Floats, Ints
from echostep.plan import Level
from echostep_simulation.devices.board_sensors import HARD_IRON, Scp1000Model
from echostep_simulation.people.attitude import rotations
from echostep_simulation.people.walker import RATE_HZ, Walk
from echostep_simulation.stimulus import EXTENDED_ROW, TEMPERATURE_C, BoardSensors
from echostep_simulation.world.acoustics import PULSE_RANGER
from echostep_simulation.world.magnetic_field import EARTH, EARTH_T, MagneticField

GYRO_RAD_S = math.radians(0.035)  # per count, 1000 deg/s [LSM6DSO data sheet, table 2]
GYRO_NOISE_RAD_S = math.radians(0.034)  # rms behind 50 Hz: 3.8 mdps per root Hz [table 2]
GYRO_BIAS_RAD_S = math.radians(1.0)  # zero-rate level, typical [table 2]
FORCE_M_S2 = 0.244e-3 * 9.80665  # per count, 8 g [table 2]
FORCE_NOISE_M_S2 = 0.02  # rms, 80 ug per root Hz [table 2]
FORCE_BIAS_M_S2 = 0.2  # zero-g level, typical [table 2]
FULL_SCALE = 32_767
G0_M_S2 = 9.80665  # standard gravity
BELT_TILT_RAD = math.radians(4.0)  # sd of roll and pitch; assumed
SPREAD_MS = 20  # of the second difference of the trunk's path: the path is piecewise smooth
FIELD_COUNTS = EARTH_T * 1e4 * 6842.0  # per earth field [LIS3MDL data sheet, table 2: 6842 per gauss]
FIELD_NOISE_COUNTS = 0.0035 * 6842.0  # rms in the finest mode [table 2: 3.2 to 4.1 mgauss]
PRESSURE_NOISE_PA = 1.0  # assumed: above the data sheet's: oversampling 16 and 2


class Kit2026Sensors:
    """Makes the extended rows of any stretch of a walk, as `BoardSensors` makes plain ones."""

    def __init__(
        self, walk: Walk, levels: Sequence[Level], sync_t_s: Floats, rng: np.random.Generator,
        magnetism: MagneticField | None = None, celsius: float = TEMPERATURE_C,
    ) -> None:  # fmt: skip
        self._walk, self._magnetism = walk, magnetism
        self._rng, *rest = rng.spawn(3)
        barometer = Scp1000Model(rest[1], noise_pa=PRESSURE_NOISE_PA)
        self._plain = BoardSensors(
            walk, levels, sync_t_s, rest[0], magnetism, None, PULSE_RANGER, barometer, celsius=celsius
        )
        self._gyro_bias = GYRO_BIAS_RAD_S * self._rng.standard_normal((3, 3))
        self._force_bias = FORCE_BIAS_M_S2 * self._rng.standard_normal((3, 3))
        self._tilt = rotations(np.array([[*(BELT_TILT_RAD * self._rng.standard_normal(2)), 0.0]]))[0]  # belt -> level
        self._iron = HARD_IRON * self._rng.standard_normal(3)
        self._angles = [np.cumsum(rate) / RATE_HZ for rate in (walk.thigh_rad_s, walk.calf_rad_s)]
        self._trunk_m_s2 = _accelerations(walk.trunk_m)

    def rows(self, start: int, stop: int, ranging: NDArray[np.bool_] | None = None) -> NDArray[np.void]:
        """Extended rows of the milliseconds start..stop-1 of the walk; past its end the last posture goes on."""
        at = np.minimum(np.arange(start, stop), len(self._walk.t_s) - 1)
        rows = np.zeros(len(at), EXTENDED_ROW)
        rows["row"] = self._plain.rows(start, stop, ranging)
        rates, forces = self._rates(at), self._forces(at)
        rows["motion"]["rate"] = _counts(rates, self._gyro_bias, GYRO_NOISE_RAD_S, GYRO_RAD_S, self._rng)
        rows["motion"]["force"] = _counts(forces, self._force_bias, FORCE_NOISE_M_S2, FORCE_M_S2, self._rng)
        noise = FIELD_NOISE_COUNTS * self._rng.standard_normal((len(at), 3))
        rows["field"] = np.rint(FIELD_COUNTS * (self._field(at) + self._iron) + noise)
        return rows

    def _rates(self, at: Ints) -> Floats:
        """True rates (n, 3 places, 3 axes)."""
        rates = np.zeros((len(at), 3, 3))
        for k, rate in enumerate((self._walk.thigh_rad_s, self._walk.calf_rad_s)):
            rates[:, k, 2] = rate[at]
        rates[:, 2] = self._walk.belt_rad_s[at, None] * self._tilt[2]
        return rates

    def _forces(self, at: Ints) -> Floats:
        """True specific forces (n, 3 places, 3 axes)."""
        forces = np.zeros((len(at), 3, 3))
        for k, angle in enumerate(self._angles):
            forces[:, k, 0] = G0_M_S2 * np.sin(angle[at])
            forces[:, k, 1] = G0_M_S2 * np.cos(angle[at])
        level = np.column_stack([self._ahead_left(self._trunk_m_s2[at], at), np.full(len(at), G0_M_S2)])
        forces[:, 2] = level @ self._tilt
        return forces

    def _field(self, at: Ints) -> Floats:
        """True field (n, 3) at the belt in its axes, in earth fields."""
        field = self._magnetism.field(self._walk.trunk_m[at]) if self._magnetism else np.tile(EARTH, (len(at), 1))
        tilted: Floats = np.column_stack([self._ahead_left(field[:, :2], at), field[:, 2]]) @ self._tilt
        return tilted

    def _ahead_left(self, map_xy: Floats, at: Ints) -> Floats:
        """Map vectors (n, 2) in the trunk's axes, ahead and left."""
        c, s = np.cos(self._walk.heading_rad[at]), np.sin(self._walk.heading_rad[at])
        return np.column_stack([map_xy[:, 0] * c + map_xy[:, 1] * s, map_xy[:, 1] * c - map_xy[:, 0] * s])


def _accelerations(path_m: Floats) -> Floats:
    """Accelerations (n, 2) along a path (n, 2) at 1 kHz."""
    accelerations = np.zeros_like(path_m)
    k = SPREAD_MS
    accelerations[k:-k] = (path_m[2 * k :] - 2.0 * path_m[k:-k] + path_m[: -2 * k]) * (RATE_HZ / k) ** 2
    return accelerations


def _counts(true: Floats, bias: Floats, noise: float, unit: float, rng: np.random.Generator) -> Floats:
    """Counts (n, 3, 3) of a part with bias and noise, limited to its range."""
    noisy = true + bias + noise * rng.standard_normal(true.shape)
    counts: Floats = np.clip(np.rint(noisy / unit), -FULL_SCALE, FULL_SCALE)
    return counts
