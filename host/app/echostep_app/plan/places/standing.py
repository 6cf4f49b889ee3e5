# SPDX-License-Identifier: MIT
"""Standing: whether a person can be at a position, and if not, the nearest one where a person can.

In: a plan, a position. Out: an `Objection`, or None. Owns only the spaces that it has found. A level with more than
`MOST_WALLS` walls is not judged.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from echostep.errors import EchostepError
from echostep.plan import Level, Plan, Pose
from echostep_app.plan.cropping import within
from echostep_app.plan.places.spaces import PlanSpaces, Spaces

# Assumed:
WITHIN_WALL_M = 0.1  # a position nearer to a wall than this is impossible
CLEAR_M = 0.3  # distance of a proposed position from walls: half a person's width
REACHES_M = (3.0, 30.0, 300.0, 3000.0)  # half sides of the squares that are searched


@dataclass(frozen=True, slots=True)
class Objection:
    """Why a person cannot be at a position, in words, and the nearest possible position on the same level (None if missing)."""

    reason: str
    nearest_m: tuple[float, float] | None

    @property
    def advice(self) -> str:
        """The nearest possible position in words; empty if missing."""
        return "the nearest possible place is {:.2f},{:.2f}".format(*self.nearest_m) if self.nearest_m else ""


class StandingGround:
    """Judges positions on one plan. One thread asks at a time."""

    def __init__(self, plan: Plan, spaces: PlanSpaces | None = None) -> None:
        """`spaces`: the plan's spaces, if shared."""
        self._plan = plan
        self._spaces = spaces or PlanSpaces(plan)

    def objection(self, x_m: float, y_m: float, level: int) -> Objection | None:
        """Why a person cannot be here: outside the building, inside a wall, inside an obstacle. None where it is possible or cannot be judged."""
        if not (0 <= level < len(self._plan.levels) and math.isfinite(x_m) and math.isfinite(y_m)):
            return Objection(f"the plan has no level {level}", None)
        spaces = self._spaces.on(level)
        if spaces is None or not len(self._plan.levels[level].solid):
            return None
        reason = _reason(spaces, self._plan.levels[level], x_m, y_m)
        return Objection(reason, _nearest(spaces, self._plan.levels[level], x_m, y_m)) if reason else None


def refuse_impossible(plan: Plan, start: Pose, origin: str) -> None:
    """Raise EchostepError for an impossible start; `origin`: where it was given, as `--start 3,4,90`."""
    objection = StandingGround(plan).objection(start.x_m, start.y_m, start.level)
    if objection is None:
        return
    raise EchostepError(f"{origin}: {objection.reason}: {objection.advice or 'check the plan and its metres'}")


def _reason(spaces: Spaces, level: Level, x_m: float, y_m: float) -> str:
    point = shapely.Point(x_m, y_m)
    if not (spaces.inside(x_m, y_m) if spaces.enclosed else _hull(level).intersects(point)):
        return "it is outside the building"
    if any(area.contains(point) for area in _obstacles(level)):
        return "it is inside an obstacle"
    near = within(level.solid, point.buffer(WITHIN_WALL_M).bounds)
    touches = len(near) and shapely.distance(shapely.linestrings(near.reshape(-1, 2, 2)), point).min() < WITHIN_WALL_M
    return "it is inside a wall" if touches or spaces.face_at(x_m, y_m) in spaces.hollow else ""


def _nearest(spaces: Spaces, level: Level, x_m: float, y_m: float) -> tuple[float, float] | None:
    """The nearest position with `CLEAR_M` around it where nothing objects."""
    point = shapely.Point(x_m, y_m)
    if spaces.enclosed:
        rooms = [area for k, area in enumerate(spaces.faces.areas) if k not in spaces.hollow]
        allowed = np.array([*rooms, *spaces.outlines, *spaces.way_areas], dtype=np.object_)
    else:
        allowed = np.array([_hull(level)], dtype=np.object_)
    tree = shapely.STRtree(allowed)
    for reach_m in REACHES_M:
        window = shapely.box(x_m - reach_m, y_m - reach_m, x_m + reach_m, y_m + reach_m)
        free = _free(shapely.union_all(allowed[tree.query(window)]).intersection(window), level, window)
        if not free.is_empty and free.distance(point) <= reach_m:
            x, y = shapely.shortest_line(free, point).coords[0]
            return round(x, 2), round(y, 2)
    return None


def _free(area: BaseGeometry, level: Level, window: BaseGeometry) -> BaseGeometry:
    """An area without obstacles and without positions nearer than `CLEAR_M` to a wall."""
    walls = within(level.solid, window.buffer(CLEAR_M).bounds)
    thick = shapely.union_all(shapely.buffer(shapely.linestrings(walls.reshape(-1, 2, 2)), CLEAR_M, quad_segs=4))
    return area.difference(shapely.union_all([thick, *_obstacles(level)]))


def _hull(level: Level) -> BaseGeometry:
    """The convex hull of the walls: the building, where it is not enclosed."""
    return shapely.MultiPoint(level.solid.reshape(-1, 2)).convex_hull


def _obstacles(level: Level) -> list[BaseGeometry]:
    return [shapely.make_valid(shapely.Polygon(corners)) for corners in level.obstacles]
