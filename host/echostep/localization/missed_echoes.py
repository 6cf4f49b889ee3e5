# SPDX-License-Identifier: MIT
"""The share of pings at which a ranger receives nothing although a wall answers: a weak transducer, a cloth before it, a loose cable.

In: the ranges of both rangers in order of time. Out: the odds of a missed echo. Owns the counts of the last pings.

Learnt without a plan: silent pings between two echoes that are alike were missed, for the wall was there before and after. The counts are those of a
beta distribution that forgets.
"""

from __future__ import annotations

import math

# All by reason.
# Pings: a ranger in order misses one echo in two hundred; one that is not is known after two seconds
PRIOR_MISSED, PRIOR_HEARD = 0.1, 20.0
LIKE_M = 0.15  # difference of two echoes from one wall: three errors of their difference
SURE_M = 3.0  # range within which a wall is detected surely: half of the ranger's
MOST_SILENT = 8  # pings between two such echoes: more are a door
REMEMBERED = 200.0  # pings: tens of metres of path


class MissedEchoes:
    """Counts for two rangers."""

    def __init__(self) -> None:
        self._missed = [PRIOR_MISSED, PRIOR_MISSED]
        self._heard = [PRIOR_HEARD, PRIOR_HEARD]
        self._last_m = [math.nan, math.nan]  # last echo
        self._silent = [0, 0]  # pings since

    def odds(self, ranger: int) -> float:
        """Probability that an echo is missed over that it is received."""
        return self._missed[ranger] / self._heard[ranger]

    def update(self, ranger: int, range_m: float) -> None:
        """Count a ping; range 0: no echo."""
        if range_m <= 0.0:
            self._silent[ranger] += 1
            return
        is_sure = range_m < SURE_M and abs(range_m - self._last_m[ranger]) < LIKE_M
        if is_sure and self._silent[ranger] <= MOST_SILENT:
            self._count(ranger, self._silent[ranger])
        self._last_m[ranger], self._silent[ranger] = range_m, 0

    def _count(self, ranger: int, silent: int) -> None:
        missed, heard = self._missed[ranger] + silent, self._heard[ranger] + 1.0
        kept = min(1.0, REMEMBERED / (missed + heard))
        self._missed[ranger], self._heard[ranger] = kept * missed, kept * heard
