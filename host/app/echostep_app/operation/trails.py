# SPDX-License-Identifier: MIT
"""Trails: where each wearer was in the last minutes.

In: positions in order of time. Out: points numbered in the order in which they were added, as rows for a page. Owns the points; their
number and age are bounded.
"""

from __future__ import annotations

import math
from array import array
from collections import deque
from typing import NamedTuple

from echostep_app.team.messages.report import Position

TRAIL_S = 180.0  # the way of some minutes shows where a wearer came from
POINT_M = 0.7  # least distance between two points: about a step
MOST_POINTS = 40_000  # of all wearers: 200 of them walk 3 min at 0.8 m/s


class TrailPoint(NamedTuple):
    """A position of wearer `wearer`, in metres on a level, at `t_s` of the operation's clock."""

    wearer: int
    x_m: float
    y_m: float
    level: int
    t_s: float


class Trails:
    """`add` takes positions; `rows` gives the points that a page has not been sent yet."""

    def __init__(self) -> None:
        self._points: deque[TrailPoint] = deque()
        self._first = 0  # number of the oldest point that is kept
        self._last: dict[int, TrailPoint] = {}

    def copy(self) -> Trails:
        """Trails of the same state that grow by themselves."""
        made = Trails()
        made._points, made._first, made._last = self._points.copy(), self._first, dict(self._last)
        return made

    @property
    def end(self) -> int:
        """Number of the next point."""
        return self._first + len(self._points)

    def add(self, wearer: int, p: Position, t_s: float) -> None:
        """Add a position, if the wearer has moved since the last one."""
        last = self._last.get(wearer)
        near = last is not None and last.level == p.floor and math.hypot(p.x_m - last.x_m, p.y_m - last.y_m) < POINT_M
        if near:
            return
        point = self._last[wearer] = TrailPoint(wearer, p.x_m, p.y_m, p.floor, t_s)
        self._points.append(point)
        while self._points and (self._points[0].t_s < t_s - TRAIL_S or len(self._points) > MOST_POINTS):
            self._points.popleft()
            self._first += 1

    def forget(self, wearers: set[int]) -> None:
        """Drop the trails of these wearers."""
        for wearer in wearers:
            self._last.pop(wearer, None)

    def rows(self, begin: int, now_s: float) -> bytes:
        """The points from number `begin` on that are kept, as rows of float32: wearer, x, y, level, age in seconds."""
        rows = array("f")
        points = self._points
        for k in range(max(begin - self._first, 0), len(points)):
            p = points[k]
            rows.extend((p.wearer, p.x_m, p.y_m, p.level, now_s - p.t_s))
        return rows.tobytes()
