# SPDX-License-Identifier: MIT
"""Poses drawn from a start."""

from __future__ import annotations

import numpy as np
import pytest

from echostep.localization import ANY_LEVEL, Building, Start
from echostep.localization.particles.start import NEAR_SD_M, NEAR_SHARE, draw_poses
from echostep.plan import Pose
from echostep.walls.level_sheet import lay_out_levels, level_of
from echostep_studies.simulation.tower import LIFT_AT, tower

COUNT, STOREYS = 9_000, 3


def test_near_a_place_of_unknown_level_is_above_and_below_it_too() -> None:
    """Most poses are there, as many on each level, and face anywhere."""
    laid_out = lay_out_levels(tower(STOREYS))
    near = Pose(*LIFT_AT, 0.0, ANY_LEVEL)
    floor = Building(laid_out.walls, laid_out.sheet).floor
    x, y, heading = draw_poses(Start(near=near), COUNT, floor, laid_out.sheet, np.random.default_rng(1))
    level = level_of(x, laid_out.sheet)
    is_near = np.hypot(x - level * laid_out.sheet.pitch_m - near.x_m, y - near.y_m) < 3.0 * NEAR_SD_M
    assert np.bincount(level[is_near]) == pytest.approx(NEAR_SHARE * COUNT / STOREYS, rel=0.2)
    assert abs(np.exp(1j * heading[is_near]).mean()) < 0.05
