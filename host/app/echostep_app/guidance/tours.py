# SPDX-License-Identifier: MIT
"""Waypoints along a way through a building, stairs and lifts included.

In: a plan and places, one after the other. Out: waypoints for `walker`. Owns nothing. The ways between are the shortest that a person can walk.
Stairs are walked as two flights and a landing a storey, along the longer side of their outline, and round the walls that cross a
straight flight: curved stairs, or a corner in the stairwell. A lift is ridden in its middle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from shapely import Polygon

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.plan import Connector, Plan
from echostep_app.plan.cropping import is_clear
from echostep_app.plan.polyline import way_m
from echostep_app.plan.routing import Route, RoutePlace, Routes
from echostep_simulation.people.walker import Waypoint

TURN_M = 0.9  # room to turn at the ends of a flight
MOST_ROOMS = 8  # of `room_tour`: two minutes of walking in an office
MOST_TOUR_M = 300.0  # after which `room_tour` visits no further room; assumed
SHORTEST_LEG_M = 2.0  # of `room_tour`: the next room is farther away; assumed
SHORTEST_M = 0.05  # a waypoint nearer to the one before it is left out


def tour(plan: Plan, places: Sequence[RoutePlace]) -> list[Waypoint]:
    """Waypoints through all these places; raises EchostepError when no way leads there."""
    routes = Routes(plan)
    way: list[Waypoint] = []
    for start, end in zip(places, places[1:], strict=False):
        way += waypoints(plan, routes.way(start, end))[1 if way else 0 :]
    return _spaced(_round_walls(plan, routes, way))


def room_tour(plan: Plan) -> list[Waypoint]:
    """From the plan's start, or its first room, through rooms of each level that stairs or lifts reach; raises EchostepError without two places.

    On a level without named rooms its doors are visited. The nearest places come first, at most `MOST_ROOMS` on all levels together but one on
    each, and no more after `MOST_TOUR_M`.
    """
    routes, way, walked_m = Routes(plan), list[Waypoint](), 0.0
    here = _first_place(plan)
    first, most = here.level, max(1, MOST_ROOMS // len(plan.levels))
    for level in sorted(range(len(plan.levels)), key=lambda k: abs(k - first)):
        rooms = _places(plan, level)
        visited = 0
        while rooms and visited < most and walked_m < MOST_TOUR_M:
            goal = min(rooms, key=lambda room: math.hypot(room.x_m - here.x_m, room.y_m - here.y_m))
            rooms.remove(goal)
            try:
                route = routes.way(here, goal)
            except EchostepError:  # no way leads there
                continue
            if route.length_m < SHORTEST_LEG_M:
                continue
            way += waypoints(plan, route)[1 if way else 0 :]
            here, visited, walked_m = goal, visited + 1, walked_m + route.length_m
    if len(way) < 2:
        raise EchostepError(f"plan {plan.name}: a tour needs two places with a way between them: name some rooms in it")
    return _spaced(_round_walls(plan, routes, way))


def _first_place(plan: Plan) -> RoutePlace:
    """The plan's start, else its first room; the origin of a plan without rooms, from which no tour begins."""
    if plan.start is not None and plan.start.level >= 0:
        return RoutePlace(plan.start.x_m, plan.start.y_m, plan.start.level)
    places = [place for k in range(len(plan.levels)) for place in _places(plan, k)]
    return places[0] if places else RoutePlace(0.0, 0.0)


def _places(plan: Plan, level: int) -> list[RoutePlace]:
    """The rooms of a level; the middles of its doors when it names none."""
    rooms = [RoutePlace(*room.at_m, level) for room in plan.levels[level].rooms]
    return rooms or [RoutePlace(*door.middle_m, level) for door in plan.levels[level].doors]


