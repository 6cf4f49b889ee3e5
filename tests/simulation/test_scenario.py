# SPDX-License-Identifier: MIT
"""The whole simulated scenario: equal seeds, equal chunks."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from echostep.board import messages as m
from echostep.board.frames import BoardReader
from echostep.ports.chunks import BOARD, MTX, Chunk
from echostep.xsens import MtxReader
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import Scenario, demo_scenario
from walks import PLAN


@pytest.mark.slow
def test_equal_seeds_give_equal_chunks_in_order() -> None:
    def run(seed: int) -> list[Chunk]:
        return list(Scenario(PLAN, ((2.0, 7.5), (9.0, 7.5)), seed, PythonBoard(seed)).chunks())

    first, again, other = run(1), run(1), run(2)
    assert first == again
    assert first != other
    times = [chunk.t_arrival_ns for chunk in first]
    assert times == sorted(times)
    assert {chunk.port for chunk in first} == {BOARD, MTX}
    assert max(len(chunk.data) for chunk in first if chunk.port == MTX) < 59  # cut by the adapter's timer of 1 ms
    reader, mtx_reader = BoardReader(), MtxReader()
    for chunk in first:
        (reader if chunk.port == BOARD else mtx_reader).feed(chunk.data)
    assert reader.counts.rejected == reader.counts.lost == 0
    assert mtx_reader.counts.lost == mtx_reader.counts.skipped_bytes == mtx_reader.counts.bad_checksum == 0


def test_a_configuration_reaches_the_board() -> None:
    wanted = m.Configure(m.Sensors.RANGER_LEFT, m.Schedule.SEQUENTIAL, 50, 5, m.PressureMode.HIGH_SPEED)
    scenario = Scenario(PLAN, ((2.0, 7.5), (6.0, 7.5)), 1, PythonBoard(1), configure=wanted)
    reader = BoardReader()
    found = [x for c in scenario.chunks() if c.port == BOARD for x in reader.feed(c.data)]
    assert [x for x in found if isinstance(x, m.Configuration)][-1].sensors == m.Sensors.RANGER_LEFT
    assert not any(isinstance(x, m.Gyros) for x in found)


class Mute:
    """A board whose bytes go elsewhere, as with the twin on a pseudo terminal."""

    def advance(self, rows: NDArray[Any]) -> list[tuple[int, bytes]]:
        self.ms = getattr(self, "ms", 0) + len(rows)
        return []

    def send(self, sent: bytes) -> None: ...
    def fault(self, text: str) -> None: ...
    def close(self) -> None: ...


def test_a_scenario_can_be_paced_without_a_boards_bytes() -> None:
    board = Mute()
    for chunk in Scenario(PLAN, ((2.0, 7.5), (6.0, 7.5)), 1, board).chunks():
        assert abs((chunk.t_arrival_ns - 1_000_000_000) * 1e-6 - board.ms) <= 60


def test_each_sample_has_its_sync_edge() -> None:
    scenario = Scenario(PLAN, ((2.0, 7.5), (6.0, 7.5)), 1, PythonBoard(1))
    reader = BoardReader()
    found = [x for c in scenario.chunks() if c.port == BOARD for x in reader.feed(c.data) if isinstance(x, m.Sync)]
    ticks_s = np.array([x.ticks for x in found]) * 0.5e-6
    assert np.abs(ticks_s - scenario.mtx.t_s[: len(ticks_s)]).max() < 2e-6


def test_the_demo_walk_passes_no_wall() -> None:
    """Doors are wide enough, corners are not cut."""
    path = demo_scenario(PLAN, 1, PythonBoard(1)).walk.trunk_m[::50]
    for x0, y0, x1, y1 in PLAN.levels[0].walls:
        a, b = np.array([x0, y0]), np.array([x1, y1])
        share = np.clip((path - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        assert np.hypot(*(path - a - share[:, None] * (b - a)).T).min() > 0.3


def test_the_truth_file_is_the_trunk_at_fifty_hertz(tmp_path: Any) -> None:
    scenario = Scenario(PLAN, ((2.0, 7.5), (6.0, 7.5)), 1, PythonBoard(1))
    scenario.write_truth(tmp_path / "truth.csv", 2.0)
    table = np.loadtxt(tmp_path / "truth.csv", delimiter=",", skiprows=1)
    assert (tmp_path / "truth.csv").read_text().startswith("t_s,x,y,heading_rad,z\n")
    assert np.allclose(np.diff(table[:, 0]), 0.02)
    assert table[0] == pytest.approx([2.0, *scenario.walk.trunk_m[0], scenario.walk.heading_rad[0], 0.0], abs=1e-5)
