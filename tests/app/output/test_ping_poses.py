# SPDX-License-Identifier: MIT
"""Where pings were sent: on the way of their segment, turned into the map, while the tracker is believed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from echostep.localization import Estimate, TrackStatus
from echostep.path import MeasuredSegment, PathSegment
from echostep_app.output.ping_poses import placed_pings
from echostep_app.session.acceptance.heard import SeenPings

# 2 m along the walk frame's x axis in 2 s; in the map, along its y axis to (5, 8)
SEGMENT = PathSegment(10.0, 12.0, 2.0, 0.0, 0.0, 0.0, 0.05, 0.01, 3)
MEASURED = MeasuredSegment(SEGMENT, np.array([9.9, 11.0, 12.0]), np.array([0, 1, 0]), np.array([1.0, math.nan, 2.0]))
END = Estimate(12.0, 5.0, 8.0, 0.01, 0.0, 0.01, 0.5 * math.pi, 0.01, 3, TrackStatus.TRACKING, level=2)


def test_pings_lie_on_the_way_to_the_estimate() -> None:
    ranger, x, y, axis, range_m = placed_pings(MEASURED, END).T
    assert ranger.tolist() == [0, 1, 0]
    assert x == pytest.approx([5.0, 5.0, 5.0])
    assert y == pytest.approx([6.0, 7.0, 8.0])  # one of before the segment: at its begin
    assert axis == pytest.approx([math.pi, 0.0, math.pi])
    assert np.isnan(range_m).tolist() == [False, True, False]


def test_in_a_turn_the_axis_turns_with_the_trunk() -> None:
    turning = replace(MEASURED, segment=replace(SEGMENT, heading0_rad=-0.4))
    axis = placed_pings(turning, END)[:, 3]
    assert axis == pytest.approx([math.pi - 0.4, -0.2, math.pi])


@pytest.mark.parametrize("status", [TrackStatus.UNCERTAIN, TrackStatus.LOST])
def test_no_ping_of_a_doubted_place(status: TrackStatus) -> None:
    assert len(placed_pings(MEASURED, replace(END, status=status))) == 0


def test_no_ping_of_a_way_that_was_not_observed() -> None:
    assert len(placed_pings(replace(MEASURED, segment=replace(SEGMENT, sd_m=2.0)), END)) == 0
    assert len(placed_pings(None, END)) == 0


def test_seen_pings_are_these_on_the_estimates_level() -> None:
    seen = SeenPings()
    seen.note(MEASURED, END)
    seen.note(None, END)
    assert len(seen.pings) == 3
    assert tuple(seen.pings[2]) == pytest.approx((5.0, 8.0, 2, math.pi, 0, 2.0))
