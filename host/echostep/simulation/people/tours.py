"""Waypoints along a way through a building, stairs and lifts included.

In: a plan and places, one after the other. Out: waypoints for `walker`. Owns nothing. The ways between are the shortest that a person can walk.
Stairs are walked as two flights and a landing a storey, along the longer side of their outline; a lift is ridden in its middle.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from shapely import Polygon

from echostep.arrays import Floats
from echostep.plan.model import Connector, Plan
from echostep.plan.routing import Route, RoutePlace, Routes
from echostep.simulation.people.walker import Waypoint

TURN_M = 0.9  # room to turn at the ends of a flight
SHORTEST_M = 0.05  # a waypoint nearer to the one before it is left out


def tour(plan: Plan, places: Sequence[RoutePlace]) -> list[Waypoint]:
    """Through all these places; raises EchostepError when no way leads there."""
    routes = Routes(plan)
    way: list[Waypoint] = []
    for start, end in zip(places, places[1:], strict=False):
        way += waypoints(plan, routes.way(start, end))[1 if way else 0 :]
    return _spaced(way)


def waypoints(plan: Plan, route: Route) -> list[Waypoint]:
    """Along one route."""
    found: list[Waypoint] = []
    for k, stretch in enumerate(route.stretches):
        z = plan.levels[stretch.level].height_m
        found += [(x, y, 0.0, z) for x, y in stretch.line_m.tolist()]
        if k + 1 < len(route.stretches):
            to = route.stretches[k + 1]
            here = (stretch.level, to.level)
            connector = next(
                c for c in plan.connectors if stretch.by in (c.name, c.kind) and set(here) <= set(c.levels)
            )
            found += _between(plan, connector, *here, stretch.line_m[-1])
    return found


def _between(plan: Plan, connector: Connector, level: int, to: int, entered_m: Floats) -> list[Waypoint]:
    """Inside stairs or a lift, from one level to another."""
    heights = [plan.levels[k].height_m for k in range(len(plan.levels))]
    if connector.kind == "lift":
        x, y = connector.outline_m.mean(axis=0).tolist()
        return [(x, y, 0.0, heights[level]), (x, y, 0.0, heights[to])]
    near, far, aside = _flights(connector.outline_m, entered_m)
    found: list[Waypoint] = []
    up = 1 if to > level else -1
    for k in range(level, to, up):
        half = 0.5 * (heights[k] + heights[k + up])
        corners = (
            (near - aside, heights[k]), (far - aside, half), (far + aside, half), (near + aside, heights[k + up])
        )  # fmt: skip
        found += [(float(p[0]), float(p[1]), 0.0, z) for p, z in corners]
    return found


def _flights(outline_m: Floats, entered_m: Floats) -> tuple[Floats, Floats, Floats]:
    """Ends of the middle line of a stairwell, the end nearer to the entry first, and how far its flights are beside it."""
    box = np.array(Polygon(outline_m).minimum_rotated_rectangle.exterior.coords)[:4]
    one, other = box[1] - box[0], box[3] - box[0]
    along, across = (one, other) if np.hypot(*one) >= np.hypot(*other) else (other, one)
    middle, unit = box.mean(axis=0), along / np.hypot(*along)
    reach = max(0.5 * float(np.hypot(*along)) - TURN_M, 0.5)
    ends = [middle - reach * unit, middle + reach * unit]
    ends.sort(key=lambda p: float(np.hypot(*(p - entered_m))))
    return ends[0], ends[1], 0.25 * across


def _spaced(way: list[Waypoint]) -> list[Waypoint]:
    """Without waypoints upon the ones before, but for a lift's."""
    found = way[:1]
    for w in way[1:]:
        last = found[-1]
        same = np.hypot(w[0] - last[0], w[1] - last[1]) < SHORTEST_M
        if not same or (w[:2] == last[:2] and w[-1] != last[-1]):
            found.append(w)
    return found
