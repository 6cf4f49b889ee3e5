# SPDX-License-Identifier: MIT
"""Progress of the newest search of the building, and whether it has failed.

In: the odometer of the path, the cloud of the search. Out: the conditions of `MapFilter`'s decisions. Owns the marks on the path where a
search began and had last found no place.
"""

from __future__ import annotations

from echostep.localization.belief import EARLY_M, FOUND, FOUND_WITHIN_M, LEVEL_M, REJECTED, CloudHypothesis
from echostep.localization.particles.cloud import Cloud
from echostep.path import Odometer


class SearchProgress:
    """`found_within_m`: path within which a search usually finds the place. `log_odds_before`: of the tracked cloud, when the search began."""

    def __init__(self, odometer: Odometer, levels: int, log_odds: float) -> None:
        """`levels`: number of levels of the plan; they are often alike but for their doors, so a search on more of them takes longer."""
        self.found_within_m = FOUND_WITHIN_M + LEVEL_M * (levels - 1)
        self.log_odds_before = log_odds
        self._odometer = odometer
        self._began_m = odometer.path_m
        self._unfound_m = 0.0  # length of the path on which it had found no place

    def begin(self, log_odds: float) -> None:
        """A search begins here on the path."""
        self._began_m, self._unfound_m = self._odometer.path_m, 0.0
        self.log_odds_before = log_odds

    @property
    def length_m(self) -> float:
        """Length of the path since the search began."""
        return self._odometer.since_m(self._began_m)

    def note_unfound(self) -> bool:
        """Note that the search has found no place yet; returns whether it has just exceeded `found_within_m`."""
        before_m, self._unfound_m = self._unfound_m, self.length_m
        return before_m <= self.found_within_m < self._unfound_m

    def is_astray(self, cloud: Cloud) -> bool:
        """Whether a cloud has found no place after twice `found_within_m`."""
        return cloud.is_searching and self.length_m > 2.0 * self.found_within_m

    def has_failed(self, search: CloudHypothesis) -> bool:
        """Whether a search is improbable, crossed a wall as a whole before it contracted, or has had no probable place for too long."""
        if search.plausibility.probability < REJECTED or (search.cloud.rescues and not search.has_contracted):
            return True
        if search.cloud.is_searching:
            return self.is_astray(search.cloud)
        # Levels that are alike remain several places, and a new search would not discriminate between them.
        is_probable = search.has_contracted and search.plausibility.probability > FOUND
        return not is_probable and self.length_m > max(self.found_within_m, self._unfound_m + EARLY_M)
