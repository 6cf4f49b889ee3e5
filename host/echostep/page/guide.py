"""Guidance: which way to a destination.

In: estimates, a place, the plan. Out: `Guidance` for one page. Owns the plan's routes (made when first asked for, in a thread) and how far along
the way the wearer has come. Until the way is found, and where there is none, it is the straight line.
"""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass

from echostep.estimate import Estimate
from echostep.guidance import CueKind, Guide
from echostep.plan import Plan
from echostep.routes import Place, Route, Routes

ARRIVED_M = 1.0
AGAIN_S = 5.0  # a new way is looked for no sooner, in data time


@dataclass(frozen=True, slots=True)
class Guidance:
    """What to do, in words; `arrow_rad` is the direction to go now in the map, `path` the way on this level as points."""

    text: str
    arrow_rad: float | None
    distance_m: float
    path: tuple[tuple[float, float], ...]


class Ways:
    """Finds ways through a plan; slow, so it is called in threads."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._routes: Routes | None = None
        self._lock = threading.Lock()

    def way(self, told: Estimate, goal: Place) -> Route:
        """The way from an estimate to a place; raises EchostepError when there is none."""
        with self._lock:
            self._routes = self._routes or Routes(self._plan)
            return self._routes.way(Place(told.x_m, told.y_m, told.level), goal)


class Errand:
    """One destination of one page: tell it estimates, and the way once it is found."""

    def __init__(self, goal: Place) -> None:
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
            self._last = told, self._along(told) if self._guide else straight(told, self.goal, self._why)
        return self._last[1]

    def _along(self, told: Estimate) -> Guidance:
        assert self._guide
        cue = self._guide.cue(told)
        if cue.kind is CueKind.OFF and self._again_s == math.inf:
            self._again_s = told.t_s
        lines = [stretch.line_m for stretch in self._guide.route.stretches if stretch.level == told.level]
        path = tuple((float(x), float(y)) for line in lines for x, y in line)
        arrow = None if cue.arrow_rad is None else cue.arrow_rad + told.heading_rad
        left = "" if cue.kind is CueKind.ARRIVED else f", {cue.left_m:.0f} m to go"
        return Guidance(f"{cue.text}{left}", arrow, cue.left_m, path)


def straight(told: Estimate, goal: Place, why: str = "") -> Guidance:
    """The straight line to a place, and why it is no better way."""
    dx, dy, levels = goal.x_m - told.x_m, goal.y_m - told.y_m, goal.level - told.level
    distance_m = math.hypot(dx, dy)
    path = ((told.x_m, told.y_m), (goal.x_m, goal.y_m))
    if distance_m <= ARRIVED_M and not levels:
        return Guidance("You have arrived", None, distance_m, path)
    climb = f", {abs(levels)} level{'s' if abs(levels) > 1 else ''} {'up' if levels > 0 else 'down'}" if levels else ""
    text = f"{distance_m:.0f} m in a straight line{climb}"
    return Guidance(f"{text} ({why})" if why else text, math.atan2(dy, dx), distance_m, path)
