# SPDX-License-Identifier: MIT
"""How far the newest search of the building has come, and whether it has failed.

In: the length of the path, the cloud that searches. Out: answers for the rules of `MapFilter`. Owns the lengths at which a search began and was last
coarse.
"""

from __future__ import annotations

from echostep.localization.belief import EARLY_M, FOUND, FOUND_WITHIN_M, LEVEL_M, REJECTED, CloudHypothesis
from echostep.localization.particles.cloud import Cloud


class SearchProgress:
    """`found_within_m`: path within which a search finds. `log_odds_before`: that the tracked cloud was right, when the search began."""

    def __init__(self, levels: int, log_odds: float) -> None:
        """`levels`: of the plan; storeys are often alike but for their doors, so a search on more of them takes longer."""
        self.found_within_m = FOUND_WITHIN_M + LEVEL_M * (levels - 1)
        self.log_odds_before = log_odds
        self._began_m = 0.0
        self._coarse_m = 0.0  # length of the path on which it was coarse

    def begin(self, path_m: float, log_odds: float) -> None:
        """A search begins at this length of the path."""
        self._began_m, self._coarse_m = path_m, 0.0
        self.log_odds_before = log_odds

    def length_m(self, path_m: float) -> float:
        """Length of the path since the search began."""
        return path_m - self._began_m

    def note_coarse(self, path_m: float) -> bool:
        """The search is coarse; returns whether it has just passed the path within which one finds."""
        before_m, self._coarse_m = self._coarse_m, self.length_m(path_m)
        return before_m <= self.found_within_m < self._coarse_m

    def is_astray(self, cloud: Cloud, path_m: float) -> bool:
        """Whether a cloud is still coarse after twice the path within which a place is found."""
        return cloud.is_coarse and self.length_m(path_m) > 2.0 * self.found_within_m

    def has_failed(self, search: CloudHypothesis, path_m: float) -> bool:
        """Whether a search has gathered in a wrong place, left through walls as a whole, or found nothing probable for long."""
        if search.plausibility.probability < REJECTED or (search.cloud.rescues and not search.has_contracted):
            return True
        if search.cloud.is_coarse:
            return self.is_astray(search.cloud, path_m)
        # Storeys that are alike stay several places, and no new search would tell them apart.
        is_probable = search.has_contracted and search.plausibility.probability > FOUND
        return not is_probable and self.length_m(path_m) > max(self.found_within_m, self._coarse_m + EARLY_M)
