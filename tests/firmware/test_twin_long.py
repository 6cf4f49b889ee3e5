# SPDX-License-Identifier: MIT
"""The real firmware over times that wrap its clocks, in the twin."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from board_runs import ROOT, TWIN, Bench, kinds, needs_twin, pings
from echostep.board import messages as m
from echostep.board.subscription import SUBSCRIBE
from echostep.simulation.devices.board import BoardProcess
from echostep.simulation.stimulus import NO_SYNC, ROW
from waiting import PATIENCE_S

pytestmark = needs_twin
HALF_WRAP_S = 2**31 / 2e6  # after which a comparison of two times turns round [firmware/board.h]
START_BEFORE_S = 4.0
SECOND = np.zeros(1_000, ROW)
SECOND["own_us"], SECOND["sync_us"] = 500, NO_SYNC


def firmware_whose_clock_starts_at(overflows: int, folder: Path) -> Path:
    """The firmware with another first value of the upper half of its clock."""
    if not shutil.which("avr-gcc"):
        pytest.skip("avr-gcc is missing")
    build = [
        "make",
        "-s",
        "-C",
        ROOT / "firmware",
        f"BUILD={folder}",
        f"CLOCK_START={overflows}u",
        folder / "echostep.elf",
    ]
    subprocess.run(list(map(str, build)), check=True, timeout=PATIENCE_S)
    return folder / "echostep.elf"


@pytest.mark.parametrize("wrap_s", [HALF_WRAP_S, 2 * HALF_WRAP_S])
def test_nothing_happens_when_the_clock_wraps(tmp_path: Path, wrap_s: float) -> None:
    """17.9 minutes after the start comparisons of times turn round, after 35.8 the clock itself."""
    elf = firmware_whose_clock_starts_at(int((wrap_s - START_BEFORE_S) * 2e6) >> 16, tmp_path)
    for kit in ("papers", "2026"):
        bench = Bench(BoardProcess([str(TWIN), "--elf", str(elf)]))
        bench.fault(f"kit={kit}")
        bench.run(300)
        bench.ask(SUBSCRIBE)
        bench.run(1_500)
        ticks = bench.status.ticks
        rates = [kinds(bench.run(1_000)) for _ in range(4)]
        bench.board.close()
        assert (bench.status.ticks ^ ticks) >> 31  # the wrap lies between
        assert min(rate["Ping"] for rate in rates) >= 29
        assert {rate["Gyros"] for rate in rates} <= {199, 200, 201}
        assert {rate["Status"] for rate in rates} == {1}
        assert min(rate["Pressure"] for rate in rates) >= 8
        assert not any(v for k, v in bench.status._asdict().items() if k.startswith(("dropped_", "errors_")))


@pytest.fixture
def left_ranger(bench: Bench) -> Bench:
    """A board that reads nothing but a left pulse ranger, which answers."""
    bench.fault("part_ranger_left=pulse")
    bench.fault("part_ranger_right=pulse")
    bench.run(1_000, SECOND)
    bench.ask(m.Configure(m.Sensors.RANGER_LEFT, m.Schedule.CONCURRENT, 10, 1, m.PressureMode.HIGH_SPEED))
    bench.run(1_005, np.resize(SECOND, 1_005))
    assert outcomes(bench.messages[-15:]) == {m.Outcome.ECHO}
    return bench


def outcomes(found: list[m.Message]) -> set[int]:
    return {p.outcome for p in pings(found, m.Ranger.LEFT)}


@pytest.mark.long
def test_one_stray_edge_does_not_stop_the_left_ranger_later(left_ranger: Bench) -> None:
    """A glitch on the echo line while no ping owns it counts as a SyncOut edge; 17.9 minutes later it must not look like a recent one."""
    left_ranger.fault("glitch=left")
    for _ in range(int(HALF_WRAP_S) + 5):
        found = left_ranger.run(1_000, SECOND)
        left_ranger.messages.clear()
    assert outcomes(found) == {m.Outcome.ECHO}


@pytest.mark.long
def test_a_stray_edge_a_minute_costs_only_what_it_covers(left_ranger: Bench) -> None:
    """Over more than one wrap of the clock."""
    disturbed, others, counted = 0, set(), 0
    for second in range(int(2 * HALF_WRAP_S) + 60):
        if second % 60 == 0:
            left_ranger.fault("glitch=left")
        found = left_ranger.run(1_000, SECOND)
        left_ranger.messages.clear()
        counted += len(pings(found, m.Ranger.LEFT))
        if second % 60:
            others |= outcomes(found)
        else:
            disturbed += len([p for p in pings(found, m.Ranger.LEFT) if p.outcome == m.Outcome.BUS_ERROR])
    assert others == {m.Outcome.ECHO}
    assert disturbed <= 2 * (second // 60 + 1)
    assert counted >= 15.0 * second
    assert left_ranger.reader.counts.lost == left_ranger.reader.counts.rejected == 0
