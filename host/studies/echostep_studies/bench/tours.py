# SPDX-License-Identifier: MIT
"""Random tours through a plan, by the shortest ways from place to place.

In: a plan, a place to begin at, a length, a seeded generator. Out: places and waypoints. Owns nothing.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.plan import Plan
from echostep_app.guidance.tours import tour as tour_of
from echostep_app.plan.routing import RoutePlace, Routes
from echostep_simulation.people.walker import Waypoint

LEG_M = (5.0, 45.0)  # from place to place
OTHER_LEVEL = 0.3  # share of the places that are on another level
CLEAR_M = 0.6  # of a place from the nearest wall
TRIES = 2000  # for one tour, and for one place; assumed


def random_tour(
    plan: Plan, begin: RoutePlace, length_m: float, rng: np.random.Generator, *, anywhere: bool = False
) -> tuple[Waypoint, ...]:
    """At least `length_m` through random places that can be reached from `begin`; `anywhere`: from a random one of them on."""
    routes, places, walked_m = Routes(plan), [begin], 0.0
    for _ in range(TRIES):
        if walked_m >= length_m:
            return tuple(tour_of(plan, places))
        last = places[-1]
        level = int(rng.integers(len(plan.levels))) if rng.random() < OTHER_LEVEL else last.level
        place = _place(plan.levels[level].solid, level, rng)
        try:
            way_m = routes.way(last, place).length_m
        except EchostepError:
            continue
        if anywhere:
            places, anywhere = [place], False
        elif LEG_M[0] < way_m < LEG_M[1]:
            places.append(place)
            walked_m += way_m
    raise EchostepError(f"plan {plan.name}: no tour of {length_m:.0f} m was found from ({begin.x_m}, {begin.y_m})")


def _place(walls: Floats, level: int, rng: np.random.Generator) -> RoutePlace:
    """A random place clear of walls (n, 4) that has walls on all four sides: it is indoors."""
    ends = walls.reshape(-1, 2)
    for _ in range(TRIES):
        x, y = rng.uniform(ends.min(0), ends.max(0)).tolist()
        if clearance_m(x, y, walls) > CLEAR_M and _enclosed(x, y, walls):
            return RoutePlace(x, y, level)
    raise EchostepError("no place of the plan is clear of its walls")


def clearance_m(x: float, y: float, walls: Floats) -> float:
    """Distance of a place from the nearest of the walls (n, 4)."""
    along = walls[:, 2:] - walls[:, :2]
    share = ((np.array([x, y]) - walls[:, :2]) * along).sum(1) / np.maximum((along**2).sum(1), 1e-12)
    nearest = walls[:, :2] + np.clip(share, 0.0, 1.0)[:, None] * along
    return float(np.hypot(nearest[:, 0] - x, nearest[:, 1] - y).min(initial=math.inf))


def _enclosed(x: float, y: float, walls: Floats) -> bool:
    """Whether rays to east, north, west and south all meet a wall."""
    for here, along, across in ((x, 0, 1), (y, 1, 0)):
        other = y if along == 0 else x
        a, b = walls[:, across], walls[:, 2 + across]
        met = (a > other) != (b > other)
        share = (other - a[met]) / (b[met] - a[met])
        at = walls[met, along] + share * (walls[met, 2 + along] - walls[met, along])
        if not ((at > here).any() and (at < here).any()):
            return False
    return True
