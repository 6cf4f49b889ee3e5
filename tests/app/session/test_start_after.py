# SPDX-License-Identifier: MIT
"""The start of a run after another one: wider than its last place, with any heading, at its height while that is known."""

from __future__ import annotations

import math

from echostep.height.levels import Air, ClimbSettings
from echostep.tracker.state import LastPlace
from echostep_app.session.last_place import MOVED_M, start_after
from echostep_simulation.world.tower import STOREY_M

ZERO_M = 100.0  # height by pressure on the lowest floor


AWAY_S = 60.0


CLIMBING = ClimbSettings()


def test_the_start_is_wider_than_the_place_and_has_any_heading() -> None:
    start = start_after(LastPlace(3.0, 4.0, 0.2, 1, Air(ZERO_M, 0.1)), AWAY_S, CLIMBING)
    assert start.pose is not None
    assert (start.pose.x_m, start.pose.y_m, start.pose.level) == (3.0, 4.0, 1)
    assert (start.sd_m, start.heading_sd_rad) == (math.hypot(0.2, MOVED_M), math.pi)
    assert start.after_pause
    assert start.air is not None
    assert start.air.zero_m == ZERO_M
    assert 0.15 < start.air.sd_m < 0.25


def test_hours_make_the_pressure_worthless() -> None:
    start = start_after(LastPlace(3.0, 4.0, 0.2, 1, Air(ZERO_M, 0.1)), 3600.0, CLIMBING)
    assert start.air is not None
    assert start.air.sd_m > STOREY_M
