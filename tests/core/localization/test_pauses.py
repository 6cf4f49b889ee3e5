# SPDX-License-Identifier: MIT
"""The height by pressure in a pause: it goes on with the same board, and begins anew with another one."""

from __future__ import annotations

import math

import pytest

from echostep.localization import Start
from echostep.plan import Pose
from echostep_simulation.world.tower import LIFT_AT, STOREY_M
from localization.test_last_place import filter_of, standing

PAUSE_S = 20.0  # a ride over two storeys
FIRST_M = 100.0  # height by pressure on the lowest floor
IN_LIFT = Start(Pose(*LIFT_AT, 0.0, 0), 0.05)


def levels_after_ride(height_m: float, barometer_starts: int) -> tuple[float, ...]:
    """Probability of each level after 3 s in the lift on the lowest floor, a pause, and 3 s at a height by pressure."""
    tracked = filter_of(IN_LIFT)
    for k in range(6):
        tracked.update(standing(0.5 * k, FIRST_M))
    begin_s = 3.0 + PAUSE_S
    for k in range(6):
        levels = tracked.update(standing(begin_s + 0.5 * k, height_m, barometer_starts)).levels
    return levels


@pytest.mark.parametrize("storeys", [0, 1, 2])
def test_a_ride_during_a_pause_is_seen_by_pressure(storeys: int) -> None:
    assert levels_after_ride(FIRST_M + storeys * STOREY_M, 0)[storeys] > 0.99


def test_heights_of_another_board_tell_no_ride() -> None:
    """A barometer that reads 7 m more: the cloud in the lift stays where it was, and the search beside it has all levels alike."""
    levels = levels_after_ride(FIRST_M + 2.0 * STOREY_M, 1)
    assert levels[2] == pytest.approx(levels[1], abs=0.02)
    assert levels[0] > 0.8


def test_weather_makes_a_long_pause_worthless() -> None:
    cloud = filter_of(IN_LIFT).cloud
    cloud.lag_variance = 0.01
    for hours, least_m, most_m in ((0.01, 0.1, 0.2), (1.0, 3.0, 5.0), (8.0, 20.0, 40.0)):
        before = cloud.lag_variance
        cloud.let_lag_drift(3600.0 * hours)
        assert least_m < math.sqrt(cloud.lag_variance - before + 0.01) < most_m
