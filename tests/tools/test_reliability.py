# SPDX-License-Identifier: MIT
"""`make faults`, `make soak` and `make fuzz-host` in short: the twin has each fault, gaps are judged, mutated inputs are no fault."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from board_runs import Bench, needs_twin
from echostep.ports.chunks import BOARD, MTX
from echostep.recording import open_recording
from echostep_simulation.devices.board import PythonBoard
from reliability import faults, soak
from reliability.fault_outcomes import NORMAL_S, FaultOutcome, judge_streams, table
from reliability.fuzz import host as fuzz_host
from reliability.fuzz.targets import TARGETS
from twin.host_faults import kill, plug_mtx, unplug_mtx
from twin.late_clock import HALF_WRAP, WRAP
from twin.live_walk import HostFault, LiveWalk


@needs_twin
def test_every_fault_of_the_matrix_exists() -> None:
    bench = Bench()
    with closing(bench.board):
        for fault in faults.FAULTS:
            bench.fault(*fault.switches, *fault.end)
        bench.run(1)


def test_gaps_are_judged() -> None:
    begin_s, end_s = 20.0, 50.0
    regular = [begin_s + 0.1 * k for k in range(round(10 * (end_s - begin_s)))]
    times_s = {name: [t for t in regular if not begin_s + 2.0 < t < begin_s + 5.0] for name in NORMAL_S}
    often = [begin_s + 0.02 * k for k in range(round(50 * (end_s - begin_s)))]
    dense = dict.fromkeys(("thigh", "calf", "belt", "sync", "foot"), often)
    outcome = FaultOutcome("x=y")
    judge_streams(outcome, times_s | dense, begin_s, end_s)
    assert set(outcome.silent_s) == {"left", "right", "pressure", "compass"}
    assert outcome.whole_s is not None
    assert abs(outcome.whole_s - 5.0) < 0.11
    judge_streams(outcome, {name: [] for name in NORMAL_S}, begin_s, end_s)
    assert outcome.whole_s is None
    assert "| `x=y` | 0 | all 30.0 s | never |" in table([outcome])


@pytest.mark.long
def test_a_computer_that_sleeps_leaves_a_gap_and_no_false_claim() -> None:
    asleep = faults.TwinFault((), (), 10.0, (BOARD, MTX), "the computer sleeps")
    outcome = faults.run(asleep, PythonBoard(1))
    assert all(9.9 < seconds < 10.5 for seconds in outcome.silent_s.values())
    assert len(outcome.silent_s) == len(NORMAL_S)
    assert outcome.whole_s is not None
    assert outcome.whole_s < 10.5
    assert outcome.wrongly_sure == 0


@pytest.mark.long
@needs_twin
def test_a_killed_run_is_started_again_while_the_mtx_is_unplugged(tmp_path: Path) -> None:
    """In real time, through two live runs: each has its recording, and the ports are found again."""

    def begin(walk: LiveWalk) -> None:
        unplug_mtx(walk)
        kill(walk)
        plug_mtx(walk)
        walk.start("--start", "?")

    with LiveWalk(tmp_path / "walk", HostFault("kill -9", begin), 3.0, 10.0) as walk:
        outcome = walk.play()
        first, second = (open_recording(run / "walk.mcap") for run in walk.runs)
    assert sum(len(chunk.data) for chunk in first.chunks()) > 10_000
    assert first.own_damage.truncated
    assert {chunk.port for chunk in second.chunks()} == {BOARD, MTX}
    assert not second.own_damage.truncated
    assert set(outcome.silent_s) == set(NORMAL_S)
    assert outcome.wrongly_sure == 0


@pytest.mark.long
@needs_twin
@pytest.mark.parametrize(("wrap", "wraps"), [(HALF_WRAP, 0), (WRAP, 1)])
def test_seconds_of_the_real_firmware_around_a_wrap_of_its_clock(tmp_path: Path, wrap: int, wraps: int) -> None:
    measured = soak.run(8.0, tmp_path, wrap, 4.0)
    failed = {figure.what for figure in soak.figures(measured) if figure.passed is False}
    assert failed <= {"memory of the host", "memory of the twin"}  # of seconds says nothing
    assert soak.wraps(measured.clock).measured == str(wraps)
    assert measured.outcome.tracking == 1.0


# Inputs, where one takes tens of milliseconds, or some microseconds
COUNTS = {"dxf": 2, "ifc": 3, "osm": 3, "imdf": 5, "mtdata": 1000, "mtdata2": 1000, "packets": 1000}


@pytest.fixture(autouse=True)
def limited() -> Iterator[None]:
    before = signal.signal(signal.SIGALRM, fuzz_host.too_slow)
    yield
    signal.signal(signal.SIGALRM, before)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(TARGETS))
def test_mutated_inputs_are_no_fault(name: str) -> None:
    most = COUNTS.get(name, 20)
    count, data, text = fuzz_host.run_shard(name, 0, 60.0, most)
    assert text == "", data.hex()
    assert count == most


def test_inputs_that_once_were_faults_are_none() -> None:
    kept = list(fuzz_host.kept_inputs())
    assert len(kept) >= 4
    for name, data in kept:
        assert fuzz_host.fault(name, data) == ""
