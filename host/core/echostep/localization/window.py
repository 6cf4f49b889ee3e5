# SPDX-License-Identifier: MIT
"""The last metres of the path, which are searched, and walked again where levels may be alike.

In: moves with their pings and changes of height; a search. Out: the clouds that it has found, at the end of the path. Owns the moves.

The range table has half of the information of the echoes. So what a search has found on several levels walks the path again by traced echoes.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np

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

    def births(self, search: Search, model: EchoModel, walls: Walls) -> list[tuple[Cloud, float]]:
        """A cloud with its probability for each place that a search has found; none before it is over.

        Where the level is not known, there is one on each, and they walk the way from its beginning: by traced echoes it is known which level it is.
        A level that is known is kept: stairs may have led there.
        """
        places = search.found()
        if not search.is_on_any_level:
            return [(search.draw(place), place.probability) for place in places]
        share = 1.0 / max(search.levels * len(places), 1)
        clouds = [search.draw(place, level, share) for place in places for level in range(search.levels)]
        log_share = np.array([self._walk(cloud, model, walls) for cloud in clouds])
        probability = np.exp(log_share - log_share.max(initial=-math.inf))
        probability *= sum(place.probability for place in places) / max(float(probability.sum()), 1.0)
        return list(zip(clouds, probability.tolist(), strict=True))

    def _walk(self, cloud: Cloud, model: EchoModel, walls: Walls) -> float:
        """Let a cloud walk the way from its beginning; returns the log of its density of the pings, the heights, and of what walls have left."""
        log_density = 0.0
        cloud.go_back(sum(move.dx_m for move, _, _ in self._pieces), sum(move.dy_m for move, _, _ in self._pieces))
        for move, pings, change in self._pieces:
            evidence = cloud.propagate_and_reweight(move, pings, model, walls)
            log_density += float(evidence.log_pings.sum()) + evidence.log_path + cloud.change_levels(move, change)
        return log_density
