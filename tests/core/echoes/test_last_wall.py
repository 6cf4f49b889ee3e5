# SPDX-License-Identifier: MIT
"""Echoes without a plan: a wall that goes on is foretold as well as by a plan, where it ends it is not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.echoes.likelihood import EchoSettings
from echostep.echoes.unplanned import BIN_M, Background, LastWall, PlacedPings, RangeMemory, UnplannedDensities
from echostep.localization import FilterSettings
from echostep.localization.belief import TEMPER
from echostep.localization.settings import UNPLANNED_DOOR, with_plan_error

SD_M = 0.036
SPACING_M = 0.25
ECHO = EchoSettings(sd_m=SD_M)
EVERYWHERE = Background(np.full(round(6.0 / BIN_M) + 1, -math.log(6.0)))


@pytest.mark.parametrize("slant_deg", [-20.0, 0.0, 10.0])
def test_a_straight_wall_is_foretold(slant_deg: float) -> None:
    normal_rad = 0.5 * math.pi + math.radians(slant_deg)
    step_m = SPACING_M * np.array([1.0, 0.0])
    distance_m = 1.5
    wall = LastWall(distance_m, 0.5 * math.pi, SD_M, 0.05)
    for _ in range(8):
        distance_m -= float(step_m @ (math.cos(normal_rad), math.sin(normal_rad)))
        wall.move(*step_m)
        wall.update(distance_m, 0.5 * math.pi, 1.0)
    wall.move(*step_m)
    distance_m -= float(step_m @ (math.cos(normal_rad), math.sin(normal_rad)))
    assert wall.distance_m == pytest.approx(distance_m, abs=0.01)
    assert wall.normal_rad == pytest.approx(normal_rad, abs=math.radians(2.0))


def densities(range_m: Floats, echo: EchoSettings = ECHO) -> UnplannedDensities:
    """Of echoes of the left ranger every SPACING_M on a way along x."""
    count = len(range_m)
    x_m: Floats = np.linspace(0.0, SPACING_M * (count - 1), count)
    ones = np.ones(count)
    pings = PlacedPings(np.zeros(count, np.int64), x_m, 0.0 * ones, 0.5 * math.pi * ones, range_m, ones)
    return RangeMemory(EVERYWHERE, echo).densities(pings)


def log_planned(range_m: Floats, true_m: float) -> Floats:
    """Log-density by a plan that is right, with a twentieth of outliers."""
    normal = np.exp(-0.5 * ((range_m - true_m) / SD_M) ** 2) / (SD_M * math.sqrt(2.0 * math.pi))
    return np.log(0.95 * normal + 0.05 / 6.0)


def test_a_corridor_that_goes_on_tells_little() -> None:
    range_m = 1.2 + SD_M * np.random.default_rng(1).standard_normal(400)
    gain = log_planned(range_m, 1.2)[20:] - densities(range_m).either[20:]
    assert abs(gain.mean()) < 0.5


@pytest.mark.parametrize("off_m", [-SD_M, SD_M])
def test_an_error_that_stays_along_a_wall_casts_less_doubt(off_m: float) -> None:
    """On 100 m of wall a plan that is one standard deviation off loses to the rival, which learns it."""
    range_m = 1.2 + 0.5 * SD_M * np.random.default_rng(2).standard_normal(400)
    log_ratio = log_planned(range_m, 1.2 + off_m)[20:] - densities(range_m).either[20:]
    assert log_ratio.sum() < -35.0
    assert TEMPER * log_ratio.sum() > 3.0 * UNPLANNED_DOOR  # no more than three walls that were never built


def test_a_wall_where_a_door_was_foretold_does() -> None:
    range_m = np.full(24, 1.2)
    log_ratio = log_planned(range_m, 2.5)[20:] - densities(range_m).either[20:]
    assert log_ratio.sum() < -8.0


def test_a_rival_knows_a_wall_no_better_than_the_plan_does() -> None:
    settings = FilterSettings(echo=ECHO, plan_sd_m=0.1)
    range_m = np.full(6, 1.5)
    exact, off = densities(range_m).alike[5], densities(range_m, with_plan_error(settings)).alike[5]
    assert off == pytest.approx(exact * SD_M / math.hypot(SD_M, 0.1), rel=0.3)


def test_a_door_is_news() -> None:
    range_m = np.concatenate([np.full(20, 1.2), np.full(4, 2.5)])
    gain = log_planned(range_m, 2.5)[20:] - densities(range_m).either[20:]
    assert gain[0] > 3.0
    assert gain[1:].max() < 2.0


def test_silence_goes_on_in_a_hall_as_a_wall_does_in_a_corridor() -> None:
    """Where walls are out of reach the plan predicts silence nearly as well as the rival, which knows no better."""
    of = densities(np.zeros(40))
    silent = np.log((1.0 - ECHO.hidden) * (1.0 - of.stray) + ECHO.hidden * np.exp(of.either))
    assert (silent - of.either)[20:].mean() > -0.1


def test_an_echo_behind_a_silent_ping_is_news() -> None:
    of = densities(np.array([1.2, 1.2, 0.0, 0.0, 1.2]))
    assert of.alike[4] < 0.1 * of.alike[1]
