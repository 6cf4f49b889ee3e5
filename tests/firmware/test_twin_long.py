# SPDX-License-Identifier: MIT
"""The real firmware over times that wrap its clocks, in the twin."""

from __future__ import annotations

import numpy as np
import pytest

from board_runs import Bench, needs_twin, pings
from echostep.board import messages as m
from echostep.simulation.stimulus import NO_SYNC, ROW

pytestmark = needs_twin
HALF_WRAP_S = 2**31 / 2e6  # after which a comparison of two times turns round [firmware/board.h]


@pytest.mark.long
def test_one_stray_edge_does_not_stop_the_left_ranger_later(bench: Bench) -> None:
    """A glitch on the echo line while no ping owns it counts as a SyncOut edge; 17.9 minutes later it must not look like a recent one."""
    rows = np.zeros(1_000, ROW)
    rows["own_us"], rows["sync_us"] = 500, NO_SYNC
    bench.fault("part_ranger_left=pulse")
    bench.fault("part_ranger_right=pulse")
    bench.run(1_000, rows)
    bench.ask(m.Configure(m.Sensors.RANGER_LEFT, m.Schedule.CONCURRENT, 10, 1, m.PressureMode.HIGH_SPEED))
    bench.run(1_005, np.resize(rows, 1_005))
    assert {p.outcome for p in pings(bench.messages[-15:], m.Ranger.LEFT)} == {m.Outcome.ECHO}
    bench.fault("glitch=left")
    for _ in range(int(HALF_WRAP_S) + 5):
        found = bench.run(1_000, rows)
        bench.messages.clear()
    assert {p.outcome for p in pings(found, m.Ranger.LEFT)} == {m.Outcome.ECHO}
