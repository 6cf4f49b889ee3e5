"""The building: all levels of a plan laid side by side on one sheet, and the ways between them.

In: a plan. Out: `Building`: walls for the cloud, and `Storeys`, plain arrays for kernels. Owns nothing.

Level k lies `k * pitch_m` east of its place in the map. So a particle's x says on which level it is, walls and echoes of other levels are out of its
reach, and nothing that looks at walls need know of levels. A building of one level lies where its map has it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from echostep.plan import Plan
from echostep.reflectors import Walls

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MARGIN_M = 50.0  # between levels on the sheet, twice: nobody walks so far out of the building unnoticed
STAIRS, LIFT, RAMP = 0, 1, 2
KINDS = {"stairs": STAIRS, "lift": LIFT, "ramp": RAMP}


class Storeys(NamedTuple):
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
    serves: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Building:
    """`walls` on the sheet."""

    walls: Walls
    storeys: Storeys


def building(plan: Plan) -> Building:
    """The sheet of a plan; raises EchostepError for a plan too wide for its tiles."""
    storeys = storeys_of(plan)
    sheets = [level.solid + k * storeys.pitch_m * np.array([1.0, 0.0, 1.0, 0.0]) for k, level in enumerate(plan.levels)]
    return Building(Walls(np.concatenate(sheets) if len(sheets) > 1 else sheets[0]), storeys)


def storeys_of(plan: Plan) -> Storeys:
    """Where the levels lie, and what joins them."""
    ends = np.concatenate([level.solid.reshape(-1, 2) for level in plan.levels])
    low, high = (float(ends[:, 0].min()), float(ends[:, 0].max())) if len(ends) else (0.0, 0.0)
    outlines = [c.outline_m for c in plan.connectors]
    serves = np.zeros((len(outlines), len(plan.levels)), np.bool_)
    for c, connector in enumerate(plan.connectors):
        serves[c, list(connector.levels)] = True
    return Storeys(
        x0_m=low - MARGIN_M,
        pitch_m=high - low + 2.0 * MARGIN_M,
        height_m=np.array([level.height_m for level in plan.levels]),
        kind=np.array([KINDS[c.kind] for c in plan.connectors], np.int64),
        start=np.concatenate([[0], np.cumsum([len(o) for o in outlines])]).astype(np.int64),
        corners=np.concatenate([np.zeros((0, 2)), *outlines]),
        serves=serves,
    )


def level_of(x_m: Floats, storeys: Storeys) -> Ints:
    """Levels (n,) of places on the sheet; those beyond it count to the outermost."""
    last = len(storeys.height_m) - 1
    if last == 0:
        return np.zeros(len(x_m), np.int64)
    return np.clip(np.floor((x_m - storeys.x0_m) / storeys.pitch_m), 0, last).astype(np.int64)


@njit(cache=True, error_model="numpy")
def connector_at(x: float, y: float, level: int, s: Storeys) -> int:
    """The connector that holds a place in the map on this level; -1: none."""
    for c in range(len(s.kind)):
        if s.serves[c, level] and _inside(x, y, s.corners, s.start[c], s.start[c + 1]):
            return c
    return -1


@njit(cache=True, error_model="numpy")
def nearest_level(z: float, c: int, s: Storeys) -> int:
    """The level that connector `c` serves whose height is nearest to z."""
    best, least = -1, np.inf
    for k in range(len(s.height_m)):
        off = abs(s.height_m[k] - z)
        if s.serves[c, k] and off < least:
            best, least = k, off
    return best


@njit(cache=True, error_model="numpy")
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
