# SPDX-License-Identifier: MIT
"""Particles that went through the wall of an upper storey stand in the air, and lose their weight."""

from __future__ import annotations

import numpy as np
import pytest

from echostep.height.levels import FALL_PER_M
from echostep.localization import Building, CloudSettings, FilterSettings, MapFilter, Start
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan import Level, Plan, Pose
from echostep.walls.level_sheet import lay_out_levels

ROOM = np.array([[0, 0, 12, 0], [12, 0, 12, 8], [12, 8, 0, 8], [0, 8, 0, 0]], float)
NONE, NO_RANGERS = np.zeros(0), np.zeros(0, np.int64)
IN_M, OUT_M = (6.0, 4.0), (17.0, 4.0)


def building(*heights_m: float) -> Building:
    """The same room on each level."""
    levels = tuple(Level(f"{h} m", h, ROOM) for h in heights_m)
    laid_out = lay_out_levels(Plan("storeys", levels, None, ""))
    return Building(laid_out.walls, laid_out.sheet)


@pytest.mark.parametrize(
    ("heights_m", "level", "at_m", "loss"),
    [
        ((0.0, 3.5), 1, OUT_M, -2.0 * FALL_PER_M),
        ((0.0, 3.5), 1, IN_M, 0.0),
        ((0.0, 3.5), 0, OUT_M, 0.0),  # out of the front door
        ((-3.0, 0.0), 1, OUT_M, 0.0),  # the same above a basement
        ((0.0, 1.2), 1, OUT_M, 0.0),  # and over a few steps
        ((104.0, 108.0), 0, OUT_M, 0.0),  # heights above the sea
        ((104.0, 108.0), 1, OUT_M, -2.0 * FALL_PER_M),
    ],
)
def test_only_air_takes_weight(
    heights_m: tuple[float, float], level: int, at_m: tuple[float, float], loss: float
) -> None:
    built = building(*heights_m)
    assert built.upper_levels is not None
    assert built.sheet is not None
    x = np.array([at_m[0], IN_M[0]]) + level * built.sheet.pitch_m
    lost = built.upper_levels.log_loss(x, np.array([at_m[1], IN_M[1]]), 2.0)
    assert ([0.0, 0.0] if lost is None else lost.tolist()) == [loss, 0.0]


def test_a_building_of_one_level_has_no_upper_levels() -> None:
    assert building(7.0).upper_levels is None


def test_a_cloud_half_in_the_air_comes_back_to_the_storey() -> None:
    built = building(0.0, 3.5)
    settings = FilterSettings(cloud=CloudSettings(size=100, largest=1_000))
    tracked = MapFilter(built, Start(Pose(*IN_M, 0.0, 1), 0.1), 0.0, np.random.default_rng(1), settings)
    cloud = tracked.cloud
    cloud.x_m[::2] += OUT_M[0] - IN_M[0]
    for k in range(8):
        step = PathSegment(k, k + 1.0, 1.0 * (-1.0) ** k, 0.0, 0.0, 0.0, sd_m=0.01, turn_sd_rad=0.001, step=k)
        estimate = tracked.update(MeasuredSegment(step, NONE, NO_RANGERS, NONE))
    assert estimate.level == 1
    assert estimate.outside < 0.01
