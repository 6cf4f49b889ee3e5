# SPDX-License-Identifier: MIT
"""Levels of a search: what is on stairs rises with the path, what is in a lift with the pressure, and what is elsewhere stays and pays."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.height.levels import UNKNOWN_LAG_M2, Air, ClimbSettings, HeightChange
from echostep.localization import Start
from echostep.localization.grid.heights import GridHeights
from echostep.localization.grid.kernels import LevelFactors
from echostep.walls.floor import CELL_M
from echostep.walls.level_sheet import LIFT, STAIRS, lay_out_levels
from echostep_simulation.world.tower import STOREY_M, tower

SHEET = lay_out_levels(tower(3)).sheet
STAIR, RIDE = (int(np.flatnonzero(SHEET.kind == kind)[0]) + 1 for kind in (STAIRS, LIFT))
STEP_M, PITCH = 0.17, round(SHEET.pitch_m / CELL_M)
CLIMB = ClimbSettings()


def felt(rise_m: float) -> HeightChange:
    return HeightChange(rise_m, 0.01, 0.0, math.inf, 0.0, 1.0)


def by_pressure(height_m: float) -> HeightChange:
    """Of a foot that stands."""
    return HeightChange(0.0, 0.01, height_m, 0.15, height_m, 1.0)


def climbed(heights: GridHeights, changes: list[HeightChange], lag_variance: float) -> tuple[list[LevelFactors], float]:
    every = []
    for change in changes:
        factors, lag_variance = heights.update(change, lag_variance)
        every.append(factors)
    return every, lag_variance


def test_what_is_on_stairs_reaches_the_next_level_once() -> None:
    heights = GridHeights(SHEET, CLIMB, Start())
    every, _ = climbed(heights, [felt(STEP_M)] * round(STOREY_M / STEP_M), math.inf)
    assert [int(f.east[STAIR, 0]) for f in every if f.east[STAIR, 0]] == [PITCH]
    assert all(f.east[0, 0] == 0 for f in every)
    z, _ = heights.of(np.array([1]), np.array([STAIR - 1]))
    assert z[0] == pytest.approx(SHEET.height_m[1], abs=STEP_M)


def test_what_rises_beside_the_stairs_pays() -> None:
    (factors,), _ = climbed(GridHeights(SHEET, CLIMB, Start()), [felt(STEP_M)], math.inf)
    sd = math.hypot(CLIMB.flat_sd_m, 0.01)
    ratio = factors.weight[0, 0] / factors.weight[STAIR, 0]
    assert ratio == pytest.approx(math.exp(-0.5 * (STEP_M / sd) ** 2), rel=1e-3)


def test_what_is_in_a_lift_goes_with_the_pressure_and_what_is_beside_it_pays() -> None:
    heights = GridHeights(SHEET, CLIMB, Start())
    still, variance = climbed(heights, [by_pressure(100.0)] * 10, UNKNOWN_LAG_M2)
    assert all(f.weight[0, 0] / f.weight[RIDE, 0] == pytest.approx(1.0, abs=0.05) for f in still)
    up = [by_pressure(100.0 + 0.5 * k) for k in range(round(STOREY_M / 0.5) + 1)]
    ride, _ = climbed(heights, up, variance)
    level = 0
    for factors in ride:
        level += int(factors.east[RIDE, level]) // PITCH
    assert level == 1
    assert math.prod(float(f.weight[0, 0] / f.weight[RIDE, 0]) for f in ride) < 1e-3


def test_a_known_barometer_tells_the_level() -> None:
    heights = GridHeights(SHEET, CLIMB, Start(air=Air(100.0, 0.2)))
    (factors,), _ = climbed(heights, [by_pressure(100.0 + STOREY_M)], 0.04)
    assert factors.weight[0, 1] == factors.weight[0].max()
    assert factors.weight[0, 0] < 0.01
