"""The lay_out_levels: all levels of a plan laid side by side on one sheet, and the ways between them.

In: a plan. Out: `LaidOutPlan`: walls for the cloud, and `LevelSheet`, plain arrays for kernels. Owns nothing.

Level k lies `k * pitch_m` east of its place in the map. So a particle's x says on which level it is, walls and echoes of other levels are out of its
reach, and nothing that looks at walls need know of levels. A lay_out_levels of one level lies where its map has it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from echostep.arrays import Bools, Floats, Ints
from echostep.jit import kernel
from echostep.plan.model import Plan
from echostep.walls.echo_sources import Walls

MARGIN_M = 50.0  # between levels on the sheet, twice: nobody walks so far out of the lay_out_levels unnoticed
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
    """`walls` on the sheet."""

    walls: Walls
    storeys: LevelSheet


def lay_out_levels(plan: Plan) -> LaidOutPlan:
    """The sheet of a plan; raises EchostepError for a plan too wide for its tiles."""
    storeys = level_sheet_of(plan)
    sheets = [level.solid + k * storeys.pitch_m * np.array([1.0, 0.0, 1.0, 0.0]) for k, level in enumerate(plan.levels)]
    return LaidOutPlan(Walls(np.concatenate(sheets) if len(sheets) > 1 else sheets[0]), storeys)


def level_sheet_of(plan: Plan) -> LevelSheet:
    """Where the levels lie, and what joins them."""
    ends = np.concatenate([level.solid.reshape(-1, 2) for level in plan.levels])
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


def level_of(x_m: Floats, storeys: LevelSheet) -> Ints:
    """Levels (n,) of places on the sheet; those beyond it count to the outermost."""
    last = len(storeys.height_m) - 1
    if last == 0:
        return np.zeros(len(x_m), np.int64)
    return np.clip(np.floor((x_m - storeys.x0_m) / storeys.pitch_m), 0, last).astype(np.int64)


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
def _inside(x: float, y: float, corners: Floats, first: int, beyond: int) -> bool:
    """Whether a polygon holds a point: it is left of an odd number of sides."""
    odd = False
    ax, ay = corners[beyond - 1, 0], corners[beyond - 1, 1]
    for k in range(first, beyond):
        bx, by = corners[k, 0], corners[k, 1]
        if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
            odd = not odd
        ax, ay = bx, by
    return odd
