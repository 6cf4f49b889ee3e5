# SPDX-License-Identifier: MIT
"""The way out without an exit in a plan: back to the start along the way that was walked.

In: estimates of a tracker, when it publishes them. Out: a `Cue` for each while the way back is wanted. Owns the way that was walked, and the guide.

Each position of the way is joined to the one before it, and to every earlier one so near that the way has passed there again; of these the one with
the shortest way back is kept [Dijkstra 1959, by induction: a way back runs only through earlier positions]. So a loop is cut where it closes, as far
as the track is good enough to show it, and a way in and out of a room is left out.
"""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import replace

import numpy as np

from echostep.arrays import Floats
from echostep.localization import Estimate, TrackStatus
from echostep.path import MeasuredSegment
from echostep.tracker import Tracker
from echostep_app.guidance.cue_list import CueList
from echostep_app.guidance.cues import OFF_M, Guide
from echostep_app.plan.polyline import nearest, way_m
from echostep_app.plan.routing import Route, RoutePlace, Stretch

REACH_M = 12.0  # of the way back, on which the wearer is looked for: more than the steps of a search in one room
BESIDE_M = 3.0  # greatest 95 % radius of the way back beside the way in: a corridor and a half
STEP_M = 0.5  # least distance between two positions: corners of corridors are kept
JOIN_M = 1.0  # positions this near on one level are the same place: less than the distance of two ways on either side of a wall
LEVEL_M = 1.5  # less than this between their heights: half the height of a level


class OwnWay:
    """Positions that were walked, each with its way back, and the present one."""

    def __init__(self) -> None:
        self._at: list[tuple[float, float, float]] = []  # x, y, z in m
        self._next: list[int] = []  # the position to go to from each on the way back; for the first, itself
        self._back_m: list[float] = []  # length of the way back from each
        self._cells: defaultdict[tuple[int, int], list[int]] = defaultdict(list)  # positions by cell of JOIN_M
        self._here = -1  # the present position; -1 before the first

    def add(self, x_m: float, y_m: float, z_m: float = 0.0) -> None:
        """Walk to a new position, unless it is nearly the present one."""
        here = (x_m, y_m, z_m)
        if self._at and math.dist(self._at[self._here][:2], here[:2]) < STEP_M:
            return
        new = len(self._at)
        ways = [(self._back_m[k] + math.dist(self._at[k][:2], here[:2]), k) for k in self._joined(here)]
        back_m, following = min(ways, default=(0.0, new))
        self._at.append(here)
        self._next.append(following)
        self._back_m.append(back_m)
        self._cells[_cell(x_m, y_m)].append(new)
        self._here = new

    def go_back_to(self, left_m: float) -> None:
        """Move to the position on the way back from which at least `left_m` is left."""
        while self._at and self._next[self._here] != self._here and self._back_m[self._next[self._here]] >= left_m:
            self._here = self._next[self._here]

    def line_m(self) -> Floats:
        """The way back (k, 2) from the present position to the first."""
        k, line = self._here, []
        while k >= 0:
            line.append(self._at[k][:2])
            k = self._next[k] if self._next[k] != k else -1
        return np.array(line, np.float64).reshape(-1, 2)

    def _joined(self, here: tuple[float, float, float]) -> list[int]:
        """The present position, and the earlier ones at nearly this place."""
        x, y, z = here
        column, row = _cell(x, y)
        near = [k for i in (-1, 0, 1) for j in (-1, 0, 1) for k in self._cells.get((column + i, row + j), ())]
        same = [k for k in near if math.dist(self._at[k][:2], (x, y)) < JOIN_M and abs(self._at[k][2] - z) < LEVEL_M]
        return [self._here, *same] if self._at else []


def _cell(x_m: float, y_m: float) -> tuple[int, int]:
    return math.floor(x_m / JOIN_M), math.floor(y_m / JOIN_M)


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
