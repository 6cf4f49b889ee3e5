# SPDX-License-Identifier: MIT
"""The way out without an exit in a plan: back to the start along the way that was walked.

In: estimates of a tracker, when it publishes them. Out: a `Cue` for each while the way back is wanted. Owns the way that was walked, and the guide.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from echostep.localization import Estimate, TrackStatus
from echostep.path import MeasuredSegment
from echostep.tracker import Tracker
from echostep_app.guidance.cue_list import CueList
from echostep_app.guidance.cues import OFF_M, Guide
from echostep_app.guidance.own_way import OwnWay
from echostep_app.plan.polyline import nearest, way_m
from echostep_app.plan.routing import Route, RoutePlace, Stretch

REACH_M = 12.0  # of the way back, on which the wearer is looked for: more than the steps of a search in one room
BESIDE_M = 3.0  # greatest 95 % radius of the way back beside the way in: a corridor and a half


class GuidedReturn(CueList):
    """Guides the wearer of one tracker back to where the walk began, while `is_wanted`."""

    def __init__(self, tracker: Tracker, *, is_wanted: bool = True) -> None:
        super().__init__()
        self.is_wanted = is_wanted
        self._tracker = tracker
        self._way = OwnWay()
        tracker.watchers.append(self._watch)

    def _way_from(self, start: RoutePlace) -> Route:
        """The way back from a position."""
        return Route((Stretch(0, np.concatenate([[[start.x_m, start.y_m]], self._way.line_m()])),))

    def _watch(self, measured: MeasuredSegment | None, e: Estimate) -> None:
        """Add the cue of a new estimate; one that was not measured is not on the way."""
        if measured is not None:
            e = _on_track(e)
        if e.claims_place:
            self._walk(e)
        if not self.is_wanted:
            self._guide = None
            self.cues.clear()
            return
        self._guide = self._guide or Guide(self._way_from(RoutePlace(e.x_m, e.y_m)), self._way_from)
        self.cues.append(self._guide.cue(e, self._tracker.state.beacon_heard_s))

    def _walk(self, e: Estimate) -> None:
        """Go back along the way, or extend it to an estimate that is not on it."""
        line = self._way.line_m()
        progress_m, off_m = nearest(line, e.x_m, e.y_m, 0.0, REACH_M) if len(line) > 1 else (0.0, np.inf)
        if self.is_wanted and off_m < OFF_M + e.ellipse95.major_m:
            self._way.go_back_to(way_m(line) - progress_m)
        else:
            self._way.add(e.x_m, e.y_m, e.z_m)


def _on_track(e: Estimate) -> Estimate:
    """An estimate relative to the track: the drift since the start moves the way back as well, so it is not an error here.

    The covariance is kept up to the distance at which two passages of one way may lie apart.
    """
    shrink = min(BESIDE_M / e.ellipse95.major_m, 1.0) ** 2 if e.ellipse95.major_m > 0.0 else 1.0
    xx, xy, yy = (shrink * value for value in (e.xx_m2, e.xy_m2, e.yy_m2))
    return replace(e, status=TrackStatus.TRACKING, heading_sd_rad=0.0, xx_m2=xx, xy_m2=xy, yy_m2=yy, level=0)
