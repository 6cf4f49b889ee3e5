# SPDX-License-Identifier: MIT
"""The word that people read: worse at once, better once it has held.

In: statuses with the estimates' own times, so that a live run and its replay say the same. Out: the worst of the last HOLD_S. Owns those.
The one rule for page, speech, terminal and reports; files, and whatever computes on, have each estimate's own status.
`running_note`, `late_words`, `fitting`, `elsewhere`: words after the status: of a run, of an age, of places that fit, of what is elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from echostep.localization import Estimate, LikelyPlace, TrackStatus
from echostep.particles.limits import PROBABLE
from echostep.path import PathSegment
from echostep.tracker import Tracker

SETTLED_S = 2.0  # largest normal age of an estimate: the tracker gives two a second, or one per stride
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
        """The estimate with its steady status, lost where it claims no place; a check-in, or its undoing, is a new beginning."""
        state = tracker.state
        if self._check_ins != (check_ins := (state.check_ins, state.undone)):
            self._recent, self._check_ins = [], check_ins
        status = estimate.status if estimate.claims_place else TrackStatus.LOST
        return replace(estimate, status=self.worst(estimate.t_s, status))


def running_note(segment: PathSegment | None, estimate: Estimate | None) -> str:
    """That the foot runs, with the 95 % radius of a position that may be named; empty while it walks or rests, or is not worn."""
    if segment is None or estimate is None or not segment.running:
        return ""
    if not estimate.claims_place:
        return "running"
    return f"running: position good to about {estimate.ellipse95.major_m:.1f} m"


def late_words(age_s: float) -> str:
    """That a position is older than it normally is: "late 3 s"; else empty."""
    return f"late {span_words(age_s)}" if age_s > SETTLED_S else ""


def span_words(seconds: float) -> str:
    """A time as text: 3 s, 5 min."""
    return f"{seconds:.0f} s" if seconds < 120.0 else f"{seconds / 60.0:.0f} min"


def fitting(places: Sequence[LikelyPlace]) -> str:
    """The number of places that fit, and their share of the belief."""
    count, share = len(places), sum(place.probability for place in places)
    return f"{count} {'place fits' if count == 1 else 'places fit'}, {100.0 * share:.0f} % in all"


def other_floor(estimate: Estimate) -> str:
    """That the wearer is on a floor that the plan lacks, or to which no way of the plan leads; else empty."""
    return "the pressure says another floor" if sum(estimate.levels) < PROBABLE else ""


def elsewhere(estimate: Estimate) -> str:
    """Where a position that is not sure is wrong: another floor, or the share of the belief that is not at its place."""
    if floor := other_floor(estimate):
        return f", {floor}"
    share = round(100.0 * (1.0 - estimate.right))
    return f", {share} % elsewhere" if share and estimate.status is TrackStatus.UNCERTAIN else ""
