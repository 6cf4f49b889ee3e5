# SPDX-License-Identifier: MIT
"""A guided return without a plan: back to the start along the way that was walked.

In: estimates of a tracker, when it publishes them. Out: a `Cue` for each. Owns the way that was walked, and the guide of a return.

Inbound, the length of the way back is shown, and nothing is spoken. The return begins when the wearer has come back by TURN_M, and ends at the
start, or when the way back has grown by TURN_M again. Both are spoken.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from echostep.angles import wrap
from echostep.arrays import Floats
from echostep.localization import Estimate, TrackStatus
from echostep.path import MeasuredSegment, Odometer
from echostep.tracker import Tracker
from echostep_app.guidance.cue_list import CueList
from echostep_app.guidance.cues import Cue, CueKind, Guide
from echostep_app.guidance.own_way import OwnWay
from echostep_app.plan.polyline import nearest, turn_ahead, way_m
from echostep_app.plan.routing import Route, RoutePlace, Stretch

# Of the way, after which a return has begun or is over: more than the steps of a search in one room
TURN_M = 6.0
AHEAD_M = 3.0  # of the arrow's target along the way back, as in `GuidanceSettings`
OFF_M = 2.0  # distance from the way, beyond the 95 % radius, that is off it: the width of a corridor
BESIDE_M = 3.0  # greatest 95 % radius of the way back beside the way in: a corridor and a half
IN, AGAIN = "The way back", "You are going in again"


class GuidedReturn(CueList):
    """Guides the wearer of one tracker back to where the walk began."""

    def __init__(self, tracker: Tracker) -> None:
        super().__init__()
        self._tracker = tracker
        self._way = OwnWay()
        self._line = self._way.line_m()  # the way back from the far end of the way in
        self._since_end = Odometer()
        self._least_m = math.inf  # least length of the way back since the return began
        self._guide: Guide | None = None  # of the return; None on the way in
        self.is_wanted = False  # the wearer asks for the way back, wherever the walk has turned
        tracker.watchers.append(self._watch)

    @property
    def route(self) -> Route | None:
        """The way back."""
        return self._guide.route if self._guide else _route(self._way.line_m())

    def way(self, start: RoutePlace) -> Route:
        """The way back from a position off the way."""
        begin, line = np.array([[start.x_m, start.y_m]]), self._way.line_m()
        return Route((Stretch(0, np.concatenate([begin, line])),))

    def _watch(self, measured: MeasuredSegment | None, e: Estimate) -> None:
        """Add the cue of a new estimate; one that was not measured is not on the way."""
        if measured is not None:
            e = _on_track(e)
        self.cues.append(self._cue_in(e) if self._guide is None else self._cue_back(e, self._guide))

    def _cue_in(self, e: Estimate) -> Cue:
        """The cue on the way in: direction and length of the way back; the return's cue when it begins here."""
        if e.claims_place:
            self._since_end.add(self._way.add(e.x_m, e.y_m, e.z_m))
            if self.is_wanted:
                return self._begin(e)
            progress_m, off_m = _nearest(self._line, e)
            if progress_m > TURN_M and off_m < _limit_m(e):
                self._way.go_back_to(way_m(self._line) - progress_m)
                return self._begin(e)
            is_ahead = progress_m == 0.0 and off_m > 0.5 * _limit_m(e)
            if is_ahead or off_m > _limit_m(e) or self._since_end.path_m > progress_m + TURN_M:
                self._set_end()
        return self._in(e)

    def _begin(self, e: Estimate) -> Cue:
        """Begin the return; its first cue."""
        self._least_m = self._way.back_m
        self._guide = Guide(self.way(RoutePlace(e.x_m, e.y_m)), again=self.way)
        return self._guide.cue(e, self._tracker.state.beacon_heard_s)

    def _cue_back(self, e: Estimate, guide: Guide) -> Cue:
        """The cue on the return, or on its end when the way back has grown."""
        if e.claims_place:
            line = self._way.line_m()
            progress_m, off_m = _nearest(line, e)
            if off_m < _limit_m(e):
                self._way.go_back_to(way_m(line) - progress_m)
            else:
                self._way.add(e.x_m, e.y_m, e.z_m)
            self._least_m = min(self._least_m, self._way.back_m)
            if self._way.back_m > self._least_m + TURN_M:
                self._end()
                return self._in(e, f"{AGAIN}.")
        cue = guide.cue(e, self._tracker.state.beacon_heard_s)
        if cue.kind is CueKind.ARRIVED:
            self._end()
        return cue

    def _end(self) -> None:
        self._guide = None
        self._set_end()

    def _set_end(self) -> None:
        """The present position is the far end of the way in."""
        self._line, self._since_end = self._way.line_m(), Odometer()

    def _in(self, e: Estimate, spoken: str = "") -> Cue:
        """The cue while going in: direction and length of the way back, from the place on it that is nearest."""
        if len(self._line) < 2:
            return Cue(e.t_s, CueKind.AHEAD, IN, None, spoken, self._way.back_m)
        progress_m, off_m = _nearest(self._line, e)
        arrow = wrap(turn_ahead(self._line, progress_m + AHEAD_M, e.x_m, e.y_m, e.heading_rad))
        return Cue(e.t_s, CueKind.AHEAD, IN, arrow, spoken, off_m + way_m(self._line) - progress_m, arrow)


def _on_track(e: Estimate) -> Estimate:
    """An estimate relative to the track: the drift since the start moves the way back as well, so it is not an error here.

    The covariance is kept up to the distance at which two passages of one way may lie apart.
    """
    shrink = min(BESIDE_M / e.ellipse95.major_m, 1.0) ** 2 if e.ellipse95.major_m > 0.0 else 1.0
    xx, xy, yy = (shrink * value for value in (e.xx_m2, e.xy_m2, e.yy_m2))
    return replace(e, status=TrackStatus.TRACKING, heading_sd_rad=0.0, xx_m2=xx, xy_m2=xy, yy_m2=yy)


def _nearest(line_m: Floats, e: Estimate) -> tuple[float, float]:
    """Length along the way back up to the place nearest to an estimate, and its distance (m)."""
    return nearest(line_m, e.x_m, e.y_m, 0.0, 2.0 * TURN_M) if len(line_m) > 1 else (0.0, math.inf)


def _limit_m(e: Estimate) -> float:
    """Distance from the way up to which an estimate is on it."""
    return OFF_M + e.ellipse95.major_m


def _route(line_m: Floats) -> Route | None:
    return Route((Stretch(0, line_m),)) if len(line_m) > 1 else None
