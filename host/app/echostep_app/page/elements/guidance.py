# SPDX-License-Identifier: MIT
"""Guidance as a page shows it: of the run's cues, or to a destination that was chosen on the page.

In: cues with their route; for a destination chosen on a page: estimates, the destination, routes to it. Out: `ShownGuidance`. Owns the progress along
a route to a chosen destination. Until that route is found, and if there is none, neither a direction nor a line is shown.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from echostep.localization import Estimate
from echostep_app.guidance.cues import Cue, CueKind, Guide
from echostep_app.guidance.guided_run import ARRIVED
from echostep_app.plan.polyline import along, way_m
from echostep_app.plan.routing import EXIT, Goal, Route, RoutePlace

SEARCH_INTERVAL_S = 5.0  # shortest time between two searches for a route, in data time
ON_THE_WAY = (CueKind.AHEAD, CueKind.TURN, CueKind.CHANGE, CueKind.OFF)
LOOKING, NO_ROUTE = "looking", "none"  # kinds of guidance without a route

Points = tuple[tuple[float, float], ...]  # (x, y) in map metres


@dataclass(frozen=True, slots=True)
class ShownGuidance:
    """The present instruction. The field names are keys of the frame's JSON.

    `kind`: a `CueKind`, `LOOKING` or `NO_ROUTE`. `arrow_rad`: direction to walk, counter-clockwise from the heading; None: no arrow is drawn.
    `left_m`: length of the remaining route; None where it does not help. `path`: the remaining route on the estimate's level. `spoken`: the last
    sentence; `spoken_s`: the time at which it was due. `own`: to a destination chosen on a page, not the run's.
    """

    kind: str
    text: str
    arrow_rad: float | None
    left_m: float | None
    path: Points
    spoken: str = ""
    spoken_s: float = 0.0
    own: bool = False

    def turned(self, by_rad: float) -> ShownGuidance:
        """The same guidance after the heading has turned by `by_rad` counter-clockwise."""
        return self if self.arrow_rad is None else replace(self, arrow_rad=self.arrow_rad - by_rad)

    def stopped(self, reason: str, t_s: float) -> ShownGuidance:
        """The guidance while the position is unknown: "Stop" and the reason, without an arrow; the path stays."""
        text = f"Stop. {reason}"
        return replace(
            self, kind=CueKind.STOP.value, text=text, arrow_rad=None, left_m=None, spoken=f"{text}.", spoken_s=t_s
        )


def guidance_of_cue(cue: Cue, route: Route | None, level: int, before: ShownGuidance | None) -> ShownGuidance:
    """A cue as it is shown on a level. `before`: the guidance shown until now; its sentence stays while the cue has no new one."""
    previous = (before.spoken, before.spoken_s) if before else ("", cue.t_s)
    spoken = (cue.spoken, cue.t_s) if cue.spoken else previous
    path = () if route is None or math.isnan(cue.left_m) else remaining_path(route, level, cue.left_m)
    left_m = cue.left_m if cue.kind in ON_THE_WAY else None
    return ShownGuidance(cue.kind.value, cue.text, cue.arrow_rad, left_m, path, *spoken)


def remaining_path(route: Route, level: int, left_m: float) -> Points:
    """The part of the last `left_m` metres of a route that lies on a level."""
    points: list[tuple[float, float]] = []
    for stretch in reversed(route.stretches):
        if left_m <= 0.0:
            break
        line, length_m = stretch.line_m, way_m(stretch.line_m)
        if stretch.level == level:
            if left_m < length_m:
                x, y, _ = along(line, length_m - left_m)
                corner_m = np.r_[0.0, np.cumsum(np.hypot(*np.diff(line, axis=0).T))]  # of each corner along the line
                line = np.vstack([(x, y), line[corner_m > length_m - left_m]])
            points[:0] = [(x, y) for x, y in line.tolist()]
        left_m -= length_m
    return tuple(points)


class Destination:
    """A destination chosen on a page: estimates and, once it is found, a route -> guidance."""

    def __init__(self, goal: Goal) -> None:
        self.goal = goal
        self.searching = False
        self._guide: Guide | None = None
        self._reason = ""  # why there is no route
        self._search_again_s = -math.inf
        self._last: tuple[Estimate, ShownGuidance] | None = None

    def needs_route(self, estimate: Estimate) -> bool:
        """Whether a search for a route should start now."""
        return not self.searching and estimate.t_s >= self._search_again_s

    def set_route(self, route: Route | None, reason: str, estimate: Estimate) -> None:
        """The result of a search from an estimate: a route, or None and the reason. Without a route it is repeated after `SEARCH_INTERVAL_S`."""
        self.searching = False
        self._guide = Guide(route, arrived=ARRIVED[self.goal == EXIT]) if route else None
        self._reason, self._last = reason, None
        self._search_again_s = math.inf if self._guide else estimate.t_s + SEARCH_INTERVAL_S

    def guidance_at(self, estimate: Estimate) -> ShownGuidance:
        """The guidance at an estimate; the same object while the estimate is the same."""
        if self._last is None or self._last[0] is not estimate:
            shown = self._along_route(estimate) if self._guide else without_route(self.goal, estimate, self._reason)
            self._last = estimate, replace(shown, own=True)
        return self._last[1]

    def _along_route(self, estimate: Estimate) -> ShownGuidance:
        """The next cue of the route; when the estimate has left the route, or its levels, a new search becomes due."""
        assert self._guide
        cue = self._guide.cue(estimate)
        if self.goal == EXIT and self._last is None:
            cue = replace(cue, spoken=f"Way out. {cue.spoken}")
        is_off = cue.kind is CueKind.OFF or estimate.level not in {s.level for s in self._guide.route.stretches}
        if is_off and self._search_again_s == math.inf:
            self._search_again_s = estimate.t_s
        return guidance_of_cue(cue, self._guide.route, estimate.level, self._last[1] if self._last else None)


def without_route(goal: Goal, estimate: Estimate, reason: str) -> ShownGuidance:
    """The guidance while no route is known: no direction and no line, which would lead through walls.

    `reason`: why there is none, empty while it is searched for.
    """
    levels = goal.level - estimate.level if isinstance(goal, RoutePlace) else 0
    climb = f", {abs(levels)} floor{'s' if abs(levels) > 1 else ''} {'up' if levels > 0 else 'down'}" if levels else ""
    if not reason:
        return ShownGuidance(LOOKING, f"Looking for a way{climb}", None, None, ())
    return ShownGuidance(NO_ROUTE, f"No way was found{climb}: {reason}", None, None, (), "No way was found.")
