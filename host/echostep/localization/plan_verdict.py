# SPDX-License-Identifier: MIT
"""Whether the plan is that of the building.

In: what becomes of searches and of believed clouds. Out: a probability. Owns its log-odds, and where a believed cloud went through a wall.

On the plan of another building a search finds nothing, or a place that the next echoes reject; a stated start is rejected, and the search finds none
near it; a believed cloud goes through walls. Each is FAILS as probable if the plan fits as if it does not. Echoes that a cloud foretells confirm the
plan slowly: parts of two buildings are alike for ALIKE_M.
"""

from __future__ import annotations

import math

from echostep.localization.plausibility import Plausibility
from echostep.plan.model import Pose

# All by reason.
PLAN_FITS = 0.99  # prior
FAILS = 0.05  # unknown starts are found within FOUND_WITHIN_M; stated ones are wrong about as often as plans
GRAZED = 0.2  # of a wall on a plan that states an error: its end is in the way of a right cloud by as much, on 100 m once or so
FAR = 0.4  # the same for a rejected start that is found elsewhere: one in a hundred is so far off, half of the wrong plans have a place alike
FOUND_WITHIN_M = 40.0  # path on which an unknown start is found on one level
ALIKE_M = 30.0  # path on which a place on a wrong plan foretells the echoes, in the mean (20 to 50 m were seen): symmetric wings, storeys
MOST_FITS = 0.9995  # greatest probability: one wall that was never built leaves a confirmed plan at its prior
EARLY_M = 20.0  # path on which a cloud is rejected that was wrong from the first
NEAR_M = 5.0  # from a start that was rejected, within which a place makes it an error of the start: a room
CROSSED_M = (
    4.0  # from one way through a wall, within which another is through the same one; path on which a cloud goes through
)
THROUGH = math.log(
    1 / 100
)  # share of a cloud that finds no other way, below which it went through a wall: one edge of a door leaves more


def away_m(one: Pose, other: Pose) -> float:
    """Distance of two places on one level; infinite on different ones."""
    if one.level != other.level:
        return math.inf
    return math.hypot(other.x_m - one.x_m, other.y_m - one.y_m)


class PlanVerdict:
    """`probability` that the plan fits, after all that was told."""

    def __init__(self, plan_sd_m: float = 0.0) -> None:
        """`plan_sd_m`: error of the walls' positions that the plan states."""
        self._log_through = math.log(FAILS if plan_sd_m == 0.0 else GRAZED)
        self._fits = Plausibility(PLAN_FITS)
        self._crossed: list[Pose] = []
        self._log_passed = 0.0  # of a believed cloud on the last CROSSED_M, log of the share that went through no wall
        self._start_rejected = False
        self._taken = 0.0  # log-odds that the last rejection took

    @property
    def probability(self) -> float:
        """That the plan is the building's."""
        return self._fits.probability

    def confirm(self, path_m: float) -> None:
        """A cloud was believed on this length of path."""
        self._gain(path_m / ALIKE_M)

    def fail_search(self) -> None:
        """A search has found nothing, or a wrong place."""
        self._fits.add(math.log(FAILS))

    def reject_start(self, path_m: float) -> None:
        """A stated start is doubted after this length of path."""
        self._start_rejected = True
        self._reject(path_m)

    def reject_found(self, late_m: float) -> None:
        """The place that a search has found is doubted, `late_m` of path after a search should have found."""
        self._reject(late_m)

    def agree(self) -> None:
        """A search agrees with the cloud that was doubted, so that was right."""
        self._gain(self._taken)
        self._forget_rejection()

    def find(self, after_m: float, off_m: float) -> None:
        """A search has found a place after this length of path, so far off the cloud that was doubted.

        Soon and near, it was the stated start that was a little wrong.
        """
        if self._start_rejected:
            self._gain(self._taken if after_m < EARLY_M and off_m < NEAR_M else math.log(FAR))
        self._log_passed = 0.0
        self._forget_rejection()

    def pass_walls(self, at: Pose, path_m: float, log_passed: float) -> float:
        """A believed cloud has gone so far to this place; `log_passed`: log of the share of it that crossed no wall. Returns what that tells of it.

        If hardly any of it found another way, the plan is wrong there. That counts once a wall, and tells nothing more of the cloud afterwards.
        """
        if self._has_crossed(at):
            self._log_passed = 0.0
            return 0.0
        self._log_passed = self._log_passed * math.exp(-path_m / CROSSED_M) + log_passed
        if self._log_passed < THROUGH:
            self._crossed.append(at)
            self._fits.add(self._log_through)
        return log_passed

    def _has_crossed(self, at: Pose) -> bool:
        return any(away_m(was, at) <= CROSSED_M for was in self._crossed)

    def _reject(self, path_m: float) -> None:
        """Count against the plan that a cloud is doubted which was wrong from the first, if this path is short enough for that."""
        self._taken = -math.log(FAILS) if path_m < EARLY_M else 0.0
        self._gain(-self._taken)

    def _forget_rejection(self) -> None:
        self._start_rejected, self._taken = False, 0.0

    def _gain(self, log_odds: float) -> None:
        self._fits.add(log_odds)
        self._fits.limit(MOST_FITS)
