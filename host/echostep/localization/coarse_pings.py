# SPDX-License-Identifier: MIT
"""Which pings a coarse cloud uses, and what each is worth.

In: pings in order of time. Out: `CoarsePing`. Owns the length of the path, and the last ping of each ranger that was used.
"""

from __future__ import annotations

import math

from echostep.localization.coarse_field import AFTER_ECHO, AFTER_SILENCE, CoarsePing
from echostep.localization.particle_kernels import PingBatch

USED_M = 0.25  # path between two pings of one ranger that are used, by reason: a cell of the table
INDEPENDENT_M = 0.8  # path on which pings of one ranger bring the information of one, by reason: walls go on


class CoarsePings:
    """The memory of both rangers since the cloud began."""

    def __init__(self) -> None:
        self.path_m = 0.0
        self._used_at_m = [-math.inf, -math.inf]  # path at the last ping of each ranger
        self._after = [AFTER_SILENCE, AFTER_SILENCE]  # what that was

    def take(self, pings: PingBatch, k: int, way_m: float) -> CoarsePing | None:
        """The k-th ping, `way_m` after `path_m`; None if it comes too soon after the last one of its ranger."""
        ranger, at_m = int(pings.ranger[k]), self.path_m + way_m
        travel_m, after = at_m - self._used_at_m[ranger], self._after[ranger]
        if travel_m < USED_M:
            return None
        axis_rad, range_m, missed = (float(v[k]) for v in (pings.axis_rad, pings.range_m, pings.missed))
        self._used_at_m[ranger], self._after[ranger] = at_m, AFTER_ECHO if range_m > 0.0 else AFTER_SILENCE
        return CoarsePing(axis_rad, range_m, min(travel_m / INDEPENDENT_M, 1.0), missed, after)
