# SPDX-License-Identifier: MIT
"""Gaps after which the wearer may be elsewhere, and those after which not.

Bytes that waited in the ports of a stopped program come after a dropout.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from echostep.localization import Estimate, TrackStatus
from echostep.localization.unmeasured import LONG_S, PAUSE_S, UNOBSERVED_DOUBT, UnmeasuredWay
from echostep.path import UNOBSERVED_SD_M, MeasuredSegment, PathSegment
from echostep.tracker import Tracker
from walks import PLAN


def segment(t0_s: float, t1_s: float, length_m: float = 0.7, sd_m: float = 0.02, pings: int = 5) -> MeasuredSegment:
    """A segment straight ahead with its pings evenly on it."""
    path = PathSegment(t0_s, t1_s, length_m, 0.0, 0.0, 0.0, sd_m, 0.0, 1)
    t_s = np.linspace(t0_s, t1_s, pings)
    return MeasuredSegment(path, t_s, np.zeros(pings, np.int64), np.ones(pings))


def away(*segments: MeasuredSegment) -> list[bool]:
    """Whether the trunk may have left its cloud before the end of each segment."""
    way = UnmeasuredWay()
    return [bool(way.weighed(each)) and way.away >= UNOBSERVED_DOUBT for each in segments]


@pytest.mark.parametrize("pings", [0, 5])
def test_a_walk_has_no_gap(pings: int) -> None:
    assert not any(away(*(segment(0.5 * k, 0.5 * k + 0.5, pings=pings) for k in range(60))))


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_a_pause_is_one_that_nothing_covers(share: float) -> None:
    pause_s = share * PAUSE_S
    assert away(segment(0.0, 0.5), segment(0.5 + pause_s, 1.0 + pause_s)) == [False, share > 1.0]


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_a_long_unobserved_segment_is_a_gap(share: float) -> None:
    end_s = 0.5 + share * LONG_S
    silent = segment(0.5, end_s, sd_m=2.0 * UNOBSERVED_SD_M)
    assert away(segment(0.0, 0.5), silent, segment(end_s, end_s + 0.5)) == [False, share > 1.0, False]


@pytest.mark.parametrize(
    ("t_s", "status"), [(27.1, TrackStatus.LOST), (33.1, TrackStatus.TRACKING), (34.0, TrackStatus.TRACKING)]
)
def test_an_estimate_that_a_dropout_has_overtaken_claims_nothing(t_s: float, status: TrackStatus) -> None:
    tracker = Tracker(PLAN)
    tracking = Estimate(t_s, 12.0, 7.5, 0.01, 0.0, 0.01, 0.0, 0.02, 1, TrackStatus.TRACKING)
    tracker._publish(None, replace(tracking, x_m=2.0, t_s=33.4, status=TrackStatus.LOST))
    late = tracker._publish(None, tracking)
    assert late.status is status
    assert late.t_s == max(t_s, 33.4)
    assert late.x_m == 12.0
    assert (late.xx_m2 > 15.0) == (status is TrackStatus.LOST)
