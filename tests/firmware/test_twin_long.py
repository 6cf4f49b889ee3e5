# SPDX-License-Identifier: MIT
"""The real firmware over times that wrap its clocks, in the twin."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from board_runs import TWIN, Bench, kinds, needs_twin, pings
from echostep.board import messages as m
from echostep.timing.timeline import TICKS_PER_S
from echostep_simulation.devices.board import BoardProcess
from echostep_simulation.stimulus import NO_SYNC, ROW
from twin.late_clock import HALF_WRAP, TIMER_WRAP, WRAP, late_firmware

pytestmark = needs_twin
HALF_WRAP_S = HALF_WRAP / TICKS_PER_S
SECOND = np.zeros(1_000, ROW)
SECOND["own_us"], SECOND["sync_us"] = 500, NO_SYNC


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of the firmware that is built again; make rebuilds only the clock for each start."""
    if not shutil.which("avr-gcc"):
        pytest.skip("avr-gcc is missing")
    return tmp_path_factory.mktemp("late")


# Seconds from the start to the wrap: while parts are sought, during the self-test, and while all are read.
@pytest.mark.long
@pytest.mark.parametrize("before_s", [0.06, 0.6, 4.0])
@pytest.mark.parametrize("wrap", [HALF_WRAP, WRAP])
def test_nothing_happens_when_the_clock_wraps(folder: Path, wrap: int, before_s: float) -> None:
    """17.9 minutes after the start comparisons of times turn round, after 35.8 the clock itself."""
    start = wrap - int(before_s * TICKS_PER_S)
    for kit in ("papers", "2026", "foot"):
        status = check_run(late_firmware(start, folder / str(start)), kit)
        assert (status.ticks ^ start) >> 31  # the wrap lies between


@pytest.mark.parametrize("start", [TIMER_WRAP - 1, TIMER_WRAP - 40, TIMER_WRAP - 4_000, 3 * TIMER_WRAP // 2])
def test_the_timer_may_start_anywhere(folder: Path, start: int) -> None:
    """The bootloader leaves Timer1 at any value, also just before it wraps."""
    check_run(late_firmware(start, folder / str(start)), "2026")


def check_run(elf: Path, kit: str) -> m.Status:
    """Six seconds after a start: all that is wanted comes, nothing is lost. The last status."""
    bench = Bench(BoardProcess([str(TWIN), "--elf", str(elf)]))
    bench.fault(f"kit={kit}")
    bench.subscribe()
    bench.run(1_500)
    rates = [kinds(bench.run(1_000)) for _ in range(4)]
    bench.board.close()
    assert {rate["Status"] for rate in rates} == {1}
    if kit == "foot":
        assert min(rate["Foot"] for rate in rates) >= 220
        assert {x.errors for x in bench.messages if isinstance(x, m.FootHealth)} == {0}
    else:
        assert min(rate["Ping"] for rate in rates) >= 29
        assert {rate["Gyros"] for rate in rates} <= {199, 200, 201}
        assert min(rate["Pressure"] for rate in rates) >= 8
        assert not any(v for k, v in bench.status._asdict().items() if k.startswith("errors_"))
    assert not any(v for k, v in bench.status._asdict().items() if k.startswith("dropped_"))
    assert bench.reader.counts.lost == bench.reader.counts.rejected == 0
    return bench.status


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
