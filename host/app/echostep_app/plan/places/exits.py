# SPDX-License-Identifier: MIT
"""Exits: the doors by which people leave a building, and where a plan begins above the ground, its stairs.

In: a plan. Out: a `Pose` outside each exit, heading away from it. Owns the words by which sources name exits.

On the ground: the doors that lead from an enclosed space into the open, or, on a level that lists none, the gaps that do. On any level: such a door
whose name says that it is an exit or an entrance (IFC, IMDF; OSM's `entrance`).
"""

from __future__ import annotations

import math
import re

import numpy as np
import shapely

from echostep.arrays import Floats
from echostep.particles.limits import HALF_STOREY_M
from echostep.plan import Door, Plan, Pose
from echostep_app.plan.cropping import extent
from echostep_app.plan.places.faces import OUTSIDE, beside
from echostep_app.plan.places.spaces import find_spaces

# Assumed:
OUT_M = 0.6  # from a door to the pose outside it
DIRECTIONS = 72  # of the straight lines, one of which has to lead from an exit into the open past all walls
NAMES = re.compile(r"\b(exit|entrance|entry|(not|haupt)?(aus|ein)gang|sortie|entr[ée]e|salida|entrada|uscita)\b", re.I)


def exits_of(plan: Plan) -> tuple[Pose, ...]:
    """The exits of a plan; empty where it shows none."""
    ground = min(range(len(plan.levels)), key=lambda k: abs(plan.levels[k].height_m))
    found = [pose for k in range(len(plan.levels)) for pose in _outer_doors(plan, k, is_ground=k == ground)]
    if not found and abs(plan.levels[ground].height_m) > HALF_STOREY_M:
        ways = [way for way in plan.connectors if ground in way.levels and way.kind != "lift"]
        found = [Pose(float(x), float(y), 0.0, ground) for way in ways for x, y in [way.outline_m.mean(axis=0)]]
    return tuple(found)


def _outer_doors(plan: Plan, k: int, *, is_ground: bool) -> list[Pose]:
    """The exits of one level."""
    level = plan.levels[k]
    named = {door for door in level.doors if NAMES.search(door.name)}
    if not (is_ground or named) or (spaces := find_spaces(plan, k)) is None:
        return []
    lines = np.concatenate((level.solid, np.array([door.line for door in level.doors]).reshape(-1, 4)))
    outer = [
        (door, pose)
        for door, a, b in spaces.doors
        if (a == OUTSIDE) != (b == OUTSIDE) and _is_open(pose := _outside(door, b == OUTSIDE, k), lines)
    ]
    listed = [pose for door, pose in outer if door in (level.doors if is_ground else named)]
    return listed if listed or not is_ground else [pose for _, pose in outer]


def _outside(door: Door, side: int, k: int) -> Pose:
    """The pose before a door on one of its sides (0, 1), heading away from it."""
    (x, y), (u, v) = beside(door, OUT_M)[side], beside(door, OUT_M)[1 - side]
    return Pose(x, y, math.atan2(y - v, x - u), k)


def _is_open(pose: Pose, lines: Floats) -> bool:
    """Whether a straight line leads from a place past all walls and doors (n, 4): deep inside a building whose walls have a hole none does."""
    x0, y0, x1, y1 = extent(lines)
    turn = 2.0 * math.pi / DIRECTIONS * np.arange(DIRECTIONS)
    far = np.array([pose.x_m, pose.y_m]) + math.hypot(x1 - x0, y1 - y0) * np.column_stack([np.cos(turn), np.sin(turn)])
    rays = shapely.linestrings(np.stack([np.broadcast_to([pose.x_m, pose.y_m], far.shape), far], axis=1))
    met = shapely.STRtree(shapely.linestrings(lines.reshape(-1, 2, 2))).query(rays, predicate="intersects")[0]
    return len(np.unique(met)) < DIRECTIONS
