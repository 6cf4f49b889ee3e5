# SPDX-License-Identifier: MIT
"""`make soak` in short: seconds of the real firmware, seconds in which the clock of a board wraps, and the seam of the tour."""

from __future__ import annotations

import os
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from board_runs import ROOT, needs_twin
from echostep.board.frames import encode
from echostep.board.messages import Configure, PressureMode, Schedule
from echostep.plan.model import load_plan
from echostep.ports.chunks import MTX
from echostep.xsens import MtxReader
from echostep_app.simulation.devices.board import PythonBoard, Sent
from echostep_app.simulation.stimulus import NO_SYNC
from reliability import long_tour, soak
from twin.late_clock import HALF_WRAP, TICKS_S, WRAP

ROUND = ((16.0, 7.5), (24.0, 7.5), (24.0, 2.0), (2.0, 2.0), (2.0, 7.5), (16.0, 7.5))
WRAP_S = WRAP / TICKS_S


class LateBoard(PythonBoard):
    """A Python board that has been on for so many milliseconds when the walk begins."""

    def __init__(self, late_ms: int = 0) -> None:
        super().__init__(1)
        self._ms = self._late_ms = late_ms
        self.send(encode(Configure(0xFF, Schedule.CONCURRENT, 200, 10, PressureMode.HIGH_SPEED), 0))
        self.trace: list[tuple[int, str]] = []
        self.pid = os.getpid()

    def fault(self, text: str) -> None:
        """No stray edge: it has no inputs."""

    def advance(self, rows: np.ndarray) -> Sent:
        return [(t_ns - self._late_ms * 1_000_000, sent) for t_ns, sent in super().advance(rows)]


def check(measured: soak.Measured, folder: Path, wraps: int) -> None:
    measured.replays = soak.replays(folder)
    failed = {what: value for what, value, _, passed in soak.figures(measured) if passed is False}
    assert failed.keys() <= {"memory of the host", "memory of the twin"}  # of seconds says nothing
    assert measured.wraps == wraps
    assert measured.tracking == 1.0


@pytest.mark.long
@needs_twin
def test_seconds_of_the_real_firmware(tmp_path: Path) -> None:
    check(soak.run(5.0, tmp_path), tmp_path, 0)


@pytest.mark.long
@needs_twin
@pytest.mark.parametrize(("wrap", "wraps"), [(HALF_WRAP, 0), (WRAP, 1)])
def test_seconds_of_the_real_firmware_around_a_wrap_of_its_clock(tmp_path: Path, wrap: int, wraps: int) -> None:
    check(soak.run_before_wrap(8.0, tmp_path, wrap, 4.0), tmp_path, wraps)


@pytest.mark.long
@pytest.mark.process
def test_seconds_around_the_wrap_of_the_boards_clock(tmp_path: Path) -> None:
    began_ms = int(1e3 * WRAP_S) - 4000
    check(soak.run(8.0, tmp_path, LateBoard(began_ms), 1e-3 * began_ms), tmp_path, 1)


@pytest.mark.slow
def test_rounds_of_the_tour_have_no_seam() -> None:
    tour = long_tour.LongTour(load_plan(ROOT / "host/core/echostep/plans/demo.json"), 1, LateBoard(), ROUND)
    edges = np.flatnonzero(tour._rows["sync_us"] != NO_SYNC)
    edges_us = 1000 * edges + tour._rows["sync_us"][edges]
    apart_us = np.diff([*edges_us, edges_us[0] + 1000 * tour._length_ms])
    assert len(edges) == tour._sample_count
    assert set(apart_us.tolist()) <= {10_000, 10_001}
    assert np.abs(tour.true_m(np.array([0.0])) - tour.true_m(np.array([1e-3 * tour._length_ms - 1e-6]))).max() < 0.1
    reader, arrived = MtxReader(), []
    for chunk in islice((c for c in tour._mtx() if c.port == MTX), tour._sample_count + 200):
        arrived.append(chunk.t_arrival_ns)
        reader.feed(chunk.data)
    assert np.diff(arrived).max() < 30e6
    assert reader.counts.good >= tour._sample_count + 199
    assert reader.counts.lost == reader.counts.bad_counter == 0
