# SPDX-License-Identifier: MIT
"""A simulated wearer who does what `echostep calibrate` asks, in its order: stand still, turn once round, walk 10 m (`make twin STILL=1`).

In: a plan, a seed. Out: rows for the board, part by part. Owns the scenario of the walk. The turn is the standing wearer with the belt gyro and
the compass turned; iron does not turn with it.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echostep.plan import Plan
from echostep_app.simulation.devices.board import Board
from echostep_app.simulation.people.walker import Person
from echostep_app.simulation.scenario import Scenario

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
