# SPDX-License-Identifier: MIT
"""Two real firmwares, on belt and foot: their findings, and the belt's alarm."""

from __future__ import annotations

import math

from board_runs import needs_twin
from echostep.ports.chunks import portion_of
from echostep.tracker import Tracker
from echostep_app.board.faults.health import all_findings
from echostep_app.wearer.alarm import watch_of
from odometry.foot_board_walk import walk
from walks import PLAN

pytestmark = needs_twin


def test_two_boards_have_no_findings() -> None:
    tracker = Tracker(PLAN)
    for chunk in walk().chunks[:2_000]:
        tracker.feed(chunk)
    assert all_findings(tracker.streams.reports, tracker.streams.foot_reports) == []


def test_the_belt_of_the_real_firmware_tells_an_upright_trunk_and_no_fall() -> None:
    tracker, tilts_deg = Tracker(PLAN, seed=1), []
    watch = watch_of(tracker)
    chunks = walk().chunks
    for k in range(0, len(chunks), 500):
        tracker.take(portion_of(chunks[k : k + 500]))
        tilts_deg.append(math.degrees(watch.trunk_tilt_rad(tracker.front_end.newest_s)))
    known = [tilt for tilt in tilts_deg if not math.isnan(tilt)]
    assert len(known) > 0.5 * len(tilts_deg)
    assert max(known) < 20.0
    assert not watch.changes
