# SPDX-License-Identifier: MIT
"""Echoes that are too long: sound that a wall turned away, and that a rough place sends back along the way it came.

In: a ranger's place and axis, walls, a chance. Out: half the length of the sound's path; 0 for none. Owns nothing.

The axis of the beam is followed from wall to wall as a mirror reflects it. Objects at a wall (a frame, a joint, a board) scatter sound to all
sides, so that an echo returns at any angle; the echo then has the length of the whole way, longer than to the wall's nearest point.
"""

from __future__ import annotations

from echostep.arrays import Floats
from echostep.jit import part
from echostep_simulation.world.acoustics import Acoustics, path_db
from echostep_simulation.world.image_sources import TOUCH_M, crossing

WALLS_MET = 4  # by one beam: each way between two walls is a metre or more, and beyond four the level is too low
DIGITS = 1048576.0  # 2^20: the digits of a deviate below 1e-6 say nothing of its value


@part
def scattered_range(
    place: tuple[float, float], axis: tuple[float, float], walls: Floats, earliest_m: float, threshold_db: float,
    chance: float, a: Acoustics,
) -> float:  # fmt: skip
    """Range (m) of the first place, not nearer than `earliest_m`, that scatters the beam back; `chance`: uniform from 0 to 1, new for each ping."""
    (x, y), (dx, dy), way = place, axis, 0.0
    for met in range(WALLS_MET):
        wall, step = _first_wall(x, y, dx, dy, walls, a.maximum_m - way)
        way += step
        if wall < 0 or path_db(way, 0.0, 0.0, 2 * met + 1, a) + a.scatter_db < threshold_db:
            return 0.0
        if way >= earliest_m:
            if chance < a.scatter:
                return way
            chance = (chance - a.scatter) / (1.0 - a.scatter)
        x, y = x + step * dx, y + step * dy
        tx, ty = walls[wall, 2] - walls[wall, 0], walls[wall, 3] - walls[wall, 1]
        along = 2.0 * (dx * tx + dy * ty) / (tx * tx + ty * ty)
        dx, dy = along * tx - dx, along * ty - dy
    return 0.0


@part
def _first_wall(x: float, y: float, dx: float, dy: float, walls: Floats, reach_m: float) -> tuple[int, float]:
    """The wall that a ray meets first, more than TOUCH_M away, and the distance; -1 if none is within reach."""
    found, nearest = -1, reach_m
    for w in range(len(walls)):
        share = crossing(x, y, x + reach_m * dx, y + reach_m * dy, walls[w])
        if TOUCH_M < share * reach_m < nearest:
            found, nearest = w, share * reach_m
    return found, nearest


@part
def chance_of(normal_deviate: float) -> float:
    """A number uniform between 0 and 1, from the last digits of a normal deviate: independent of its value, and no other draw is shifted."""
    return (normal_deviate * DIGITS) % 1.0
