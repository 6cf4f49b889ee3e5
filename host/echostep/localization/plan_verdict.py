# SPDX-License-Identifier: MIT
"""Whether the plan is that of the building.

In: what becomes of searches and of believed clouds. Out: a probability. Owns its log-odds, and where a believed cloud went through a wall.

On the plan of another building a search finds nothing, or a place that the next echoes reject; a stated start is rejected; a believed cloud goes
through walls. Each is FAILS as probable if the plan fits as if it does not.
"""

from __future__ import annotations

import math

from echostep.localization.plausibility import Plausibility
from echostep.plan.model import Pose

# All by reason.
PLAN_FITS = 0.99  # prior and greatest probability
FAILS = 0.05  # unknown starts are found within FOUND_WITHIN_M; stated ones are wrong about as often as plans
FOUND_WITHIN_M = 40.0  # path on which an unknown start is found on one level
RESTORED_PER_M = -math.log(FAILS) / FOUND_WITHIN_M  # log-odds that the plan gains back on the path of a believed cloud
EARLY_M = 20.0  # path on which a cloud is rejected that was wrong from the first
CROSSED_M = 2.5  # from one way through a wall, within which another is through the same one


class PlanVerdict:
    """`probability` that the plan fits, after all that was told."""

    def __init__(self) -> None:
        self._fits = Plausibility(PLAN_FITS)
        self._crossed: list[Pose] = []

    @property
    def probability(self) -> float:
        """That the plan is the building's."""
        return self._fits.probability

    def confirm(self, path_m: float) -> None:
        """A cloud was believed on this length of path."""
        self._fits.add(RESTORED_PER_M * path_m)
        self._fits.limit(PLAN_FITS)

    def fail_search(self) -> None:
        """A search has found nothing, or a wrong place."""
        self._count_against()

    def reject_start(self, path_m: float) -> None:
        """A stated start is doubted after this length of path."""
        if path_m < EARLY_M:
            self._count_against()

    def reject_found(self, late_m: float) -> None:
        """The place that a search has found is doubted, `late_m` of path after a search should have found."""
        if late_m < EARLY_M:
            self._count_against()

    def cross(self, at: Pose) -> None:
        """A believed cloud has gone through a wall here: the plan is wrong there, which counts once a wall."""
        if any(
            at.level == was.level and math.hypot(at.x_m - was.x_m, at.y_m - was.y_m) <= CROSSED_M
            for was in self._crossed
        ):
            return
        self._crossed.append(at)
        self._count_against()

    def _count_against(self) -> None:
        """One observation that is FAILS as probable if the plan fits."""
        self._fits.add(math.log(FAILS))
