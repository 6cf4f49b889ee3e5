"""Guidance for a person: where to go next, one cue at a time, in words, as an arrow, and as a sentence to speak.

In: a way (a `Route`, or a trail of crumbs), estimates, and when a beacon was last heard. Out: `Cue`s. Owns how far he has come along the way, the
arrow's present direction, and the last place that was sure. What the estimate cannot carry is not guided: the cue is then "stop", or the way back
to that place.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from echostep.errors import EchostepError
from echostep.localization.estimate import Estimate, TrackStatus
from echostep.plan.polyline import along, nearest, way_m
from echostep.plan.routing import Route, RoutePlace, Stretch


class CueKind(StrEnum):
    """What a cue is about, in order of urgency."""

    STOP = "stop"  # nobody knows where he looks
    RETURN = "return"  # to the last known place
    OFF = "off"  # he has left the way
    ARRIVED = "arrived"
    CHANGE = "change"  # of level: stairs, lift, ramp
    TURN = "turn"
    AHEAD = "ahead"


NO_HEADING = "Stop. Your direction is not known: turn once around, slowly"


@dataclass(frozen=True, slots=True)
class Cue:
    """What a person is told now. `arrow_rad`: where to walk, from where he looks, counter-clockwise; None: no arrow is shown.

    `spoken` is empty when there is nothing new to say. `left_m`: way that is left. `aim_rad`: where the arrow is turning to, for who draws
    it more often than estimates come, and turns it smoothly himself.
    """

    t_s: float
    kind: CueKind
    text: str
    arrow_rad: float | None
    spoken: str = ""
    left_m: float = math.nan
    aim_rad: float | None = None


@dataclass(frozen=True, slots=True)
class GuidanceSettings:
    """`ahead_m`: the target along the way [Fischer 2008, 4.2]. `off_m`: from the way, beyond what the estimate allows, until he has left it.

    `deaf_s`, `return_s`: without any beacon until he is warned and sent back; twice as long when that has brought
    him back once, for the next beacons may be dead, until he has been heard for `safe_s`. `heading_sd_deg`: beyond it nobody knows where he looks.
    `arrow_s`: time constant of the arrow, `arrow_deg_s` its greatest speed. `say_again_s`: a sentence is repeated no sooner.
    """

    ahead_m: float = 3.0
    arrived_m: float = 1.0
    off_m: float = 2.0
    deaf_s: float = 3.0
    return_s: float = 6.0
    safe_s: float = 15.0
    heading_sd_deg: float = 45.0
    turn_deg: float = 30.0
    arrow_s: float = 0.5
    arrow_deg_s: float = 180.0
    say_again_s: float = 8.0


class _Planner(Protocol):
    def way(self, start: RoutePlace, end: RoutePlace) -> Route: ...


class Guide:
    """Follows one person along one way.

    With a planner, who leaves the way gets a new one from where he is; without, the arrow leads back to it.
    """

    def __init__(self, route: Route, settings: GuidanceSettings | None = None, planner: _Planner | None = None) -> None:
        """Raises EchostepError for a way without length."""
        if not route.stretches:
            raise EchostepError("a way needs at least one stretch")
        self.route = route
        self._settings = settings or GuidanceSettings()
        self._planner = planner
        self._stretch = 0
        self._come_m = 0.0
        self._arrow: float | None = None
        self._arrow_s = -math.inf
        self._sure: RoutePlace | None = None
        self._leash_s = self._settings.return_s
        self._sent_back = False
        self._heard_since_s = -math.inf
        self._said = ""
        self._said_s = -math.inf
        self.replanned = 0

    def cue(self, e: Estimate, heard_s: float | None = None) -> Cue:
        """What to tell him at this estimate; `heard_s`: when a beacon last heard him, None where there are none."""
        silent_s = 0.0 if heard_s is None else e.t_s - heard_s
        self._lengthen(e.t_s, silent_s)
        if e.status is not TrackStatus.LOST and silent_s < self._settings.deaf_s:
            self._sure = RoutePlace(e.x_m, e.y_m, e.level)
        if e.heading_sd_rad > math.radians(self._settings.heading_sd_deg):
            return self._told(e, CueKind.STOP, NO_HEADING, None)
        if e.status is TrackStatus.LOST or silent_s >= self._leash_s:
            return self._back(e, silent_s)
        self._find(e)
        cue = self._along(e)
        if silent_s >= self._settings.deaf_s and cue.kind is not CueKind.ARRIVED:
            return self._told(e, CueKind.OFF, "You leave the beacons' range", cue.arrow_rad)
        return cue

    def _lengthen(self, t_s: float, silent_s: float) -> None:
        """How long he may be out of range before he is sent back: who has come back from silence may go on further into it."""
        if silent_s >= self._settings.deaf_s:
            self._heard_since_s = math.inf
            self._sent_back = self._sent_back or silent_s >= self._leash_s
            return
        self._heard_since_s = min(self._heard_since_s, t_s)
        if self._sent_back:
            self._leash_s, self._sent_back = 2.0 * self._leash_s, False
        elif t_s - self._heard_since_s > self._settings.safe_s:
            self._leash_s = self._settings.return_s

    @property
    def left_m(self) -> float:
        """Way that is left, on all levels."""
        rest = self.route.stretches[self._stretch + 1 :]
        return way_m(self._here.line_m) - self._come_m + sum(way_m(s.line_m) for s in rest)

    @property
    def _here(self) -> Stretch:
        return self.route.stretches[self._stretch]

    def _find(self, e: Estimate) -> None:
        """The stretch of his level, and how far along it he is: from where he was, not jumping to where the way comes by again."""
        if self._here.level != e.level:
            levels = [s.level for s in self.route.stretches]
            later = [k for k in range(len(levels)) if levels[k] == e.level]
            if later:
                self._stretch = min(later, key=lambda k: (k < self._stretch, abs(k - self._stretch)))
                self._come_m = 0.0
        reach = 2.0 * self._settings.ahead_m
        come, off = nearest(self._here.line_m, e.x_m, e.y_m, self._come_m - reach, self._come_m + reach)
        if off > self._settings.off_m:
            come, off = nearest(self._here.line_m, e.x_m, e.y_m, 0.0, math.inf)
        self._come_m = come

    def _along(self, e: Estimate) -> Cue:
        s, line = self._settings, self._here.line_m
        x, y, _ = along(line, self._come_m)
        off = math.hypot(x - e.x_m, y - e.y_m)
        if self._here.level != e.level or off > s.off_m + e.ellipse95.major_m:
            return self._off(e, off)
        if self.left_m < s.arrived_m or (
            self._last and math.hypot(e.x_m - line[-1, 0], e.y_m - line[-1, 1]) < s.arrived_m
        ):
            return self._told(e, CueKind.ARRIVED, "You have arrived", None)
        to_x, to_y, _ = along(line, self._come_m + s.ahead_m)
        arrow = math.atan2(to_y - e.y_m, to_x - e.x_m) - e.heading_rad
        rest = way_m(line) - self._come_m
        if not self._last and rest < s.ahead_m:
            after = self.route.stretches[self._stretch + 1].level
            step = "up" if after > e.level else "down"
            return self._told(e, CueKind.CHANGE, f"Take the {self._here.by} {step}", arrow)
        side = _wrap(arrow)
        if abs(side) > math.radians(135.0):
            return self._told(e, CueKind.TURN, "Turn around", arrow)
        if abs(side) > math.radians(s.turn_deg):
            return self._told(e, CueKind.TURN, "Turn left" if side > 0.0 else "Turn right", arrow)
        return self._told(e, CueKind.AHEAD, "Straight ahead", arrow)

    @property
    def _last(self) -> bool:
        return self._stretch == len(self.route.stretches) - 1

    def _off(self, e: Estimate, off_m: float) -> Cue:
        """He has left the way: a new one if there is a plan, else back to it."""
        if self._planner is not None:
            end = self.route.stretches[-1]
            goal = RoutePlace(float(end.line_m[-1, 0]), float(end.line_m[-1, 1]), end.level)
            try:
                self.route = self._planner.way(RoutePlace(e.x_m, e.y_m, e.level), goal)
            except EchostepError:
                return self._told(e, CueKind.STOP, "Stop. No way leads on from here", None)
            self._stretch, self._come_m = 0, 0.0
            self.replanned += 1
            x, y, _ = along(self._here.line_m, self._settings.ahead_m)
            return self._told(
                e, CueKind.OFF, "You left the way. Here is another", math.atan2(y - e.y_m, x - e.x_m) - e.heading_rad
            )
        if self._here.level != e.level:
            return self._told(e, CueKind.STOP, "Stop. You are on the wrong level", None)
        x, y, _ = along(self._here.line_m, self._come_m + 1.0)
        arrow = math.atan2(y - e.y_m, x - e.x_m) - e.heading_rad
        return self._told(e, CueKind.OFF, f"You left the way: it is {off_m:.0f} metres off", arrow)

    def _back(self, e: Estimate, silent_s: float) -> Cue:
        """Nobody knows well enough where he is: back to the last known place, as long as his steps tell the direction."""
        why = "No beacon hears you" if silent_s >= self._leash_s else "Your place is not known"
        if self._sure is None or self._sure.level != e.level:
            return self._told(e, CueKind.STOP, f"Stop. {why}", None)
        dx, dy = self._sure.x_m - e.x_m, self._sure.y_m - e.y_m
        if math.hypot(dx, dy) < self._settings.arrived_m:
            return self._told(e, CueKind.STOP, f"Stop. {why}, and this is the last known place", None)
        return self._told(
            e, CueKind.RETURN, f"{why}. Go back to the last known place", math.atan2(dy, dx) - e.heading_rad
        )

    def _told(self, e: Estimate, kind: CueKind, text: str, arrow_rad: float | None) -> Cue:
        arrow = self._smooth(arrow_rad, e.t_s)
        new = text != self._said or e.t_s - self._said_s >= self._settings.say_again_s
        spoken = ""
        if new and not (kind is CueKind.AHEAD and text == self._said):
            spoken, self._said, self._said_s = text + ".", text, e.t_s
        aim = None if arrow_rad is None else _wrap(arrow_rad)
        return Cue(e.t_s, kind, text, arrow, spoken, self.left_m, aim)

    def _smooth(self, wanted: float | None, t_s: float) -> float | None:
        """The arrow follows with a time constant and a greatest speed; after it was hidden it starts where it should be."""
        s = self._settings
        if wanted is None:
            self._arrow = None
            return None
        span_s = t_s - self._arrow_s
        self._arrow_s = t_s
        if self._arrow is None or not 0.0 <= span_s < 5.0:
            self._arrow = _wrap(wanted)
            return self._arrow
        off = _wrap(wanted - self._arrow)
        turn = off * (1.0 - math.exp(-span_s / s.arrow_s))
        most = math.radians(s.arrow_deg_s) * span_s
        self._arrow = _wrap(self._arrow + min(max(turn, -most), most))
        return self._arrow


ARROWS = "↑↖←↙↓↘→↗"


def arrow_sign(arrow_rad: float | None) -> str:
    """The nearest of eight arrows, up for straight ahead; a circle for none."""
    return "○" if arrow_rad is None else ARROWS[round(arrow_rad / (math.pi / 4.0)) % 8]


def describe_cue(cue: Cue) -> str:
    """A cue on one line."""
    left = "" if math.isnan(cue.left_m) else f"   {cue.left_m:.0f} m to go"
    return f"{arrow_sign(cue.arrow_rad)}  {cue.text}{left}"


def _wrap(angle: float) -> float:
    return math.remainder(angle, 2.0 * math.pi)
