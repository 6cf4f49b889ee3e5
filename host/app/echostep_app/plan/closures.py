# SPDX-License-Identifier: MIT
"""Closures: passages that people have struck out, because fire, smoke or rubble closes them.

In: a plan, the places that were tapped. Out: the plan without these passages, and its router. Owns the newest router.

A stroke is a wall: across the door that is meant, or else across the narrowest passage there. Stairs, lifts and ramps are closed as a whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from echostep.arrays import Floats
from echostep.plan import Level, Plan
from echostep_app.plan.places.gaps import with_gaps
from echostep_app.plan.routing import RoutePlace, Routes

# Assumed:
DOOR_M = 1.0  # a door as near to the tap is meant
REACH_M = 6.0  # greatest length of a stroke to either side
ALONE_M = 2.0  # length of the four strokes where no wall is in reach
OPPOSITE = -0.5  # greatest cosine between the directions to the walls of a passage


class OpenWays:
    """The routers of one plan."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._newest: tuple[tuple[RoutePlace, ...], Routes] = (), Routes(plan)

    def past(self, closed: tuple[RoutePlace, ...]) -> Routes:
        """The router that avoids these places; the same one while they are the same."""
        if closed != self._newest[0]:
            self._newest = closed, Routes(without(self._plan, closed))
        return self._newest[1]


def without(plan: Plan, closed: Sequence[RoutePlace]) -> Plan:
    """The plan with a wall across each passage, and without the connectors, that contain a place."""
    levels, closed = list(plan.levels), [place for place in closed if place.level < len(plan.levels)]
    for place in closed:
        k = place.level
        levels[k] = replace(levels[k], walls=np.concatenate((levels[k].walls, stroke(plan.levels[k], place))))
    ways = tuple(
        way for way in plan.connectors
        if not any(p.level in way.levels and shapely.Polygon(way.outline_m).contains(shapely.Point(p.x_m, p.y_m)) for p in closed)
    )  # fmt: skip
    return replace(plan, levels=tuple(levels), connectors=ways)


def stroke(level: Level, place: RoutePlace) -> Floats:
    """The wall (n, 4) that closes the passage at a place."""
    at = np.array([place.x_m, place.y_m])
    doors = np.array([door.line for door in with_gaps(level).doors]).reshape(-1, 4)
    to_door = nearest_points(doors, at) - at
    if len(doors) and np.hypot(*to_door.T).min() < DOOR_M:
        return doors[[np.hypot(*to_door.T).argmin()]]
    to_wall = nearest_points(level.solid, at) - at
    length = np.hypot(*to_wall.T)
    ends = [at + ALONE_M * np.array(step) for step in ((1, 0), (-1, 0), (0, 1), (0, -1))]
    for k in [k for k in np.argsort(length).tolist() if 0.0 < length[k] < REACH_M][:1]:
        across = (to_wall @ to_wall[k] < OPPOSITE * length * length[k]) & (length < REACH_M)
        other = to_wall[across][length[across].argmin()] if across.any() else -REACH_M * to_wall[k] / length[k]
        ends = [at + to_wall[k], at + other]
    return np.array([[*at, *end] for end in ends]).reshape(-1, 4)


def nearest_points(segments: Floats, at: Floats) -> Floats:
    """The point (n, 2) of each segment (n, 4) that is nearest to a position (2,)."""
    begin, along = segments[:, :2], segments[:, 2:] - segments[:, :2]
    share = ((at - begin) * along).sum(axis=1) / (along**2).sum(axis=1)
    return np.asarray(begin + share.clip(0.0, 1.0)[:, None] * along)
