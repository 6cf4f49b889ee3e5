# SPDX-License-Identifier: MIT
"""The last metres of the path, for a second pass: levels of a building are often alike, and a search by the range table
cannot discriminate between them.

In: moves with their pings and changes of height; a cloud that has just been found. Out: the same cloud, after the pass. Owns the moves.

The range table has half of the information of the echoes. So where levels are alike, the exact filter processes the same path a second time, from its
beginning on every level.
"""

from __future__ import annotations

import math
from collections import deque

from echostep.echoes.likelihood import EchoModel
from echostep.height.levels import HeightChange
from echostep.localization.grid.search import Search
from echostep.localization.particles.cloud import Cloud
from echostep.localization.particles.start import Start
from echostep.particles.arrays import Move, PingBatch
from echostep.walls.echo_sources import Walls

PAST_M = 40.0  # path that is passed again: the path on which a place is found
MOST_PIECES = 1_000  # of that path: eight minutes of standing


class RecentWay:
    """The last PAST_M of the path; where it begins: anywhere, once more has been walked or it was cleared."""

    def __init__(self, begin: Start, walk_heading_rad: float) -> None:
        self.begin, self.walk_heading_rad = begin, walk_heading_rad
        self._pieces: deque[tuple[Move, PingBatch, HeightChange]] = deque()
        self.length_m = 0.0

    def __len__(self) -> int:
        return len(self._pieces)

    def add(self, move: Move, pings: PingBatch, change: HeightChange) -> None:
        """One more move."""
        self._pieces.append((move, pings, change))
        self.length_m += math.hypot(move.dx_m, move.dy_m)
        while self._pieces and (self.length_m > PAST_M or len(self._pieces) > MOST_PIECES):
            self.begin = Start()
            first, _, _ = self._pieces.popleft()
            self.length_m -= math.hypot(first.dx_m, first.dy_m)

    def clear(self) -> None:
        """Forget the path: the next move may begin elsewhere."""
        self.begin = Start()
        self._pieces.clear()
        self.length_m = 0.0

    def search(self, search: Search, model: EchoModel) -> float:
        """Let a search process the way from its beginning; returns the log of its density of the pings over the density without a plan."""
        log_pings = 0.0
        for move, pings, change in self._pieces:
            log_pings += search.advance(move, pings, model)
            search.change_levels(move, change)
        return log_pings

    def pass_again(self, cloud: Cloud, model: EchoModel, walls: Walls) -> None:
        """Let a cloud walk the way once more, from its beginning on each level; not where the level is known: stairs may have led there."""
        if cloud.sheet is not None and not cloud.is_on_any_level:
            return
        dx_m = sum(move.dx_m for move, _, _ in self._pieces)
        dy_m = sum(move.dy_m for move, _, _ in self._pieces)
        with cloud.passing_again(dx_m, dy_m):
            for move, pings, change in self._pieces:
                cloud.propagate_and_reweight(move, pings, model, walls)
                cloud.change_levels(move, change)
