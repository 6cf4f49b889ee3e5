"""Guidance: what a page shows of a cue, and the way to a destination of its own.

In: cues with their way; for a page's own destination estimates, a place, the plan. Out: `Guidance`. Owns the plan's routes (made when first asked
for, in a thread) and how far along its own way the wearer has come. Until that way is found, and where there is none, it is the straight line.
"""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass, replace

import numpy as np

from echostep.guidance.cues import NO_HEADING, Cue, CueKind, GuidanceSettings, Guide
from echostep.localization.estimate import Estimate
from echostep.plan.model import Plan
from echostep.plan.polyline import along, way_m
from echostep.plan.routing import Route, RoutePlace, Routes

ARRIVED_M = 1.0
AGAIN_S = 5.0  # a new way is looked for no sooner, in data time
UNKNOWN_RAD = math.radians(GuidanceSettings().heading_sd_deg)
ON_THE_WAY = (CueKind.AHEAD, CueKind.TURN, CueKind.CHANGE, CueKind.OFF)
NO_WAY = "No way was found. The arrow shows the straight line."
STRAIGHT = "straight"  # the kind of a guidance that knows no way


@dataclass(frozen=True, slots=True)
class Guidance:
    """What to do, in words; `arrow_rad`: where to walk, from where he looks, counter-clockwise; `path`: what is left of the way on his
    level, as points.

    `kind` is a `CueKind` or `STRAIGHT`, `left_m` the way that is left, None where that helps nobody. `spoken` is the last sentence and `spoken_s`
    when it was said. `own`: the page's own destination, not the run's.
    """

    kind: str
    text: str
    arrow_rad: float | None
    left_m: float | None
    path: tuple[tuple[float, float], ...]
    spoken: str = ""
    spoken_s: float = 0.0
    own: bool = False

    def turned(self, by_rad: float) -> Guidance:
        """The same for somebody who has turned to the left since."""
        return self if self.arrow_rad is None else replace(self, arrow_rad=self.arrow_rad - by_rad)

    def stopped(self, why: str, t_s: float) -> Guidance:
        """Nothing is known any more: no arrow; the way stays to be seen."""
        text = f"Stop. {why}"
        return replace(
            self, kind=CueKind.STOP.value, text=text, arrow_rad=None, left_m=None, spoken=f"{text}.", spoken_s=t_s
        )


def guidance(cue: Cue, route: Route | None, level: int, before: Guidance | None) -> Guidance:
    """A cue as it is shown on a level; `before`: what was shown until now, whose sentence stands as long as there is no new one."""
    said = (cue.spoken, cue.t_s) if cue.spoken else (before.spoken, before.spoken_s) if before else ("", cue.t_s)
    path = () if route is None or math.isnan(cue.left_m) else rest(route, level, cue.left_m)
    left_m = cue.left_m if cue.kind in ON_THE_WAY else None
    return Guidance(cue.kind.value, cue.text, cue.aim_rad, left_m, path, *said)


def rest(route: Route, level: int, left_m: float) -> tuple[tuple[float, float], ...]:
    """The last `left_m` of a way, what of it is on a level, as points."""
    points: list[tuple[float, float]] = []
    for stretch in reversed(route.stretches):
        if left_m <= 0.0:
            break
        line, length_m = stretch.line_m, way_m(stretch.line_m)
        if stretch.level == level:
            if left_m < length_m:
                x, y, _ = along(line, length_m - left_m)
                come_m = np.r_[0.0, np.cumsum(np.hypot(*np.diff(line, axis=0).T))]
                line = np.vstack([(x, y), line[come_m > length_m - left_m]])
            points[:0] = [(x, y) for x, y in line.tolist()]
        left_m -= length_m
    return tuple(points)


class Ways:
    """Finds ways through a plan; slow, so it is called in threads."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._routes: Routes | None = None
        self._lock = threading.Lock()

    def way(self, told: Estimate, goal: RoutePlace) -> Route:
        """The way from an estimate to a place; raises EchostepError when there is none."""
        with self._lock:
            self._routes = self._routes or Routes(self._plan)
            return self._routes.way(RoutePlace(told.x_m, told.y_m, told.level), goal)


class Errand:
    """One destination of one page: tell it estimates, and the way once it is found."""

    def __init__(self, goal: RoutePlace) -> None:
        self.goal = goal
        self.looking = False
        self._guide: Guide | None = None
        self._why = ""
        self._again_s = -math.inf
        self._last: tuple[Estimate, Guidance] | None = None

    def lacks_way(self, told: Estimate) -> bool:
        """Whether a way should be looked for now."""
        return not self.looking and told.t_s >= self._again_s

    def found(self, route: Route | None, why: str, told: Estimate) -> None:
        """The way from an estimate; or None and why there is none: then it is looked for again later."""
        self.looking = False
        self._guide = Guide(route) if route is not None and route.stretches else None
        self._why, self._last = why, None
        self._again_s = math.inf if self._guide else told.t_s + AGAIN_S

    def guidance(self, told: Estimate) -> Guidance:
        """What to do at an estimate."""
        if self._last is None or self._last[0] is not told:
            self._last = (
                told,
                replace(self._along(told) if self._guide else straight(told, self.goal, self._why), own=True),
            )
        return self._last[1]

    def _along(self, told: Estimate) -> Guidance:
        assert self._guide
        cue = self._guide.cue(told)
        if cue.kind is CueKind.OFF and self._again_s == math.inf:
            self._again_s = told.t_s
        return guidance(cue, self._guide.route, told.level, self._last[1] if self._last else None)


def straight(told: Estimate, goal: RoutePlace, why: str = "") -> Guidance:
    """The straight line to a place, and why it is no better way."""
    dx, dy, levels = goal.x_m - told.x_m, goal.y_m - told.y_m, goal.level - told.level
    distance_m = math.hypot(dx, dy)
    path = ((told.x_m, told.y_m), (goal.x_m, goal.y_m))
    if distance_m <= ARRIVED_M and not levels:
        return Guidance(CueKind.ARRIVED.value, "You have arrived", None, None, path, "You have arrived.")
    climb = f", {abs(levels)} level{'s' if abs(levels) > 1 else ''} {'up' if levels > 0 else 'down'}" if levels else ""
    if told.heading_sd_rad > UNKNOWN_RAD:
        return Guidance(CueKind.STOP.value, NO_HEADING, None, None, path, f"{NO_HEADING}.")
    arrow = math.remainder(math.atan2(dy, dx) - told.heading_rad, 2.0 * math.pi)
    text = f"In a straight line{climb}{': ' if why else ''}{why}"
    return Guidance(STRAIGHT, text, arrow, distance_m, path, NO_WAY if why else "")
