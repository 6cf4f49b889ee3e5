# SPDX-License-Identifier: MIT
"""Plans that differ from the building in part or entirely.

In: a plan of one level, a way through it, a seeded generator. Out: another plan. Owns nothing.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.plan import Plan, Pose

LONG_M = 2.5  # a wall that can be missing is at least so long
NEAR_M = 2.0  # and so near to the way
ADDED_M = 2.0  # length of a wall that is only on the plan
APART_M = 1.0  # of a building and its half turn, from the middle between both
ADDED_AFTER = (0.2, 0.5)  # share of the way at which it stands across


def displaced(plan: Plan, sd_m: float, rng: np.random.Generator) -> Plan:
    """Each wall moved along its normal, with this standard deviation, which the plan states."""
    walls = plan.levels[0].walls
    along = walls[:, 2:] - walls[:, :2]
    normal = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
    moved = walls + np.tile(normal * (sd_m * rng.standard_normal(len(walls)))[:, None], 2)
    return replace(_with_walls(plan, moved), uncertainty_m=sd_m)


def wall_missing(plan: Plan, way: Floats, rng: np.random.Generator) -> Plan:
    """Without one of the long walls beside the way (n, 2)."""
    walls = plan.levels[0].walls
    candidates = [
        k
        for k, wall in enumerate(walls)
        if math.hypot(*(wall[2:] - wall[:2])) > LONG_M and _distance(wall, way) < NEAR_M
    ]
    if not candidates:
        raise EchostepError(f"plan {plan.name}: no wall of {LONG_M} m stands beside the way")
    return _with_walls(plan, np.delete(walls, rng.choice(candidates), axis=0))


def beside_half_turn(plan: Plan, way: Floats, rng: np.random.Generator) -> Plan:
    """The plan, and beside it its half turn, without one of the long walls beside the way (n, 2): two places differ by that alone."""
    walls, other = plan.levels[0].walls, wall_missing(plan, way, rng).levels[0].walls
    x_m, y_m = float(walls[:, ::2].max()) + APART_M, 0.5 * float(walls[:, 1::2].min() + walls[:, 1::2].max())
    return _with_walls(plan, np.vstack([walls, 2.0 * np.array([x_m, y_m, x_m, y_m]) - other]))


def wall_added(plan: Plan, way: Floats, rng: np.random.Generator) -> Plan:
    """With a wall across the way (n, 2) that was not built."""
    k = int(rng.uniform(*ADDED_AFTER) * (len(way) - 1))
    ahead = way[min(k + 10, len(way) - 1)] - way[k]
    across = 0.5 * ADDED_M * np.array([-ahead[1], ahead[0]]) / max(float(np.hypot(*ahead)), 1e-9)
    wall = np.concatenate([way[k] - across, way[k] + across])
    return _with_walls(plan, np.vstack([plan.levels[0].walls, wall]))


def mirrored(plan: Plan, pose: Pose) -> tuple[Plan, Pose]:
    """The plan mirrored from left to right, and a pose with it."""
    walls = plan.levels[0].walls
    middle = 0.5 * float(walls[:, ::2].min() + walls[:, ::2].max())
    turned = walls * [-1.0, 1.0, -1.0, 1.0] + [2.0 * middle, 0.0, 2.0 * middle, 0.0]
    return _with_walls(plan, turned), Pose(2.0 * middle - pose.x_m, pose.y_m, math.pi - pose.heading_rad, pose.level)


def _with_walls(plan: Plan, walls: Floats) -> Plan:
    """A plan of these walls alone; rooms would not fit any more."""
    return replace(plan, levels=(replace(plan.levels[0], walls=walls, rooms=()),), start=None)


def _distance(wall: Floats, way: Floats) -> float:
    """Least distance of the points of a way (n, 2) from a wall (4,)."""
    along = wall[2:] - wall[:2]
    share = np.clip((way - wall[:2]) @ along / (along @ along), 0.0, 1.0)
    return float(np.hypot(*(wall[:2] + share[:, None] * along - way).T).min())
