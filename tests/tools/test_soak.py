# SPDX-License-Identifier: MIT
"""`make soak` in short: seconds of the real firmware around the wraps of its clock, and the seam of the walk."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from board_runs import needs_twin
from echostep.plan import load_plan
from echostep.xsens import MtxReader
from echostep_app.simulation.devices.board import PythonBoard
from echostep_app.simulation.stimulus import NO_SYNC
from places import PLAN
from reliability import soak
from reliability.soak_walk import EndlessWalk
from twin.late_clock import HALF_WRAP, WRAP

ROUND = ((16.0, 7.5), (24.0, 7.5), (24.0, 2.0), (2.0, 2.0), (2.0, 7.5), (16.0, 7.5))


@pytest.mark.long
@needs_twin
@pytest.mark.parametrize(("wrap", "wraps"), [(HALF_WRAP, 0), (WRAP, 1)])
def test_seconds_of_the_real_firmware_around_a_wrap_of_its_clock(tmp_path: Path, wrap: int, wraps: int) -> None:
    measured = soak.run(8.0, tmp_path, wrap, 4.0)
    failed = {figure.what for figure in soak.figures(measured) if figure.passed is False}
    assert failed <= {"memory of the host", "memory of the twin"}  # of seconds says nothing
    assert soak.wraps(measured.clock).measured == str(wraps)
    assert measured.outcome.tracking == 1.0


@pytest.mark.slow
def test_rounds_of_the_walk_have_no_seam() -> None:
    walk = EndlessWalk(load_plan(PLAN), 1, PythonBoard(1), ROUND)
    edges = np.flatnonzero(walk.rows["sync_us"] != NO_SYNC)
    edges_us = 1000 * edges + walk.rows["sync_us"][edges]
    apart_us = np.diff([*edges_us, edges_us[0] + 1000 * walk.length_ms])
    assert len(edges) == len(walk.samples)
    assert set(apart_us.tolist()) <= {10_000, 10_001}
    ends_s = [0.0, 1e-3 * walk.length_ms]
    assert max(np.ptp(np.interp(ends_s, walk.truth[:, 0], walk.truth[:, k])) for k in (1, 2)) < 0.1
    reader, arrived = MtxReader(), []
    for chunk in islice(walk.mtx_chunks(), len(walk.samples) + 200):
        arrived.append(chunk.t_arrival_ns)
        reader.feed(chunk.data)
    assert np.diff(arrived).max() < 30e6
    assert reader.counts.good >= len(walk.samples) + 199
    assert reader.counts.lost == reader.counts.bad_counter == 0
