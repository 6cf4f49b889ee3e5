# SPDX-License-Identifier: MIT
"""A guided run: estimates of a tracker in, cues out, to show, to speak and to keep.

In: a tracker, a destination: the nearest exit, or a place. Out: a `Cue` for each estimate, when the tracker publishes it. Owns the guide. The time
of the last beacon contact is read at that moment, so a replay gives the same cues, in whatever portions its chunks come.
"""

from __future__ import annotations

import contextlib
import math
from functools import partial

from echostep.errors import EchostepError
from echostep.localization import Estimate, TrackStatus
from echostep.path import MeasuredSegment
from echostep.plan import Plan
from echostep.tracker import Tracker
from echostep_app.guidance.cue_list import CueList
from echostep_app.guidance.cues import Cue, CueKind, Guide
from echostep_app.guidance.guided_return import GuidedReturn
from echostep_app.plan.routing import EXIT, Goal, RoutePlace, Routes

NO_WAY = "Stop. No way leads there from here"
ARRIVED = ("You have arrived", "You are outside")  # at a place, at an exit
FAR_M = 9.0  # from a route: the first cue is to lead back to it, which compiles all kernels
AGAIN_S = 2.0  # shortest time between two searches for a way, assumed


def guidance_of(tracker: Tracker, to: str | None) -> CueList | None:
    """The guidance of a run to a destination as given; None without one. To an exit that no plan shows: back along the own way."""
    if to is None:
        return None
    is_drawn = tracker.plan.is_drawn
    if to == EXIT and not (is_drawn and tracker.plan.exits):
        return GuidedReturn(tracker)
    if not is_drawn:
        raise EchostepError(f"--guide {to}: without a plan the only destination is: {EXIT}")
    return GuidedRun(tracker, destination(to, tracker.plan))


def destination(text: str, plan: Plan) -> Goal:
    """The exits (`exit`), the place of a room's name, or of X,Y[,LEVEL]; raises EchostepError that lists the rooms."""
    if text == EXIT:
        return EXIT
    for k, level in enumerate(plan.levels):
        for room in level.rooms:
            if room.name.casefold() == text.casefold():
                return RoutePlace(*room.at_m, k)
    try:
        x, y, *rest = (float(part) for part in text.split(","))
        level_number = int(rest[0]) if rest else 0
        if len(rest) > 1 or not (math.isfinite(x) and math.isfinite(y)) or not 0 <= level_number < len(plan.levels):
            raise ValueError
    except (ValueError, OverflowError) as error:
        names = sorted({room.name for level in plan.levels for room in level.rooms})
        known = f"one of: {', '.join(names)}" if names else "this plan names no rooms"
        raise EchostepError(f"--guide {text}: expected exit, X,Y[,LEVEL] on the plan, or a room; {known}") from error
    return RoutePlace(x, y, level_number)


class GuidedRun(CueList):
    """Guides the wearer of one tracker to one destination; the route begins at the first estimate."""

    def __init__(self, tracker: Tracker, to: Goal) -> None:
        """Raises EchostepError for a place outside the plan."""
        super().__init__()
        self._tracker = tracker
        self._again = partial(Routes(tracker.plan).way, end=to)
        self._arrived = ARRIVED[to == EXIT]
        self._searched_s = -math.inf
        at = to if isinstance(to, RoutePlace) else tracker.plan.exits[0]
        with contextlib.suppress(EchostepError) if to == EXIT else contextlib.nullcontext():
            first = Guide(self._again(RoutePlace(at.x_m, at.y_m, at.level)))
            first.cue(
                Estimate(0.0, at.x_m + FAR_M, at.y_m, 1.0, 0.0, 1.0, 0.0, 0.0, 0, TrackStatus.TRACKING, at.level)
            )  # lays the grids and compiles the kernels now, not during the run
        tracker.watchers.append(self._watch)

    def _watch(self, _: MeasuredSegment | None, e: Estimate) -> None:
        """Add the cue of a new estimate."""
        if self._guide is None and e.t_s - self._searched_s >= AGAIN_S:
            self._searched_s = e.t_s
            with contextlib.suppress(EchostepError):
                self._guide = Guide(self._again(RoutePlace(e.x_m, e.y_m, e.level)), self._again, self._arrived)
        if self._guide is None:
            self.cues.append(Cue(e.t_s, CueKind.STOP, NO_WAY, None, "" if self.cues else f"{NO_WAY}."))
        else:
            self.cues.append(self._guide.cue(e, self._tracker.state.beacon_heard_s))
