# SPDX-License-Identifier: MIT
"""The word that people read: worse at once, better once it has held.

In: statuses with the estimates' own times, so that a live run and its replay say the same. Out: the worst of the last HOLD_S. Owns those.
The one rule for page, speech, terminal and reports; files, and whatever computes on, have each estimate's own status.
`running_note`, `fitting`, `elsewhere`: words after the status: of a run, of places that fit, of what is not at the position's place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from echostep.localization import Estimate, LikelyPlace, TrackStatus
from echostep.path import PathSegment
from echostep.tracker import Tracker

HOLD_S = 2.0  # assumed: two strides, and twice the second after which silence makes the next dropout
_WORSE = list(TrackStatus)


class SteadyStatus:
    """Call `worst` with each status in order of time."""

    def __init__(self) -> None:
        self._recent: list[tuple[float, TrackStatus]] = []
        self._check_ins = 0, 0  # with undoings

    def worst(self, t_s: float, status: TrackStatus) -> TrackStatus:
        """The worst status within HOLD_S of `t_s`, this one among them; times that went back hold nothing."""
        self._recent = [(at_s, each) for at_s, each in self._recent if abs(at_s - t_s) < HOLD_S] + [(t_s, status)]
        return max((each for _, each in self._recent), key=_WORSE.index)

    def shown(self, estimate: Estimate, tracker: Tracker) -> Estimate:
        """The estimate with its steady status; a check-in, or its undoing, is a new beginning."""
        state = tracker.state
        if self._check_ins != (check_ins := (state.check_ins, state.undone)):
            self._recent, self._check_ins = [], check_ins
        return replace(estimate, status=self.worst(estimate.t_s, estimate.status))


def running_note(segment: PathSegment | None, estimate: Estimate | None) -> str:
    """That the foot runs, with the 95 % radius of a position that may be named; empty while it walks or rests, or is not worn."""
    if segment is None or estimate is None or not segment.running:
        return ""
    if not estimate.claims_place:
        return "running"
    return f"running: position good to about {estimate.ellipse95.major_m:.1f} m"


def fitting(places: Sequence[LikelyPlace]) -> str:
    """The number of places that fit, and their share of the belief."""
    count, share = len(places), sum(place.probability for place in places)
    return f"{count} {'place fits' if count == 1 else 'places fit'}, {100.0 * share:.0f} % in all"


def elsewhere(estimate: Estimate) -> str:
    """The share of the belief that is not at the position's place, where the position is not sure."""
    share = round(100.0 * (1.0 - estimate.right))
    return f", {share} % elsewhere" if share and estimate.status is TrackStatus.UNCERTAIN else ""
