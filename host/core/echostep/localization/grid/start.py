# SPDX-License-Identifier: MIT
"""The grid of an unknown start: evenly over the floor, and about a place if one is given.

In: a `Start`, the cells of the building, its floor. Out: a `SearchGrid`. Owns nothing.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.localization.echoes.unplanned import RangeMemory
from echostep.localization.grid.cells import GridCells
from echostep.localization.grid.heights import GridHeights
from echostep.localization.grid.search_grid import SearchGrid
from echostep.localization.particles.cloud import Cloud
from echostep.localization.particles.kernels import systematic
from echostep.localization.particles.start import NEAR_SHARE, Start, allowed_floor, draw_poses, near_count
from echostep.localization.settings import FilterSettings
from echostep.walls.floor import Floor
from echostep.walls.level_sheet import LevelSheet

ROOM_SD_M = 3.0  # standard deviation of a start's place above which it is searched: a room
DRAWN = 20_000  # poses that stand for a place with a spread


def is_unknown(start: Start) -> bool:
    """Whether the place is searched: it is too wide for particles about a pose."""
    return start.pose is None or start.sd_m > ROOM_SD_M


def grid_about(
    cloud: Cloud, cells: GridCells, unplanned: RangeMemory, floor: Floor, settings: FilterSettings, rng: np.random.Generator
) -> SearchGrid:  # fmt: skip
    """The grid of a cloud's poses, by which the cloud is compared with a search as long as the search is on a grid."""
    heights = None if cloud.sheet is None else GridHeights(cloud.sheet, settings.climb, Start(air=cloud.air))
    grid = SearchGrid(cells, (floor.x_m, floor.y_m), unplanned, heights, math.radians(settings.cloud.start_veer_sd_deg))
    chosen = systematic(cloud.weight, float(rng.random()), len(cloud.x_m))
    grid.begin_about(cloud.x_m[chosen], cloud.y_m[chosen], cloud.turn_rad[chosen], 1.0)
    return grid


def grid_of(
    start: Start, walk_heading_rad: float, cells: GridCells, unplanned: RangeMemory, floor: Floor, sheet: LevelSheet | None,
    settings: FilterSettings, rng: np.random.Generator,
) -> SearchGrid:  # fmt: skip
    """The grid of an unknown start. `walk_heading_rad`: the trunk's heading in the walk frame at the start."""
    sheet = sheet if sheet is not None and len(sheet.height_m) > 1 else None
    allowed = allowed_floor(floor, start, sheet)
    heights = None if sheet is None else GridHeights(sheet, settings.climb, start)
    grid = SearchGrid(
        cells, (allowed.x_m, allowed.y_m), unplanned, heights, math.radians(settings.cloud.start_veer_sd_deg)
    )
    count, share = (DRAWN, 1.0) if start.pose is not None else (near_count(DRAWN), NEAR_SHARE)
    if start.pose is not None or start.near is not None:
        x, y, heading = (drawn[:count] for drawn in draw_poses(start, DRAWN, allowed, sheet, rng)[:3])
        grid.begin_about(x, y, heading - walk_heading_rad, share)
    return grid
