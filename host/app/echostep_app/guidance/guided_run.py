# SPDX-License-Identifier: MIT
"""A guided run: estimates of a tracker in, cues out, to show, to speak and to keep.

In: a tracker, a destination: the nearest exit, a place, or another wearer of the team. Out: a `Cue` for each estimate, when the tracker publishes it.
Owns the guide. The time of the last beacon contact is read at that moment, so a replay gives the same cues, in whatever portions its chunks come.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

from echostep.errors import EchostepError
from echostep.localization import Estimate, TrackStatus
from echostep.path import MeasuredSegment
from echostep.plan import Plan
from echostep.tracker import Tracker
from echostep_app.guidance.cue_list import CueList
from echostep_app.guidance.cues import Cue, CueKind, Guide
from echostep_app.guidance.guided_return import GuidedReturn
from echostep_app.plan.routing import EXIT, Goal, Route, RoutePlace, Routes
from echostep_app.ports.teammate import Teammate, parse_teammate

NO_WAY = "Stop. No way leads there from here"
ARRIVED = ("You have arrived", "You are outside")  # at a place, at an exit
FAR_M = 9.0  # from a route: the first cue is to lead back to it, which compiles all kernels
# Assumed, not measured.
MOVED_M = 1.5  # of the other wearer: then a new way is looked for
AGAIN_S = 2.0  # shortest time between two searches for a way
PREFIX = "wearer:"


def guidance_of(tracker: Tracker, to: str | None) -> CueList | None:
    """The guidance of a run to a destination as given; None without one. To an exit that no plan shows: back along the own way."""
    if to is None:
        return None
    name, is_drawn = to.removeprefix(PREFIX), tracker.plan.is_drawn
    if to == EXIT and not (is_drawn and tracker.plan.exits):
        return GuidedReturn(tracker)
    if not is_drawn:
        raise EchostepError(f"--guide {to}: without a plan the only destination is: {EXIT}")
    if not name:
        raise EchostepError(f"--guide {to}: expected {PREFIX}NAME")
    return GuidedRun(tracker, destination(to, tracker.plan)) if name == to else GuidedRescue(tracker, name)


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

    def __init__(self, tracker: Tracker, to: Goal | None) -> None:
        """`to`: None while it is not known. Raises EchostepError for a place outside the plan."""
        super().__init__()
        self._tracker, self._to = tracker, to
        self._routes = Routes(tracker.plan)
        self._guide: Guide | None = None
        self._searched_s = -math.inf
        self._why = NO_WAY  # there is no route
        if isinstance(to, RoutePlace):
            first = Guide(self._routes.way(to, to))
            first.cue(
                Estimate(0.0, to.x_m + FAR_M, to.y_m, 1.0, 0.0, 1.0, 0.0, 0.0, 0, TrackStatus.TRACKING, to.level)
            )  # compiles the kernels now, not during the run
        tracker.watchers.append(self._watch)

    @property
    def route(self) -> Route | None:
        """The present route."""
        return self._guide.route if self._guide else None

    def _watch(self, _: MeasuredSegment | None, e: Estimate) -> None:
        """Add the cue of a new estimate."""
        if self._guide is None and self._to is not None:
            self._find_route(e, self._to)
        if self._guide is None:
            is_new = not self.cues or self.cues[-1].text != self._why
            self.cues.append(Cue(e.t_s, CueKind.STOP, self._why, None, f"{self._why}." if is_new else ""))
        else:
            self.cues.append(self._guide.cue(e, self._tracker.state.beacon_heard_s))

    def _find_route(self, e: Estimate, to: Goal) -> bool:
        """Find the route from an estimate, not more often than every `AGAIN_S`; whether there is one."""
        if e.t_s - self._searched_s < AGAIN_S:
            return False
        self._searched_s = e.t_s
        again = partial(self._routes.way, end=to)
        try:
            route = again(RoutePlace(e.x_m, e.y_m, e.level))
        except EchostepError:
            self._why = NO_WAY
            return False
        self._guide, self._to = Guide(route, again=again, arrived=ARRIVED[to == EXIT]), to
        return True


class GuidedRescue(GuidedRun):
    """Guides the wearer of one tracker to the wearer `name`; the route begins when both places are known.

    The places come through the tracker (port `TEAM`), so a replay gives the same cues.
    """

    def __init__(self, tracker: Tracker, name: str) -> None:
        super().__init__(tracker, None)
        self.name = name
        self.bad = 0  # chunks that were not a place
        self._target: Teammate | None = None
        self._why = f"Stop. The place of {name} is not known yet"
        tracker.team_watchers.append(self._receive)

    def _receive(self, payload: bytes) -> None:
        """Take a new place of the other wearer, unless it is on a level that the plan does not have."""
        teammate = parse_teammate(payload)
        if teammate is None or teammate.name != self.name or teammate.level >= len(self._tracker.plan.levels):
            self.bad += 1
            return
        self._target = teammate

    def _watch(self, measured: MeasuredSegment | None, e: Estimate) -> None:
        """Add the cue of a new estimate, after what is new about the other wearer."""
        news = self._follow(e, self._target) if self._target else ""
        super()._watch(measured, e)
        if news:
            self.cues[-1] = replace(self.cues[-1], spoken=f"{news} {self.cues[-1].spoken}".strip())

    def _follow(self, e: Estimate, target: Teammate) -> str:
        """Find a new way when the other wearer has moved; the sentence to speak about it."""
        before, to, news = self._to, RoutePlace(target.x_m, target.y_m, target.level), ""
        off_m = math.inf
        if isinstance(before, RoutePlace) and before.level == to.level:
            off_m = math.hypot(before.x_m - to.x_m, before.y_m - to.y_m)
        if off_m >= MOVED_M and self._find_route(e, to):
            news = f"{self.name} has moved." if before else f"{self.name} is {target.words}." if target.words else ""
        if self._guide:
            within = f": within {target.radius_m:.0f} m of you" if target.radius_m >= 1.0 else ""
            self._guide.arrived = f"{self.name} is here{within}"
        return news
