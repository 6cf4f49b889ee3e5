# SPDX-License-Identifier: MIT
"""`make faults`: its list of faults exists in the twin, its judgement of gaps, its table; two faults of the host in short."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from board_runs import ROOT, Bench, needs_twin
from echostep.ports.chunks import BOARD, MTX
from echostep.recording import open_recording
from echostep_app.simulation.devices.board import PythonBoard
from reliability import faults
from reliability.fault_outcomes import NORMAL_S, FaultOutcome, judge_streams, table
from twin.host_faults import kill, plug_mtx, unplug_mtx
from twin.live_walk import HostFault, LiveWalk


@needs_twin
def test_every_fault_of_the_matrix_exists() -> None:
    bench = Bench()
    try:
        for fault in faults.FAULTS:
            for switch in (*fault.switches, *fault.end):
                bench.fault(switch)
        bench.run(1)
    finally:
        bench.board.close()


def test_the_matrix_has_a_fault_of_each_switch() -> None:
    names = re.findall(r"^\| (`[a-z_0-9`, ]+`) \| .* \|$", (ROOT / "tools/twin/README.md").read_text(), flags=re.M)
    known = {name for group in names for name in re.findall(r"`(\w+)`", group)}
    used = {switch.split("=")[0] for fault in faults.FAULTS for switch in fault.switches}
    assert used <= known
    like_others = {"belt", "part_calf", "part_belt", "imu_calf", "imu_belt", "pulse_right", "maxsonar_right"}
    without_an_effect_alone = {"reset", "brown_out_fuse", "usb"}
    of_another_board = {"icm20649"}  # tests/firmware/test_twin_foot.py
    # tests/firmware
    of_the_wiring = {
        "miso_undefined",
        "miso_resistor",
        "spi_errors",
        "twi_errors",
        "hum",
        "glitch",
        "echo_resistor",
        "jtag_fuse",
        "d13_led",
    }
    of_the_host = {"host_system", "host_hub"}  # tests/firmware/test_twin_usb.py
    assert known - used <= like_others | without_an_effect_alone | of_another_board | of_the_wiring | of_the_host


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
