# SPDX-License-Identifier: MIT
"""A run that begins where another one ended: the storey by the barometer's last height, the place with any heading, and a search beside it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.height.levels import Air
from echostep.localization import Building, MapFilter, Start
from echostep.localization.belief import PLAN_FITS
from echostep.localization.particles.start import STATED
from echostep.localization.unmeasured import UNOBSERVED_DOUBT
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan import Pose
from echostep.walls.level_sheet import lay_out_levels
from echostep_simulation.world.tower import LIFT_AT, STOREY_M, tower

ZERO_M = 100.0  # height by pressure on the lowest floor


def filter_of(start: Start) -> MapFilter:
    """In the tower of three storeys."""
    laid_out = lay_out_levels(tower(3))
    return MapFilter(Building(laid_out.walls, laid_out.sheet), start, 0.0, np.random.default_rng(1))


def standing(t0_s: float, height_m: float, barometer_starts: int = 0) -> MeasuredSegment:
    """Half a second of standing, with five heights by pressure."""
    path = PathSegment(t0_s, t0_s + 0.5, 0.0, 0.0, 0.0, 0.0, 0.001, 0.0, 0)
    heights_m = np.full(5, height_m)
    return MeasuredSegment(
        path, np.zeros(0), np.zeros(0, np.int64), np.zeros(0), heights_m, barometer_starts=barometer_starts
    )


@pytest.mark.parametrize("storey", [0, 1, 2])
def test_the_pressure_tells_the_storey_of_an_unknown_place(storey: int) -> None:
    anywhere = filter_of(Start(air=Air(ZERO_M, 0.2)))
    for k in range(6):
        levels = anywhere.update(standing(0.5 * k, ZERO_M + storey * STOREY_M)).levels
    assert levels[storey] > 0.99


def test_without_it_all_storeys_stay() -> None:
    anywhere = filter_of(Start())
    for k in range(6):
        levels = anywhere.update(standing(0.5 * k, ZERO_M + STOREY_M)).levels
    assert max(levels) < 0.5


@pytest.mark.slow
@pytest.mark.parametrize("storey", [0, 1, 2])
def test_after_a_change_of_the_storey_meanwhile_the_last_one_is_not_claimed(storey: int) -> None:
    """The search beside the last place is on the storey of the pressure; the last place is believed only there."""
    there = Pose(LIFT_AT[0] + 4.0, LIFT_AT[1], 0.0, 0)
    resumed = filter_of(Start(there, 1.0, math.pi, air=Air(ZERO_M, 0.15), after_pause=True))
    for k in range(6):
        estimate = resumed.update(standing(0.5 * k, ZERO_M + storey * STOREY_M))
    search = next(each.cloud.particles for each in resumed.belief.clouds if each.cloud.is_searching)
    assert np.bincount(search.level, search.weight, 3)[storey] > 0.99
    if storey == 0:
        assert estimate.right > PLAN_FITS * STATED * (1.0 - UNOBSERVED_DOUBT)
    else:
        assert estimate.status == "lost"
