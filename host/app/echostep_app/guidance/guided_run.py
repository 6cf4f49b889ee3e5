# SPDX-License-Identifier: MIT
"""A guided run: estimates of a tracker in, cues out, to show, to speak and to keep.

In: a tracker, a destination. Out: a `Cue` for each estimate, when the tracker publishes it. Owns the guide. The time of the last beacon
contact is read at that moment, so a replay gives the same cues, in whatever portions its chunks come.
"""

from __future__ import annotations

import math

from echostep.errors import EchostepError
from echostep.localization import Estimate, TrackStatus
from echostep.path import MeasuredSegment
from echostep.plan import Plan
from echostep.tracker import Tracker
from echostep_app.guidance.cue_list import CueList
from echostep_app.guidance.cues import Cue, CueKind, Guide
from echostep_app.guidance.guided_rescue import GuidedRescue, rescued_wearer
from echostep_app.guidance.guided_return import GuidedReturn
from echostep_app.plan.routing import Route, RoutePlace, Routes

NO_WAY = "Stop. No way leads there from here"
FAR_M = 9.0  # from a route: the first cue is to lead back to it, which compiles all kernels


def guidance_of(tracker: Tracker, to: str | None) -> CueList | None:
    """The guidance of a run to a destination as given; None without one. Without a plan there is one destination, the start."""
    if to is None:
        return None
    if (name := rescued_wearer(to)) is not None:
        if not name or not tracker.plan.is_drawn:
            raise EchostepError(f"--guide {to}: expected wearer:NAME, and a plan that shows the way")
        return GuidedRescue(tracker, name)
    if tracker.plan.is_drawn:
        return GuidedRun(tracker, destination(to, tracker.plan))
    if to != "start":
        raise EchostepError(f"--guide {to}: without a plan the only destination is: start")
    return GuidedReturn(tracker)


def destination(text: str, plan: Plan) -> RoutePlace:
    """The place of a room's name, of X,Y[,LEVEL], or the plan's start (`start`); raises EchostepError that lists the rooms."""
    if text == "start" and plan.start is not None:
        return RoutePlace(plan.start.x_m, plan.start.y_m, max(plan.start.level, 0))
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
        raise EchostepError(f"--guide {text}: expected start, X,Y[,LEVEL] on the plan, or a room; {known}") from error
    return RoutePlace(x, y, level_number)


class GuidedRun(CueList):
    """Guides the wearer of one tracker to one place; the route begins at the first estimate."""

    def __init__(self, tracker: Tracker, to: RoutePlace) -> None:
        """Raises EchostepError for a place outside the plan."""
        super().__init__()
        self._tracker = tracker
        self._to = to
        self._routes = Routes(tracker.plan)
        first = Guide(self._routes.way(to, to))
        first.cue(
            Estimate(0.0, to.x_m + FAR_M, to.y_m, 1.0, 0.0, 1.0, 0.0, 0.0, 0, TrackStatus.TRACKING, to.level)
        )  # compiles the kernels now, not during the run
        self._guide: Guide | None = None
        tracker.watchers.append(self._watch)

    @property
    def route(self) -> Route | None:
        """The present route."""
        return self._guide.route if self._guide else None

    def _watch(self, _: MeasuredSegment | None, e: Estimate) -> None:
        """Add the cue of a new estimate."""
        if self._guide is None:
            self._find_route(e)
        if self._guide is None:
            self.cues.append(Cue(e.t_s, CueKind.STOP, NO_WAY, None, "" if self.cues else f"{NO_WAY}."))
            return
        self.cues.append(self._guide.cue(e, self._tracker.state.beacon_heard_s))

    def _find_route(self, e: Estimate) -> None:
        """Find the route from an estimate; without a route the next estimate is tried."""
        try:
            route = self._routes.way(RoutePlace(e.x_m, e.y_m, e.level), self._to)
        except EchostepError:
            return
        self._guide = Guide(route, planner=self._routes)
