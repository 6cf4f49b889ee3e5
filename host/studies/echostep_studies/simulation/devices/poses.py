# SPDX-License-Identifier: MIT
"""Boxes that lie on their sides, as `echostep calibrate accelerometers` asks (`make twin STILL=1 KIT=2026`).

In: a seeded generator. Out: extended rows for a belt board or a foot board, side by side. Owns the parts' constant errors, and how each box lies.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Floats
from echostep_app.simulation.stimulus import EXTENDED_ROW, NO_SYNC

GRAVITY_M_S2 = 9.81
SIDES = np.array(
    [(0, 0, 1), (0, 0, -1), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)], np.float64
)  # upward in the box, one after the other
TILT_SD_RAD = math.radians(4.0)  # of a box on a table, and of the part in its box; assumed
# Limits of the errors [ICM-20649 data sheet DS-000192, table 2, as remembered]
OFFSET_M_S2, SCALE_ERROR = (0.050 * 9.80665, 0.01)
RATE_BIAS_RAD_S = math.radians(5.0)  # limit [table 1]
SKEW = 0.005  # sd of the angle between axes that should be at right angles: the data sheet's 2 % is its limit
# Of an LSM6DSO and of an ICM-20649: unit and noise of a force, m/s2; of a rate, rad/s [data sheets].
UNITS = {
    "belt board": (0.244e-3 * 9.80665, 0.02, math.radians(0.035), math.radians(0.034)),
    "foot board": (9.80665 / 1024.0, 0.04, math.radians(1.0 / 8.2), math.radians(0.27)),
}
PLACES = 3  # of a row; a foot board has its part in the first


class LyingParts:
    """The parts of one board; each lies on its own sides, in an order of its own."""

    def __init__(self, rng: np.random.Generator, board: str) -> None:
        """`board`: a key of UNITS."""
        self._rng, self._units = rng, UNITS[board]
        self.offset_m_s2: Floats = rng.uniform(-OFFSET_M_S2, OFFSET_M_S2, (PLACES, 3))
        self.gain: Floats = 1.0 + rng.uniform(-SCALE_ERROR, SCALE_ERROR, (PLACES, 3))  # measured per true
        self.bias_rad_s: Floats = rng.uniform(-RATE_BIAS_RAD_S, RATE_BIAS_RAD_S, (PLACES, 3))
        skew = np.triu(SKEW * rng.standard_normal((PLACES, 3, 3)), 1)
        self._axes = np.eye(3) + skew
        self._order = [rng.permutation(len(SIDES)) for _ in range(PLACES)]

    def rows(self, pose: int, count: int) -> NDArray[np.void]:
        """`count` milliseconds of the parts in this pose, counted on and on."""
        force_unit, force_noise, rate_unit, rate_noise = self._units
        rows = np.zeros(count, EXTENDED_ROW)
        rows["row"]["sync_us"], rows["row"]["pressure"], rows["row"]["temperature"] = NO_SYNC, 405_296, 480
        shape = (count, PLACES, 3)
        force = self.gain * np.einsum("pij,pj->pi", self._axes, self._gravity(pose)) + self.offset_m_s2
        rows["motion"]["force"] = np.rint((force + force_noise * self._rng.standard_normal(shape)) / force_unit)
        rows["motion"]["rate"] = np.rint((self.bias_rad_s + rate_noise * self._rng.standard_normal(shape)) / rate_unit)
        return rows

    def _gravity(self, pose: int) -> Floats:
        """True forces (PLACES, 3) in m/s2 in a pose, the same each time."""
        up = np.array([SIDES[order[pose % len(SIDES)]] for order in self._order])
        up += TILT_SD_RAD * np.random.default_rng(pose).standard_normal(up.shape)
        return GRAVITY_M_S2 * up / np.linalg.norm(up, axis=1, keepdims=True)
