# SPDX-License-Identifier: MIT
"""The way back along the way that was walked, for buildings without a plan.

In: positions in order of time. Out: the shortest way back to the first one along them. Owns the positions.

Each position is joined to the one before it, and to every earlier one so near that the way has passed there again; of these the one with the
shortest way back is kept [Dijkstra 1959, by induction: a way back runs only through earlier positions]. So a loop is cut where it closes, as far as
the track is good enough to show it, and a way in and out of a room is left out.
"""

from __future__ import annotations

import math
from collections import defaultdict

import numpy as np

from echostep.arrays import Floats

STEP_M = 0.5  # least distance between two positions: corners of corridors are kept
JOIN_M = 1.0  # positions this near on one level are the same place: less than the distance of two ways on either side of a wall
LEVEL_M = 1.5  # less than this between their heights: half the height of a level


class OwnWay:
    """Positions that were walked, each with its way back, and the present one."""

    def __init__(self) -> None:
        self._at: list[tuple[float, float, float]] = []  # x, y, z in m
        self._next: list[int] = []  # the position to go to from each on the way back; for the first, itself
        self._back_m: list[float] = []  # length of the way back from each
        self._cells: defaultdict[tuple[int, int], list[int]] = defaultdict(list)  # positions by cell of JOIN_M
        self._here = -1  # the present position; -1 before the first

    def add(self, x_m: float, y_m: float, z_m: float = 0.0) -> None:
        """Walk to a new position, unless it is nearly the present one."""
        here = (x_m, y_m, z_m)
        if self._at and math.dist(self._at[self._here][:2], here[:2]) < STEP_M:
            return
        new = len(self._at)
        ways = [(self._back_m[k] + math.dist(self._at[k][:2], here[:2]), k) for k in self._joined(here)]
        back_m, following = min(ways, default=(0.0, new))
        self._at.append(here)
        self._next.append(following)
        self._back_m.append(back_m)
        self._cells[_cell(x_m, y_m)].append(new)
        self._here = new

    def go_back_to(self, left_m: float) -> None:
        """Move to the position on the way back from which at least `left_m` is left."""
        while self._at and self._next[self._here] != self._here and self._back_m[self._next[self._here]] >= left_m:
            self._here = self._next[self._here]

    def line_m(self) -> Floats:
        """The way back (k, 2) from the present position to the first."""
        k, line = self._here, []
        while k >= 0:
            line.append(self._at[k][:2])
            k = self._next[k] if self._next[k] != k else -1
        return np.array(line, np.float64).reshape(-1, 2)

    def _joined(self, here: tuple[float, float, float]) -> list[int]:
        """The present position, and the earlier ones at nearly this place."""
        x, y, z = here
        column, row = _cell(x, y)
        near = [k for i in (-1, 0, 1) for j in (-1, 0, 1) for k in self._cells.get((column + i, row + j), ())]
        same = [k for k in near if math.dist(self._at[k][:2], (x, y)) < JOIN_M and abs(self._at[k][2] - z) < LEVEL_M]
        return [self._here, *same] if self._at else []


def _cell(x_m: float, y_m: float) -> tuple[int, int]:
    return math.floor(x_m / JOIN_M), math.floor(y_m / JOIN_M)
