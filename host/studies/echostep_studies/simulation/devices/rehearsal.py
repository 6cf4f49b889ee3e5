# SPDX-License-Identifier: MIT
"""A simulated wearer who does what `echostep calibrate` asks, in its order: stand still, turn once round, walk 10 m (`make twin STILL=1`).

In: a plan, a seed. Out: rows for the board, part by part. Owns the scenario of the walk. The turn is the standing wearer with the belt gyro and
the compass turned; iron does not turn with it.
Boxes lie on their sides, as `echostep calibrate accelerometers` asks (`make twin STILL=1 KIT=2026`).
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Floats
from echostep.plan import Plan
from echostep_simulation.devices.board import Board
from echostep_simulation.people.walker import Person
from echostep_simulation.scenario import Scenario
from echostep_simulation.stimulus import EXTENDED_ROW, NO_SYNC

WALK = ((2.0, 7.5), (12.0, 7.5))  # 10 m along the demo's corridor
TURN_DEG_S, TURN_BEGIN_MS, TURN_END_MS = 22.0, 1000, 18_500  # 385 degrees within the 20 s of the measurement
COUNT_DEG_S = 0.2439  # of the gyros [ADIS16100]
STANDING_MS = 1000  # of the walk's beginning, in which the wearer stands


class Act(IntEnum):
    """What the wearer does while the board's port is open; each opening is the next one."""

    STAND = 0
    TURN = 1
    WALK = 2


class Rehearsal:
    """Rows of the acts; noise goes on from call to call."""

    def __init__(self, plan: Plan, seed: int, board: Board) -> None:
        self._scenario = Scenario(plan, WALK, seed, board, Person())

    def rows(self, act: Act, begin_ms: int, count: int) -> NDArray[Any]:
        """`count` milliseconds of an act, from `begin_ms` after its beginning."""
        if act is Act.WALK:
            return self._scenario.sensors.rows(begin_ms, begin_ms + count).copy()
        rows = self._scenario.sensors.rows(begin_ms % STANDING_MS, begin_ms % STANDING_MS + count).copy()
        if act is Act.TURN:
            at_ms = np.arange(begin_ms, begin_ms + count)
            turning = (at_ms >= TURN_BEGIN_MS) & (at_ms < TURN_END_MS)
            turned_deg = TURN_DEG_S * 1e-3 * (np.clip(at_ms, TURN_BEGIN_MS, TURN_END_MS) - TURN_BEGIN_MS)
            rows["belt"] += np.where(turning, round(TURN_DEG_S / COUNT_DEG_S), 0).astype(np.int16)
            rows["bearing"] = (rows["bearing"] - 10.0 * turned_deg) % 3600.0
        return rows


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