def waypoints(plan: Plan, route: Route) -> list[Waypoint]:
    """Waypoints along one route."""
    points: list[Waypoint] = []
    for k, stretch in enumerate(route.stretches):
        z = plan.levels[stretch.level].height_m
        points += [(x, y, 0.0, z) for x, y in stretch.line_m.tolist()]
        if k + 1 < len(route.stretches):
            to = route.stretches[k + 1]
            here = (stretch.level, to.level)
            connector = next(
                c for c in plan.connectors if stretch.by in (c.name, c.kind) and set(here) <= set(c.levels)
            )
            points += _between(plan, connector, *here, stretch.line_m[-1])
    return points


def _between(plan: Plan, connector: Connector, level: int, to: int, entered_m: Floats) -> list[Waypoint]:
    """Waypoints inside stairs or a lift, from one level to another."""
    heights = [plan.levels[k].height_m for k in range(len(plan.levels))]
    if connector.kind == "lift":
        x, y = connector.outline_m.mean(axis=0).tolist()
        return [(x, y, 0.0, heights[level]), (x, y, 0.0, heights[to])]
    near, far, aside = _flights(connector.outline_m, entered_m)
    points: list[Waypoint] = []
    up = 1 if to > level else -1
    for k in range(level, to, up):
        half = 0.5 * (heights[k] + heights[k + up])
        corners = (
            (near - aside, heights[k]), (far - aside, half), (far + aside, half), (near + aside, heights[k + up])
        )  # fmt: skip
        points += [(float(p[0]), float(p[1]), 0.0, z) for p, z in corners]
    return points


def _flights(outline_m: Floats, entered_m: Floats) -> tuple[Floats, Floats, Floats]:
    """Ends of the middle line of a stairwell, the end nearer to the entry first, and the offset of its flights from that line."""
    box = np.array(Polygon(outline_m).minimum_rotated_rectangle.exterior.coords)[:4]
    one, other = box[1] - box[0], box[3] - box[0]
    along, across = (one, other) if np.hypot(*one) >= np.hypot(*other) else (other, one)
    middle, unit = box.mean(axis=0), along / np.hypot(*along)
    reach = max(0.5 * float(np.hypot(*along)) - TURN_M, 0.5)
    ends = [middle - reach * unit, middle + reach * unit]
    ends.sort(key=lambda p: float(np.hypot(*(p - entered_m))))
    return ends[0], ends[1], 0.25 * across


def _round_walls(plan: Plan, routes: Routes, way: Sequence[Waypoint]) -> list[Waypoint]:
    """The way with a detour for each straight piece that meets a wall of the level nearest to its middle height."""
    points = list(way[:1])
    for start, end in pairwise(way):
        points += [*_detour(plan, routes, start, end), end]
    return points


def _detour(plan: Plan, routes: Routes, start: Waypoint, end: Waypoint) -> list[Waypoint]:
    """Waypoints between two others, where a wall is between them: on the shortest way round it, which rises evenly."""
    z0, z1 = start[-1], end[-1]
    level = min(range(len(plan.levels)), key=lambda k: abs(plan.levels[k].height_m - 0.5 * (z0 + z1)))
    if start[:2] == end[:2] or is_clear(plan.levels[level].solid, start[:2], end[:2]):
        return []
    try:
        route = routes.way(*(RoutePlace(w[0], w[1], level) for w in (start, end)))
    except EchostepError:  # no way leads round it
        return []
    if len(route.stretches) > 1:
        return []
    line = np.vstack([start[:2], route.stretches[0].line_m, end[:2]])
    shares = [way_m(line[: k + 1]) / way_m(line) for k in range(1, len(line) - 1)]
    return [(x, y, 0.0, z0 + s * (z1 - z0)) for (x, y), s in zip(line[1:-1].tolist(), shares, strict=True)]


def _spaced(way: list[Waypoint]) -> list[Waypoint]:
    """The way without waypoints that repeat the one before, except a lift's."""
    points = way[:1]
    for w in way[1:]:
        last = points[-1]
        same = np.hypot(w[0] - last[0], w[1] - last[1]) < SHORTEST_M
        if not same or (w[:2] == last[:2] and w[-1] != last[-1]):
            points.append(w)
    return points
