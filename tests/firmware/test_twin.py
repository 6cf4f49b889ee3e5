# SPDX-License-Identifier: MIT
"""The real firmware in the twin: what it sends, that equal input gives equal bytes, and over times that wrap its clocks."""

from __future__ import annotations

import shutil
import subprocess
from collections import Counter
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from board_runs import ROOT, TWIN, Bench, kinds, needs_twin, pings
from echostep.board import messages as m
from echostep.timing.timeline import TICKS_PER_S
from echostep_simulation.devices.board import BoardProcess
from echostep_simulation.stimulus import NO_SYNC, ROW
from twin.late_clock import HALF_WRAP, TIMER_WRAP, WRAP, late_firmware

pytestmark = needs_twin


def test_everything_that_the_board_measures_arrives(bench: Bench) -> None:
    bench.run(1_000)
    found = bench.run(5_000)
    count = kinds(found)
    assert count["Ping"] >= 5 * 28
    assert abs(count["Gyros"] - 1_000) <= 2
    assert abs(count["Sync"] - 500) <= 2
    assert 45 <= count["Compass"] <= 51
    assert 42 <= count["Pressure"] <= 48
    assert count["Status"] == count["Identity"] == 5
    assert bench.reader.counts.lost == bench.reader.counts.rejected == 0
    assert {g[1:] for g in found if isinstance(g, m.Gyros)} == {(41, -82, 5)}
    assert Counter(g.gyro for g in found if isinstance(g, m.GyroHealth)) == dict.fromkeys(m.Gyro, 5)
    assert {g.temperature for g in found if isinstance(g, m.GyroHealth)} == {-34}  # 20 degC
    assert all(getattr(bench.status, name) == m.Fault.NONE for name in bench.status._fields if "fault" in name)
    assert {c.bearing for c in found if isinstance(c, m.Compass)} == {900}
    assert {(p.pressure, p.temperature) for p in found if isinstance(p, m.Pressure)} == {(405_296, 400)}
    assert {p.time_of_flight_us for p in pings(found, m.Ranger.LEFT)} == {5_831}
    assert {p.time_of_flight_us for p in pings(found, m.Ranger.RIGHT)} == {7_000}
    assert bench.status.healthy == 0x7F
    assert bench.status.memory_used < 2_200


def test_the_first_words_are_identity_and_configuration(bench: Bench) -> None:
    found = bench.run(500)
    assert isinstance(found[0], m.Identity)
    assert found[0].schema_hash == m.SCHEMA_HASH
    assert found[0].reset_cause == m.ResetCause.POWER_ON
    assert isinstance(found[1], m.Configuration)


def test_the_shipped_firmware_works_with_this_host(bench: Bench, tmp_path: Path) -> None:
    """The bytes that are flashed, whichever compiler made them, beside those that this machine's compiler has made."""
    shipped = tmp_path / "shipped.elf"
    to_elf = ["avr-objcopy", "-I", "ihex", "-O", "elf32-avr", "--rename-section", ".sec1=.text"]
    subprocess.run([*to_elf, ROOT / "host/app/echostep_app/firmware/echostep.hex", shipped], check=True)
    other = Bench(BoardProcess([str(TWIN), "--elf", str(shipped)]))
    with closing(other.board):
        found, expected = other.run(3_000), bench.run(3_000)
    assert isinstance(found[0], m.Identity)
    assert found[0].schema_hash == m.SCHEMA_HASH
    assert found[0][1:] == expected[0][1:], "of another version: make firmware"
    assert kinds(found).keys() == kinds(expected).keys()
    assert kinds(found)["Ping"] >= 2 * 28
    assert other.reader.counts.lost == other.reader.counts.rejected == 0
    assert other.status.healthy == 0x7F


def test_trigger_stamps_follow_the_bus(bench: Bench) -> None:
    bench.run(5_000)
    truth = [t_ns / 500 for t_ns, text in bench.board.trace if text == "trigger left"]
    stamps = [p.ticks for p in pings(bench.messages, m.Ranger.LEFT)]
    offsets = [stamp - t for stamp, t in zip(stamps, truth, strict=False)]
    assert len(offsets) > 60
    assert max(offsets) - min(offsets) <= 40  # ticks: 20 us


def test_commands_are_answered(bench: Bench) -> None:
    bench.run(500)
    bench.ask(m.Identify())
    bench.ask(m.ClockQuery(0x1234))
    wanted = m.Configure(
        m.Sensors.RANGER_LEFT | m.Sensors.SYNC, m.Schedule.SEQUENTIAL, 250, 99, m.PressureMode.HIGH_RESOLUTION
    )
    bench.ask(wanted._replace(more_sensors=0x81))  # of a newer host
    bench.ask(m.Subscribe(m.Reports.BOARD_HEALTH, 0x81))
    bench.ask(wanted)
    found = bench.run(50)
    assert any(isinstance(x, m.Identity) for x in found)
    assert [x.token for x in found if isinstance(x, m.ClockReply)] == [0x1234]
    assert [x[1:] for x in found if isinstance(x, m.Configuration)][-2:] == [(wanted.sensors, 1, 200, 20, 1, 0)] * 2
    assert kinds(found)["BoardHealth"] == 1
    bench.ask(m.Subscribe(0))
    bench.run(200)
    count = kinds(bench.run(2_000))
    assert set(count) <= {"Ping", "Sync", "Identity", "Status"}  # no gyro, and so none's health
    assert count["Ping"] >= 13


def test_sequential_pings_take_turns(bench: Bench) -> None:
    bench.run(500)
    bench.ask(m.Configure(0xFF, m.Schedule.SEQUENTIAL, 100, 5, 0))
    bench.run(300)
    found = [x for x in bench.run(3_000) if isinstance(x, m.Ping)]
    assert 40 <= len(found) <= 44
    assert all(a.ranger != b.ranger for a, b in zip(found, found[1:], strict=False))
    assert all(abs(b.ticks - a.ticks - 140_000) < 8_000 for a, b in zip(found, found[1:], strict=False))


def test_damaged_commands_are_counted(bench: Bench) -> None:
    bench.run(500)
    bench.board.send(b"\x05garbage\x00" + bytes(range(1, 200)) + b"\x00")
    bench.run(1_500)
    assert bench.status.bad_frames == 2


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
