# SPDX-License-Identifier: MIT
"""The first readings of a barometer may be its reset value: heights by pressure begin again at the jump to the true ones.

In: times and heights of the board's barometer, restarts of the board. Out: for each height how often the heights have begun again; heights before a
new beginning are unrelated to heights after it. Owns the newest reading, and the number of readings since the last beginning.

A BMP280 gave 68500 Pa, its reset value, before its first conversion [finitespace/BME280, issue 59]; this is a height of 3 km, against which no storey
is resolved for the rest of the walk.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats, Ints

SETTLING = 9  # readings after a start that may be wrong: a second of the SCP1000; assumed
STEP_M = 2.0  # between two readings, by noise: six standard deviations of the difference of two [HEIGHT_SD_M] and some draught
FASTEST_M_S = 10.0  # of a lift; assumed


class BarometerStart:
    """Call `starts` with the readings of each portion."""

    def __init__(self) -> None:
        self.jumps = 0  # beginnings that no restart of the board explains
        self._count = 0  # readings since the last restart of the board
        self._board_restarts = 0
        self._t_s, self._height_m = math.nan, math.nan

    def starts(self, t_s: Floats, height_m: Floats, board_restarts: Ints) -> Ints:
        """How often heights have begun again before each reading (n,): at restarts of the board, and at jumps right after its start."""
        if not len(t_s):
            return board_restarts
        if self._count >= SETTLING and board_restarts[-1] == self._board_restarts:
            return board_restarts + self.jumps
        rows = zip(t_s.tolist(), height_m.tolist(), board_restarts.tolist(), strict=True)
        return np.array([self._start(*row) for row in rows], np.int64)

    def _start(self, t_s: float, height_m: float, board_restarts: int) -> int:
        if board_restarts != self._board_restarts:
            self._board_restarts, self._count = board_restarts, 0
        elif 0 < self._count < SETTLING:
            possible_m = STEP_M + FASTEST_M_S * abs(t_s - self._t_s)
            self.jumps += abs(height_m - self._height_m) > possible_m
        self._count += 1
        self._t_s, self._height_m = t_s, height_m
        return board_restarts + self.jumps
