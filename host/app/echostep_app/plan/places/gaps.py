# SPDX-License-Identifier: MIT
"""Gaps: openings in the walls that the plan does not list as doors.

In: a level's walls and doors. Out: `Door`s. Owns the widths.
A wall with a free end is extended: the opening ends at the first wall within a door's width.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely
from numpy.typing import NDArray

from echostep.arrays import Bools, Floats, Ints
from echostep.plan import Door, Level

Areas = NDArray[np.object_]

# Assumed:
NARROWEST_M, WIDEST_M = 0.5, 1.6  # of an opening that a door could close
LONGEST_JAMB_M = 0.301  # a shorter wall at the end of another one is a jamb: the longer one still ends free
# The same of a jamb that another one of its length faces across an opening: old walls are that thick
LONGEST_FACED_M = 1.2
TOUCH_M = 0.02  # walls with a smaller distance touch
BESIDE_M = 5e-3  # a wall's end this far beside an opening's line ends it: coordinates are rounded
AWRY_M = 0.05  # from there to where the line crosses that wall: beyond, it runs along the wall
SAME_M = 0.1  # two gaps with nearer middles are one, found from both its ends
STRAIGHT = 0.99  # cosine of the angle up to which a face runs straight away from its opening
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
    ray, wall = tree.query(rays, predicate="dwithin", distance=BESIDE_M)
    reach_m = THICKNESS_M + _reach_m(shapely.points(near[ray]), rays[ray], lines[wall])
    nearest_m = np.full(len(begin), np.inf)
    np.minimum.at(nearest_m, ray, reach_m)
    fits = (nearest_m >= NARROWEST_M) & np.isfinite(nearest_m)
    gaps = np.concatenate((begin[fits], (begin + np.where(fits, nearest_m, 0.0)[:, None] * outward)[fits]), axis=1)
    return tuple(Door((float(a), float(b), float(c), float(d))) for a, b, c, d in _once(gaps))


def _reach_m(begin: Areas, rays: Areas, walls: Areas) -> Floats:
    """How far each ray (n,) is free: to where it crosses its wall, or runs into the wall's end within `BESIDE_M`, whatever the last bit says.

    Infinite where it does neither, as for a wall just behind its end: the distance to nothing is NaN.
    """
    crossed = (
        shapely.intersection(rays, walls),
        shapely.intersection(shapely.buffer(rays, BESIDE_M, cap_style="flat"), walls),
    )
    crossing, beside = (np.nan_to_num(shapely.distance(begin, place), nan=np.inf) for place in crossed)
    return np.where(crossing < beside + AWRY_M, crossing, beside)


def with_gaps(level: Level) -> Level:
    """The level with its unlisted openings as doors: a gap that people can pass is a passage."""
    return replace(level, doors=(*level.doors, *door_gaps(level)))


def _free_ends(walls: Floats, lines: Floats, level: Level) -> tuple[Floats, Floats]:
    """Ends (k, 2) of walls that touch neither a longer wall than a jamb nor a listed door, and the direction (k, 2) in which their wall points."""
    length = np.hypot(*(walls[:, 2:] - walls[:, :2]).T)
    jamb = (length <= LONGEST_JAMB_M) | _faced(walls, length)
    long = ~jamb
    ends = walls[long].reshape(-1, 2)
    along = (walls[long, 2:] - walls[long, :2]) / length[long, None]
    outward = np.stack((-along, along), axis=1).reshape(-1, 2)
    points = shapely.points(ends)
    end, other = shapely.STRtree(lines[long]).query(points, predicate="dwithin", distance=TOUCH_M)
    free = np.ones(len(ends), dtype=bool)
    free[end[end // 2 != other]] = False
    doors = shapely.STRtree(shapely.linestrings(np.array([door.line for door in level.doors]).reshape(-1, 2, 2)))
    reach_m = length[jamb].max(initial=LONGEST_JAMB_M)
    free[doors.query(points, predicate="dwithin", distance=reach_m)[0]] = False
    return ends[free], outward[free]


def _faced(walls: Floats, length: Floats) -> Bools:
    """Which walls (n,) are jambs of an opening in a thick wall: at both ends a longer wall runs straight back, and an equal jamb lies across."""
    short = np.flatnonzero((length > LONGEST_JAMB_M) & (length <= LONGEST_FACED_M))
    faced = np.zeros(len(walls), dtype=bool)
    along = (walls[short, 2:] - walls[short, :2]) / length[short, None]
    normal = np.stack((-along[:, 1], along[:, 0]), axis=1)
    middle = 0.5 * (walls[short, :2] + walls[short, 2:])
    one, other = shapely.STRtree(shapely.points(middle)).query(
        shapely.points(middle), predicate="dwithin", distance=WIDEST_M + TOUCH_M
    )
    across = middle[other] - middle[one]
    away = (across * normal[one]).sum(axis=1)
    equal = np.abs(length[short][one] - length[short][other]) < TOUCH_M
    parallel = np.abs((along[one] * normal[other]).sum(axis=1)) < TOUCH_M
    level = np.abs((across * along[one]).sum(axis=1)) < TOUCH_M
    fits = equal & parallel & level & (np.abs(away) >= NARROWEST_M)
    back = _runs_back(walls, length, short, normal)
    for side, sign in enumerate((1.0, -1.0)):
        opposite = one[fits & (sign * away > 0.0)]
        faced[short[opposite]] |= back[side, :, opposite].all(axis=1)
    return faced


def _runs_back(walls: Floats, length: Floats, short: Ints, normal: Floats) -> Bools:
    """Whether at each end of the short walls a longer wall runs against their normal, and along it: (2 directions, 2 ends, k)."""
    runs = np.zeros((2, 2, len(short)), dtype=bool)
    ends = shapely.STRtree(shapely.points(walls.reshape(-1, 2)))
    corner, end = ends.query(shapely.points(walls[short].reshape(-1, 2)), predicate="dwithin", distance=TOUCH_M)
    wall, k = end // 2, corner // 2
    step = (walls[wall, 2:] - walls[wall, :2]) * np.where(end % 2, -1.0, 1.0)[:, None]
    reach = (step * normal[k]).sum(axis=1) / np.maximum(length[wall], length[short[k]])
    for side, sign in enumerate((-1.0, 1.0)):
        straight = sign * reach > STRAIGHT
        runs[side, corner[straight] % 2, k[straight]] = True
    return runs


def _once(gaps: Floats) -> list[list[float]]:
    """Gaps (n, 4) without those that were found from their other end too."""
    middles = shapely.points((gaps[:, :2] + gaps[:, 2:]) / 2)
    one, other = shapely.STRtree(middles).query(middles, predicate="dwithin", distance=SAME_M)
    repeated: set[int] = set()
    for k, later in zip(one.tolist(), other.tolist(), strict=True):
        if k < later and k not in repeated:
            repeated.add(later)
    return [row for k, row in enumerate(gaps.tolist()) if k not in repeated]
