# SPDX-License-Identifier: MIT
"""All levels of a plan laid side by side on one sheet, and the connectors between them.

In: a plan. Out: `LaidOutPlan`: walls for the cloud, and `LevelSheet`, plain arrays for kernels. Owns nothing.

    x of the sheet:  x0_m          x0_m + pitch_m    x0_m + 2 pitch_m
                     |  level 0    |    level 1      |    level 2      |

Level k lies `k * pitch_m` east of its place in the map. So a particle's x determines its level, walls and echoes of other levels are out of its
reach, and only this module and `change_levels` depend on levels. A plan of one level lies where its map has it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Floats, Ints
from echostep.jit import kernel, part
from echostep.plan import Plan
from echostep.walls.echo_sources import Walls

# On either side of a level on the sheet: particles do not go that far beyond the outermost walls
MARGIN_M = 50.0
STAIRS, LIFT, RAMP = 0, 1, 2
KINDS = {"stairs": STAIRS, "lift": LIFT, "ramp": RAMP}


class LevelSheet(NamedTuple):
    """Levels, `height_m` (n,), and connectors, for kernels.

    Level k holds x0_m + k * pitch_m <= x < x0_m + (k + 1) * pitch_m of the sheet. Connector c is of `kind[c]`, its corners in the map are
    corners[start[c] : start[c + 1]], and it serves the levels k with serves[c, k].
    """

    x0_m: float
    pitch_m: float
    height_m: Floats
    kind: Ints
    start: Ints
    corners: Floats
    serves: Bools


@dataclass(frozen=True, slots=True)
class LaidOutPlan:
    """The walls of all levels on the sheet, and the sheet."""

    walls: Walls
    sheet: LevelSheet


def lay_out_levels(plan: Plan) -> LaidOutPlan:
    """The sheet of a plan; raises EchostepError for a plan too wide for its tiles."""
    sheet = level_sheet_of(plan)
    walls = [level.heard + k * sheet.pitch_m * np.array([1.0, 0.0, 1.0, 0.0]) for k, level in enumerate(plan.levels)]
    return LaidOutPlan(Walls(np.concatenate(walls) if len(walls) > 1 else walls[0]), sheet)


def level_sheet_of(plan: Plan) -> LevelSheet:
    """The sheet of a plan: levels and connectors, without walls."""
    ends = np.concatenate([level.heard.reshape(-1, 2) for level in plan.levels])
    low, high = (float(ends[:, 0].min()), float(ends[:, 0].max())) if len(ends) else (0.0, 0.0)
    outlines = [c.outline_m for c in plan.connectors]
    serves = np.zeros((len(outlines), len(plan.levels)), np.bool_)
    for c, connector in enumerate(plan.connectors):
        serves[c, list(connector.levels)] = True
    return LevelSheet(
        x0_m=low - MARGIN_M,
        pitch_m=high - low + 2.0 * MARGIN_M,
        height_m=np.array([level.height_m for level in plan.levels]),
        kind=np.array([KINDS[c.kind] for c in plan.connectors], np.int64),
        start=np.concatenate([[0], np.cumsum([len(o) for o in outlines])]).astype(np.int64),
        corners=np.concatenate([np.zeros((0, 2)), *outlines]),
        serves=serves,
    )


def level_of(x_m: Floats, sheet: LevelSheet) -> Ints:
    """Levels (n,) of places on the sheet; a place beyond the sheet is on the outermost level."""
    last = len(sheet.height_m) - 1
    if last == 0:
        return np.zeros(len(x_m), np.int64)
    return np.clip(np.floor((x_m - sheet.x0_m) / sheet.pitch_m), 0, last).astype(np.int64)


@part
def level_on_sheet(x: float, sheet: LevelSheet) -> int:
    """`level_of` for one place, in kernels."""
    return min(max(math.floor((x - sheet.x0_m) / sheet.pitch_m), 0), len(sheet.height_m) - 1)


@kernel
def connector_at(x: float, y: float, level: int, s: LevelSheet) -> int:
    """The connector that holds a place in the map on this level; -1: none."""
    for c in range(len(s.kind)):
        if s.serves[c, level] and _inside(x, y, s.corners, s.start[c], s.start[c + 1]):
            return c
    return -1


@kernel
def nearest_level(z: float, c: int, s: LevelSheet) -> int:
    """The level that connector `c` serves whose height is nearest to z."""
    best, least = -1, np.inf
    for k in range(len(s.height_m)):
        off = abs(s.height_m[k] - z)
        if s.serves[c, k] and off < least:
            best, least = k, off
    return best


@kernel
def end_of_connector(z: float, c: int, margin: float, s: LevelSheet) -> float:
    """The height z within connector `c`: no further than a margin beyond the lowest and the highest level that it serves."""
    low, high = np.inf, -np.inf
    for k in range(len(s.height_m)):
        if s.serves[c, k]:
            low, high = min(low, s.height_m[k]), max(high, s.height_m[k])
    return min(max(z, low - margin), high + margin)


@part
def _inside(x: float, y: float, corners: Floats, first: int, beyond: int) -> bool:
    """Whether a polygon, corners[first:beyond], holds a point: a ray from it to the east crosses an odd number of sides."""
    odd = False
    ax, ay = corners[beyond - 1, 0], corners[beyond - 1, 1]
    for k in range(first, beyond):
        bx, by = corners[k, 0], corners[k, 1]
        if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
            odd = not odd
        ax, ay = bx, by
    return odd
