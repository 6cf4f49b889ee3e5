# SPDX-License-Identifier: MIT
"""Gaps: openings in the walls that the plan does not list as doors.

In: a level's walls and doors. Out: `Door`s. Owns the widths.
A wall with a free end is extended: the opening ends at the first wall within a door's width.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely

from echostep.arrays import Floats
from echostep.plan import Door, Level

# Assumed:
NARROWEST_M, WIDEST_M = 0.5, 1.6  # of an opening that a door could close
LONGEST_JAMB_M = 0.3  # a shorter wall at the end of another one is a jamb: the longer one still ends free
TOUCH_M = 0.02  # walls with a smaller distance touch
SAME_M = 0.1  # two gaps with nearer middles are one, found from both its ends
THICKNESS_M = 0.05  # an opening ends at this distance from its own wall's end at the earliest


def door_gaps(level: Level) -> tuple[Door, ...]:
    """The unlisted openings of a level, each once."""
    walls = level.solid
    if not len(walls):
        return ()
    lines = shapely.linestrings(walls.reshape(-1, 2, 2))
    tree = shapely.STRtree(lines)
    begin, outward = _free_ends(walls, lines, level)
    if not len(begin):
        return ()
    near, far = begin + THICKNESS_M * outward, begin + WIDEST_M * outward
    rays = shapely.linestrings(np.stack((near, far), axis=1))
    ray, wall = tree.query(rays, predicate="intersects")
    reach_m = THICKNESS_M + shapely.distance(shapely.points(near[ray]), shapely.intersection(rays[ray], lines[wall]))
    nearest_m = np.full(len(begin), np.inf)
    np.minimum.at(nearest_m, ray, reach_m)
    fits = (nearest_m >= NARROWEST_M) & np.isfinite(nearest_m)
    gaps = np.concatenate((begin[fits], (begin + np.where(fits, nearest_m, 0.0)[:, None] * outward)[fits]), axis=1)
    return tuple(Door((float(a), float(b), float(c), float(d))) for a, b, c, d in _once(gaps))


def with_gaps(level: Level) -> Level:
    """The level with its unlisted openings as doors: a gap that people can pass is a passage."""
    return replace(level, doors=(*level.doors, *door_gaps(level)))


def _free_ends(walls: Floats, lines: Floats, level: Level) -> tuple[Floats, Floats]:
    """Ends (k, 2) of walls that touch neither a longer wall than a jamb nor a listed door, and the direction (k, 2) in which their wall points."""
    length = np.hypot(*(walls[:, 2:] - walls[:, :2]).T)
    long = length > LONGEST_JAMB_M
    ends = walls[long].reshape(-1, 2)
    along = (walls[long, 2:] - walls[long, :2]) / length[long, None]
    outward = np.stack((-along, along), axis=1).reshape(-1, 2)
    points = shapely.points(ends)
    end, other = shapely.STRtree(lines[long]).query(points, predicate="dwithin", distance=TOUCH_M)
    free = np.ones(len(ends), dtype=bool)
    free[end[end // 2 != other]] = False
    if level.doors:
        doors = shapely.linestrings(np.array([door.line for door in level.doors]).reshape(-1, 2, 2))
        free[shapely.STRtree(doors).query(points, predicate="dwithin", distance=LONGEST_JAMB_M)[0]] = False
    return ends[free], outward[free]


def _once(gaps: Floats) -> list[list[float]]:
    """Gaps (n, 4) without those that were found from their other end too."""
    middles = shapely.points((gaps[:, :2] + gaps[:, 2:]) / 2)
    one, other = shapely.STRtree(middles).query(middles, predicate="dwithin", distance=SAME_M)
    repeated: set[int] = set()
    for k, later in zip(one.tolist(), other.tolist(), strict=True):
        if k < later and k not in repeated:
            repeated.add(later)
    return [row for k, row in enumerate(gaps.tolist()) if k not in repeated]
