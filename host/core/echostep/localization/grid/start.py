# SPDX-License-Identifier: MIT
"""The grid of an unknown start: evenly over the floor, and about a place if one is given.

In: a `Start`, the cells of the building, its floor. Out: a `Search`. Owns nothing. The weight of each state is computed, none is drawn.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep.echoes.range_table import SECTORS
from echostep.echoes.unplanned import RangeMemory
from echostep.elementary import exp, wrap
from echostep.localization.grid.cells import GridCells
from echostep.localization.grid.search import Search
from echostep.localization.particles.particles import Particles
from echostep.localization.particles.start import STATED, TURN_AROUND_RAD, Start, allowed_floor
from echostep.localization.settings import FilterSettings
from echostep.particles.kernels import systematic
from echostep.plan import ANY_LEVEL, Pose
from echostep.walls.floor import CELL_M, Floor
from echostep.walls.level_sheet import LevelSheet, level_of

NEAR_SHARE = 0.6  # of a search is about where the wearer was believed: errors are mostly small; assumed
ROOM_SD_M = 3.0  # standard deviation of a start's place above which it is searched: a room


def is_unknown(start: Start) -> bool:
    """Whether the place is searched: it is too wide for particles about a pose."""
    return start.pose is None or start.sd_m > ROOM_SD_M


def grid_about(
    cloud: Particles, cells: GridCells, unplanned: RangeMemory, floor: Floor, settings: FilterSettings, rng: np.random.Generator
) -> Search:  # fmt: skip
    """The grid of a cloud's poses, by which the cloud is compared with a search as long as the search is on a grid."""
    grid = Search(cells, (floor.x_m, floor.y_m), unplanned, Start(air=cloud.air), cloud.sheet, settings, rng)
    chosen = systematic(cloud.weight, float(rng.random()), len(cloud.x_m))
    grid.begin_about(cloud.x_m[chosen], cloud.y_m[chosen], cloud.turn_rad[chosen], 1.0)
    return grid


def grid_of(
    start: Start, walk_heading_rad: float, cells: GridCells, unplanned: RangeMemory, floor: Floor, sheet: LevelSheet | None,
    settings: FilterSettings, rng: np.random.Generator,
) -> Search:  # fmt: skip
    """The grid of an unknown start. `walk_heading_rad`: the trunk's heading in the walk frame at the start."""
    allowed = allowed_floor(floor, start, sheet)
    grid = Search(cells, (allowed.x_m, allowed.y_m), unplanned, start, sheet, settings, rng)
    about = start.pose or start.near
    if about is not None:
        facing = _facing(about.heading_rad - walk_heading_rad, start.heading_sd_rad)
        share = NEAR_SHARE if start.pose is None else STATED
        grid.begin_with(_near(allowed, about, start.sd_m, sheet), facing, share)
    return grid


def _near(floor: Floor, pose: Pose, sd_m: float, sheet: LevelSheet | None) -> Floats:
    """Density in the cells of a floor (n,) about a pose on its level, or on all if that is not known."""
    level = np.zeros(len(floor.x_m), np.int64) if sheet is None else level_of(floor.x_m, sheet)
    map_x_m = floor.x_m - (0.0 if sheet is None else level * sheet.pitch_m)
    away2 = (map_x_m - pose.x_m) ** 2 + (floor.y_m - pose.y_m) ** 2
    on = (level == pose.level) | (pose.level == ANY_LEVEL) if sheet is not None else np.ones(len(level), np.bool_)
    return np.asarray(on * exp(-0.5 * away2 / (sd_m**2 + CELL_M**2)))


def _facing(turn_rad: float, sd_rad: float) -> Floats:
    """Density in the sectors of the rotation walk -> map (SECTORS,) about one of them; even above TURN_AROUND_RAD."""
    sector_rad = 2.0 * math.pi / SECTORS
    off_rad: Floats = wrap(np.asarray((np.arange(SECTORS) + 0.5) * sector_rad - turn_rad))
    return np.ones(SECTORS) if sd_rad > TURN_AROUND_RAD else exp(-0.5 * off_rad**2 / (sd_rad**2 + sector_rad**2))
