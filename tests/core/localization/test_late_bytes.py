# SPDX-License-Identifier: MIT
"""Bytes that waited in the ports of a stopped program come after a dropout: what they say of the wearer's place is no longer so."""

from __future__ import annotations

import pytest

from board_runs import ROOT
from echostep.localization import TrackStatus
from echostep.plan import load_plan
from echostep.tracker import Tracker
from page.frames import told


@pytest.mark.parametrize(
    ("t_s", "status"), [(27.1, TrackStatus.LOST), (33.1, TrackStatus.TRACKING), (34.0, TrackStatus.TRACKING)]
)
def test_an_estimate_that_a_dropout_has_overtaken_claims_nothing(t_s: float, status: TrackStatus) -> None:
    tracker = Tracker(load_plan(ROOT / "host/core/echostep/plans/demo.json"))
    tracker._publish(None, told(t_s=33.4, status=TrackStatus.LOST))
    late = tracker._publish(None, told(x_m=12.0, t_s=t_s))
    assert late.status is status
    assert late.t_s == max(t_s, 33.4)
    assert late.x_m == 12.0
    assert (late.xx_m2 > 50.0) == (status is TrackStatus.LOST)
