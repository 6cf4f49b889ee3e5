# SPDX-License-Identifier: MIT
"""The buildings of the study: with furniture that the true plan has as obstacles.

In: a seed and the length of a tour. Out: `Site`. Owns the loop of corridors.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely

from echostep.arrays import Floats
from echostep.plan import Level, Plan, load_plan
from echostep_app.plan.places.gaps import door_gaps
from echostep_app.plan.routing import RoutePlace
from echostep_studies.bench.sites import OFFICE_DOOR, OFFICE_PLAN, WESTPORT, Site, level_alone, plan_of
from echostep_studies.bench.tours import random_tour

# The loop: corridors 2 m wide about a block of 30 x 14 m, with rooms of 5 x 5 m or so on the outside.
WIDE_M, DEEP_M, DOOR_M = 2.0, 5.0, 0.9
BLOCK = (0.0, 0.0, 30.0, 14.0)
ROOMS = (6, 4, 6, 4)  # south, east, north, west: 20
CUPBOARD_M = ((0.8, 1.6), (0.4, 0.6))  # width and depth of a piece of furniture
CLEAR_M = 0.9  # of furniture from the middle of a door
WESTPORT_LEVEL = 2
STOREYS = 3  # of its lowest levels, in the row of several


def office(seed: int, length_m: float) -> Site:
    """The demo office, furnished."""
    plan = furnished(load_plan(OFFICE_PLAN), 8, np.random.default_rng([seed, 81]))
    return _toured(plan, OFFICE_DOOR, length_m, np.random.default_rng([seed, 80]))


def corridors(seed: int, length_m: float) -> Site:
    """A loop of corridors with 20 rooms, furnished."""
    rng = np.random.default_rng([seed, 82])
    plan = furnished(plan_of("corridors", loop_walls(rng)), 16, rng)
    return _toured(plan, RoutePlace(15.0, -1.0), length_m, rng)


def westport(seed: int, length_m: float, data: Path) -> Site:
    """One storey of westport-house, furnished."""
    rng = np.random.default_rng([seed, 83])
    plan = level_alone(load_plan(data / WESTPORT), WESTPORT_LEVEL)
    return _toured(furnished(plan, 8, rng), _westport_begin(plan), length_m, rng)


def storeys(seed: int, length_m: float, data: Path) -> Site:
    """The lowest STOREYS of westport-house with their stairs, furnished."""
    rng = np.random.default_rng([seed, 87])
    whole = load_plan(data / WESTPORT)
    joined = (
        replace(c, levels=tuple(k for k in c.levels if k < STOREYS)) for c in whole.connectors if c.kind == "stairs"
    )
    plan = replace(whole, levels=whole.levels[:STOREYS], connectors=tuple(c for c in joined if len(c.levels) > 1))
    return _toured(furnished(plan, 8, rng), _westport_begin(plan), length_m, rng)


def _westport_begin(plan: Plan) -> RoutePlace:
    """Beside the widest door of the lowest storey."""
    door = max(plan.levels[0].doors, key=lambda d: d.width_m)
    x0, y0, x1, y1 = door.line
    return RoutePlace(0.5 * (x0 + x1), 0.5 * (y0 + y1))


def _toured(plan: Plan, begin: RoutePlace, length_m: float, rng: np.random.Generator) -> Site:
    return Site(plan, random_tour(plan, begin, length_m, rng, anywhere=True))


def loop_walls(rng: np.random.Generator) -> Floats:
    """Walls (n, 4) of the loop; the doors are at random places of their rooms."""
    x0, y0, x1, y1 = BLOCK
    walls = [(x0, y0, x1, y0), (x1, y0, x1, y1), (x1, y1, x0, y1), (x0, y1, x0, y0)]
    a, b, c, d = x0 - WIDE_M, y0 - WIDE_M, x1 + WIDE_M, y1 + WIDE_M
    corners = [(a, b), (c, b), (c, d), (a, d)]
    for k, count in enumerate(ROOMS):
        begin, end = np.array(corners[k]), np.array(corners[(k + 1) % 4])
        along = (end - begin) / np.hypot(*(end - begin))
        out = np.array([along[1], -along[0]]) * DEEP_M
        edges = np.linspace(0.0, float(np.hypot(*(end - begin))), count + 1)
        last = 0.0
        for low, high in zip(edges[:-1], edges[1:], strict=True):
            door = float(rng.uniform(low + 0.5, high - 0.5 - DOOR_M))
            walls.append((*(begin + last * along), *(begin + door * along)))
            last = door + DOOR_M
        walls.append((*(begin + last * along), *end))
        walls += [(*(begin + e * along), *(begin + e * along + out)) for e in edges]
        walls.append((*(begin + out), *(end + out)))
    return np.array(walls, np.float64)


def furnished(plan: Plan, pieces: int, rng: np.random.Generator) -> Plan:
    """The plan with `pieces` cupboards along the walls of each level, clear of doors, stairs and each other."""
    stairs = shapely.union_all([shapely.Polygon(c.outline_m) for c in plan.connectors])
    return replace(plan, levels=tuple(_furnished(level, pieces, stairs, rng) for level in plan.levels))


def _furnished(level: Level, pieces: int, stairs: shapely.Geometry, rng: np.random.Generator) -> Level:
    doors = [door.line for door in (*level.doors, *door_gaps(level))]
    closed = shapely.MultiPoint([(0.5 * (x0 + x1), 0.5 * (y0 + y1)) for x0, y0, x1, y1 in doors])
    solid = shapely.STRtree(shapely.linestrings(level.solid.reshape(-1, 2, 2)))
    boxes: list[shapely.Polygon] = []
    for _ in range(100 * pieces):
        if len(boxes) == pieces:
            break
        box = _beside(level, rng)
        inner = box.buffer(-0.02)
        if (
            box.distance(closed) < CLEAR_M
            or box.distance(stairs) < CLEAR_M
            or len(solid.query(inner, predicate="intersects"))
        ):
            continue
        if all(box.distance(other) > 1.2 for other in boxes):
            boxes.append(inner)
    outlines = tuple(np.array(box.exterior.coords)[:-1] for box in boxes)
    return replace(level, obstacles=(*level.obstacles, *outlines))


def _beside(level: Level, rng: np.random.Generator) -> shapely.Polygon:
    """A box with its back to a random wall."""
    walls = level.walls
    length = np.hypot(*(walls[:, 2:] - walls[:, :2]).T)
    x0, y0, x1, y1 = walls[int(rng.choice(len(walls), p=length / length.sum()))].tolist()
    size = math.hypot(x1 - x0, y1 - y0)
    ux, uy = (x1 - x0) / size, (y1 - y0) / size
    side = float(rng.choice([-1.0, 1.0]))
    width, depth = (float(rng.uniform(*limits)) for limits in CUPBOARD_M)
    at = float(rng.uniform(0.0, max(size - width, 0.01)))
    nx, ny = -uy * side, ux * side
    corners = [(at, 0.03), (at + width, 0.03), (at + width, depth), (at, depth)]
    return shapely.Polygon([(x0 + a * ux + b * nx, y0 + a * uy + b * ny) for a, b in corners])
