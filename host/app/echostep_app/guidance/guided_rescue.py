# SPDX-License-Identifier: MIT
"""A rescuer guided to another wearer, over floors, along the shortest walkable way.

In: estimates of the rescuer's tracker, places of the other wearer as the tracker gets them (port `TEAM`). Out: a `Cue` for each estimate. Owns the
guide and the newest place. Everything comes through the tracker, so a replay gives the same cues.
"""

from __future__ import annotations

import math
from dataclasses import replace

from echostep.errors import EchostepError
from echostep.localization import Estimate
from echostep.path import MeasuredSegment
from echostep.tracker import Tracker
from echostep_app.guidance.cue_list import CueList
from echostep_app.guidance.cues import Cue, CueKind, Guide
from echostep_app.plan.routing import Route, RoutePlace, Routes
from echostep_app.ports.teammate import Teammate, parse_teammate

# Assumed, not measured.
MOVED_M = 1.5  # of the other wearer: then a new way is looked for
AGAIN_S = 2.0  # shortest time between two searches for a way
PREFIX = "wearer:"


class GuidedRescue(CueList):
    """Guides the wearer of one tracker to the wearer `name`; the route begins when both places are known."""

    def __init__(self, tracker: Tracker, name: str) -> None:
        super().__init__()
        self.name = name
        self.bad = 0  # chunks that were not a place
        self._tracker = tracker
        self._routes = Routes(tracker.plan)
        self._target: Teammate | None = None
        self._end: Teammate | None = None  # where the present route leads
        self._guide: Guide | None = None
        self._searched_s = -math.inf
        self._why = ""  # there is no way
        tracker.watchers.append(self._watch)
        tracker.team_watchers.append(self._receive)

    @property
    def route(self) -> Route | None:
        """The present route."""
        return self._guide.route if self._guide else None

    def _receive(self, payload: bytes) -> None:
        """Take a new place of the other wearer, unless it is on a level that the plan does not have."""
        teammate = parse_teammate(payload)
        if teammate is None or teammate.name != self.name or teammate.level >= len(self._tracker.plan.levels):
            self.bad += 1
            return
        self._target = teammate

    def _watch(self, _: MeasuredSegment | None, e: Estimate) -> None:
        """Add the cue of a new estimate."""
        announcement = self._find_route(e)
        if self._guide is None or self._target is None:
            text = self._why or f"Stop. The place of {self.name} is not known yet"
            self.cues.append(Cue(e.t_s, CueKind.STOP, text, None, f"{text}." if self._is_new(text) else ""))
            return
        cue = self._guide.cue(e, self._tracker.state.beacon_heard_s)
        if cue.kind is CueKind.ARRIVED:
            within = f": within {self._target.radius_m:.0f} m of you" if self._target.radius_m >= 1.0 else ""
            cue = replace(
                cue, text=f"{self.name} is here{within}", spoken=cue.spoken and f"{self.name} is here{within}."
            )
        elif announcement:
            cue = replace(cue, spoken=f"{announcement} {cue.spoken}".strip())
        self.cues.append(cue)

    def _is_new(self, text: str) -> bool:
        return not self.cues or self.cues[-1].text != text

    def _find_route(self, e: Estimate) -> str:
        """Find a new way when the other wearer has moved; returns the sentence to speak about it."""
        target, end = self._target, self._end
        if target is None or e.t_s - self._searched_s < AGAIN_S:
            return ""
        if (
            end is not None
            and end.level == target.level
            and math.hypot(end.x_m - target.x_m, end.y_m - target.y_m) < MOVED_M
        ):
            return ""
        self._searched_s = e.t_s
        try:
            here, there = RoutePlace(e.x_m, e.y_m, e.level), RoutePlace(target.x_m, target.y_m, target.level)
            route = self._routes.way(here, there)
        except EchostepError as error:
            self._why = f"Stop. No way leads to {self.name}: {error}"
            return ""
        if not route.stretches:
            return ""
        first, self._end, self._why = end is None, target, ""
        self._guide = Guide(route, planner=self._routes)
        return (
            f"{self.name} is {target.words}." if first and target.words else "" if first else f"{self.name} has moved."
        )


def rescued_wearer(to: str) -> str | None:
    """The name in `wearer:NAME`; None for another destination."""
    return to[len(PREFIX) :] if to.startswith(PREFIX) else None
