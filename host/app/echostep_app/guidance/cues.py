# SPDX-License-Identifier: MIT
"""Cues for a wearer on a route: where to go next, as words, as an arrow, and as a sentence to speak.

In: a `Route`, estimates, and when a beacon was last received. Out: `Cue`s. Owns the progress along the route, and the `Contact`: the last
known place, and when to go back to it. With an uncertain heading there is no direction: the cue is then "stop".
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from echostep.elementary import wrap
from echostep.errors import EchostepError
from echostep.localization import Estimate
from echostep_app.guidance.contact import CONTACT, allowed_silence, start_contact, update_contact
from echostep_app.plan.polyline import along, nearest, turn_ahead, way_m
from echostep_app.plan.routing import Route, RoutePlace, Stretch


class CueKind(StrEnum):
    """Kinds of cues, in order of urgency."""

    STOP = "stop"  # position, heading or route is not known
    RETURN = "return"  # to the last known place
    OFF = "off"  # off the route
    ARRIVED = "arrived"
    CHANGE = "change"  # of level: stairs, lift, ramp
    TURN = "turn"
    AHEAD = "ahead"


Finder = Callable[[RoutePlace], Route]
Choice = tuple[CueKind, str, float | None]  # kind, words, direction from straight ahead (rad)
NO_HEADING = "Stop. Your direction is not known: turn once around, slowly"
NEVER_KNOWN = "Your place is not known yet: walk slowly along the walls"
AHEAD_M = 3.0  # of the arrow's target along the route [Fischer 2008, 4.2]
# Assumed:
ARRIVED_M = 1.0  # from the end: the wearer has arrived
OFF_M = 2.0  # distance from the route, beyond the 95 % radius, that is off it: the width of a corridor
SILENCE_S = 3.0  # without beacon contact before the wearer is sent back
HEADING_SD_RAD = math.radians(45.0)  # greatest standard deviation of a usable heading
TURN_RAD = math.radians(30.0)  # least angle of a cue to turn
AROUND_RAD = math.radians(135.0)  # direction beyond which the target is behind
SAY_AGAIN_S = 8.0  # least time before a sentence is repeated
RETURN_AHEAD_M = 1.0  # target of the arrow back to the route, along the route from the nearest place
ARROWS = "↑↖←↙↓↘→↗"


@dataclass(frozen=True, slots=True)
class Cue:
    """One cue. `arrow_rad`: direction to walk relative to the wearer's heading, counter-clockwise; None: no arrow is shown.

    `spoken` is empty when there is nothing new to say. `left_m`: length of the route ahead.
    """

    t_s: float
    kind: CueKind
    text: str
    arrow_rad: float | None
    spoken: str = ""
    left_m: float = math.nan


class Guide:
    """Guides one wearer along one route.

    With `again`, a wearer off the route gets a new one from the present place; without, the arrow leads back to the route.
    """

    def __init__(self, route: Route, again: Finder | None = None, arrived: str = "You have arrived") -> None:
        """`again`: finds a route from a position off it. Raises EchostepError for a route without stretches."""
        if not route.stretches:
            raise EchostepError("a route needs at least one stretch")
        self.route = route
        self.arrived = arrived
        self._again = again
        self._stretch = 0
        self._progress_m = 0.0
        self._contact = np.zeros(1, CONTACT)[0]
        self._was_lost = False
        self._known_level: int | None = None  # of the last known place; None before the first
        self._last_text = ""
        self._spoken_s = -math.inf

    def cue(self, e: Estimate, heard_s: float | None = None) -> Cue:
        """The cue at this estimate; `heard_s`: when a beacon last measured, None without beacons."""
        return self._make_cue(e, *self._choose(e, heard_s))

    def _choose(self, e: Estimate, heard_s: float | None) -> Choice:
        """What to do at this estimate. A reached end counts, whether beacons measure there or not."""
        lost = not e.claims_place
        back, silent = self._update_contact(e, heard_s, lost)
        if e.heading_sd_rad > HEADING_SD_RAD:
            return CueKind.STOP, NO_HEADING, None
        if self._known_level is None:
            return CueKind.STOP, NEVER_KNOWN, None
        self._update_progress(e)
        if not lost and self._has_arrived(e):
            return CueKind.ARRIVED, self.arrived, None
        why = "Your place is not known" if lost else "No beacon hears you"
        if back and self._known_level == e.level:
            x, y = self._contact["known_x"], self._contact["known_y"]
            arrow = math.atan2(y - e.y_m, x - e.x_m) - e.heading_rad
            return CueKind.RETURN, f"{why}. Go back to the last known place", arrow
        kind, text, ahead = self._choose_along(e)
        if (lost or silent) and kind not in (CueKind.STOP, CueKind.ARRIVED):
            return CueKind.OFF, f"{why}. Go on", ahead
        return kind, text, ahead

    def _update_contact(self, e: Estimate, heard_s: float | None, lost: bool) -> tuple[bool, bool]:
        """Update the contact; whether the wearer is to go back, and whether no beacon measures. An estimate that is not lost any more is known."""
        contact = self._contact
        known_s = e.t_s if heard_s is None or self._was_lost else heard_s
        if not lost and self._known_level is None:
            start_contact(contact, known_s, e.x_m, e.y_m)
        if not lost and (self._known_level is None or known_s > contact["known_s"]):
            self._known_level = e.level
        self._was_lost = lost
        back = update_contact(contact, e.t_s, known_s, e.x_m, e.y_m, lost, SILENCE_S)
        return back, bool(e.t_s - contact["known_s"] > allowed_silence(contact, SILENCE_S))

    @property
    def left_m(self) -> float:
        """Length of the route ahead, on all levels."""
        rest = self.route.stretches[self._stretch + 1 :]
        return way_m(self._here.line_m) - self._progress_m + sum(way_m(s.line_m) for s in rest)

    @property
    def _here(self) -> Stretch:
        """The stretch that the wearer is on."""
        return self.route.stretches[self._stretch]

    def _update_progress(self, e: Estimate) -> None:
        """Update the stretch, by level, and the progress along it.

        The nearest place is looked for near the last one first, so that progress does not jump where the route passes again.
        """
        if self._here.level != e.level:
            levels = [s.level for s in self.route.stretches]
            later = [k for k in range(len(levels)) if levels[k] == e.level]
            if later:
                self._stretch = min(later, key=lambda k: (k < self._stretch, abs(k - self._stretch)))
                self._progress_m = 0.0
        reach = 2.0 * AHEAD_M
        progress, off = nearest(self._here.line_m, e.x_m, e.y_m, self._progress_m - reach, self._progress_m + reach)
        if off > OFF_M:
            progress, off = nearest(self._here.line_m, e.x_m, e.y_m, 0.0, math.inf)
        self._progress_m = progress

    def _choose_along(self, e: Estimate) -> Choice:
        """What to do on the route: arrived, change of level, turn, or straight ahead."""
        line = self._here.line_m
        off_m = self._off_m(e)
        if off_m > OFF_M + e.ellipse95.major_m:
            return self._choose_off_route(e, off_m)
        if self._has_arrived(e):
            return CueKind.ARRIVED, self.arrived, None
        arrow = turn_ahead(line, self._progress_m + AHEAD_M, e.x_m, e.y_m, e.heading_rad)
        rest = way_m(line) - self._progress_m
        if not self._last and rest < AHEAD_M:
            after = self.route.stretches[self._stretch + 1].level
            step = "up" if after > e.level else "down"
            return CueKind.CHANGE, f"Take the {self._here.by} {step}", arrow
        side = wrap(arrow)
        if abs(side) > AROUND_RAD:
            return CueKind.TURN, "Turn around", arrow
        if abs(side) > TURN_RAD:
            return CueKind.TURN, "Turn left" if side > 0.0 else "Turn right", arrow
        return CueKind.AHEAD, "Straight ahead", arrow

    def _off_m(self, e: Estimate) -> float:
        """Distance (m) from the route; infinite on another level."""
        x, y, _ = along(self._here.line_m, self._progress_m)
        return math.hypot(x - e.x_m, y - e.y_m) if self._here.level == e.level else math.inf

    def _has_arrived(self, e: Estimate) -> bool:
        """Whether the end of the route is reached."""
        end = self._here.line_m[-1]
        if self._off_m(e) > OFF_M + e.ellipse95.major_m:
            return False
        return self.left_m < ARRIVED_M or (self._last and math.hypot(e.x_m - end[0], e.y_m - end[1]) < ARRIVED_M)

    @property
    def _last(self) -> bool:
        """Whether the present stretch is the last one."""
        return self._stretch == len(self.route.stretches) - 1

    def _choose_off_route(self, e: Estimate, off_m: float) -> Choice:
        """The cue off the route: another route where one is looked for, else the direction back to the route."""
        if self._again is not None:
            try:
                self.route = self._again(RoutePlace(e.x_m, e.y_m, e.level))
            except EchostepError:
                return CueKind.STOP, "Stop. No way leads on from here", None
            self._stretch, self._progress_m = 0, 0.0
            arrow = turn_ahead(self._here.line_m, AHEAD_M, e.x_m, e.y_m, e.heading_rad)
            return CueKind.OFF, "You left the way. Here is another", arrow
        if self._here.level != e.level:
            return CueKind.STOP, "Stop. You are on the wrong level", None
        arrow = turn_ahead(self._here.line_m, self._progress_m + RETURN_AHEAD_M, e.x_m, e.y_m, e.heading_rad)
        return CueKind.OFF, f"You left the way: it is {off_m:.0f} metres off", arrow

    def _make_cue(self, e: Estimate, kind: CueKind, text: str, arrow_rad: float | None) -> Cue:
        """A cue, with its sentence unless that was just spoken."""
        new = text != self._last_text or e.t_s - self._spoken_s >= SAY_AGAIN_S
        spoken = ""
        if new and not (kind is CueKind.AHEAD and text == self._last_text):
            spoken, self._last_text, self._spoken_s = text + ".", text, e.t_s
        arrow = None if arrow_rad is None else wrap(arrow_rad)
        return Cue(e.t_s, kind, text, arrow, spoken, self.left_m)


def arrow_sign(arrow_rad: float | None) -> str:
    """The nearest of eight arrows, up for straight ahead; a circle for none."""
    return "○" if arrow_rad is None else ARROWS[round(arrow_rad / (math.pi / 4.0)) % 8]


def describe_cue(cue: Cue) -> str:
    """A cue on one line."""
    left = "" if math.isnan(cue.left_m) else f"   {cue.left_m:.0f} m to go"
    return f"{arrow_sign(cue.arrow_rad)}  {cue.text}{left}"
