# SPDX-License-Identifier: MIT
"""The Python board, and a board in a child process."""

from __future__ import annotations

import itertools
import sys
from collections import Counter
from contextlib import closing
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from board_runs import quiet_rows
from echostep.board import messages as m
from echostep.board.frames import BoardReader, encode
from echostep.errors import EchostepError
from echostep_simulation.devices.board import BoardProcess, PythonBoard
from echostep_simulation.stimulus import ROW
from simulation.simulated import heard


def rows_of(n: int, own_us: tuple[int, int] = (5_831, 7_000), cross_us: tuple[int, int] = (0, 0)) -> NDArray[Any]:
    rows = quiet_rows(n)
    rows["own_us"], rows["cross_us"] = own_us, cross_us
    return rows


def pings_of(rows: NDArray[Any], schedule: m.Schedule | None = None) -> list[m.Ping]:
    """Of the Python board; with a schedule those after the first half second."""
    board, reader = PythonBoard(seed=1), BoardReader()
    if schedule is not None:
        board.send(encode(m.Configure(0xFF, schedule, 100, 5, 0), 0))
        heard(board.advance(rows_of(500)), reader)
    return [x for x in heard(board.advance(rows), reader) if isinstance(x, m.Ping)]


def test_the_python_board_sends_every_stream_at_its_rate() -> None:
    found = heard(PythonBoard(seed=1).advance(rows_of(10_000)))
    count = Counter(type(x).__name__ for x in found)
    assert isinstance(found[0], m.Identity)
    assert isinstance(found[1], m.Configuration)
    assert count["Ping"] >= 280
    assert abs(count["Gyros"] - 2_000) <= 2
    assert abs(count["Sync"] - 1_000) <= 2
    assert abs(count["Compass"] - 100) <= 2
    assert abs(count["Pressure"] - 90) <= 2
    assert 9 <= count["Status"] <= 10
    rates = [x[1:] for x in found if isinstance(x, m.Gyros)]
    assert set(rates[:112]) == {(-32768, -32768, -32768)}  # the self-test
    assert set(rates[112:]) == {(41, -82, 5)}
    assert {x[1:] for x in found if isinstance(x, m.GyroHealth)} == {
        (gyro, -34, m.SelfTest.PASSED, -221, 221) for gyro in m.Gyro
    }
    assert {x.time_of_flight_us for x in found if isinstance(x, m.Ping) and x.ranger == m.Ranger.LEFT} == {5_831}
    assert [x.edge for x in found if isinstance(x, m.Sync)][:3] == [0, 1, 2]
    assert {x.ticks % 20_000 for x in found if isinstance(x, m.Sync)} == {666}


def test_concurrent_pings_are_jittered_and_a_cycle_apart() -> None:
    found = pings_of(rows_of(10_000))
    for ranger in m.Ranger:
        gaps = np.diff([x.ticks for x in found if x.ranger == ranger]) / 2_000
        assert gaps.min() >= 60.0
        assert gaps.max() <= 80.0
        assert gaps.std() > 0.3


def test_commands_are_answered_and_obeyed() -> None:
    board, reader = PythonBoard(seed=1), BoardReader()
    heard(board.advance(rows_of(100)), reader)
    wanted = m.Configure(
        m.Sensors.RANGER_LEFT | m.Sensors.SYNC, m.Schedule.SEQUENTIAL, 250, 99, m.PressureMode.HIGH_RESOLUTION
    )
    board.send(encode(m.Identify(), 0) + encode(m.ClockQuery(0x1234), 1) + encode(wanted, 2))
    found = heard(board.advance(rows_of(20)), reader)
    assert any(isinstance(x, m.Identity) for x in found)
    assert [x.token for x in found if isinstance(x, m.ClockReply)] == [0x1234]
    assert [x for x in found if isinstance(x, m.Configuration)][-1][1:] == (wanted.sensors, 1, 200, 20, 1, 0)
    heard(board.advance(rows_of(200)), reader)
    later = heard(board.advance(rows_of(3_000)), reader)
    assert {type(x) for x in later} == {m.Ping, m.Sync, m.Identity, m.Status}
    assert {x.ranger for x in later if isinstance(x, m.Ping)} == {m.Ranger.LEFT}


@pytest.mark.parametrize("block_ms", [1, 7, 50, 100])
@pytest.mark.parametrize("schedule", m.Schedule)
def test_no_echo_is_looked_at_in_other_milliseconds_than_those_announced(schedule: m.Schedule, block_ms: int) -> None:
    """The schedule changes on the way, and the left ranger is off for a while."""
    knowing, all_ears, rng, asked = PythonBoard(seed=1), PythonBoard(seed=1), np.random.default_rng(2), 0
    orders = {
        700: (0xFF, schedule),
        2_100: (0xFF & ~m.Sensors.RANGER_LEFT, schedule),
        2_800: (0xFF, m.Schedule.CONCURRENT),
    }
    for start in range(0, 5_600, block_ms):
        if start in orders:
            sensors, then = orders[start]
            for board in (knowing, all_ears):
                board.send(encode(m.Configure(sensors, then, 200, 10, 0), 0))
        rows = rows_of(block_ms)
        rows["own_us"], rows["cross_us"] = rng.integers(1_000, 30_000, (2, block_ms, 2))
        ranging = knowing.may_range(block_ms)
        asked += int(ranging.sum())
        fewer = rows.copy()
        fewer["own_us"][~ranging], fewer["cross_us"][~ranging] = 0, 0
        assert knowing.advance(fewer) == all_ears.advance(rows)
    assert asked < 5_600 / 3 or block_ms == 100


def test_simultaneous_pings_are_fired_in_pairs() -> None:
    found = pings_of(rows_of(3_000), m.Schedule.SIMULTANEOUS)
    fired = [[x.ticks for x in found if x.ranger == ranger] for ranger in m.Ranger]
    assert 44 <= len(fired[0]) <= 46
    assert fired[0] == fired[1]


def test_sequential_pings_take_turns_every_seventy_milliseconds() -> None:
    found = pings_of(rows_of(3_000), m.Schedule.SEQUENTIAL)
    assert 40 <= len(found) <= 44
    assert all(a.ranger != b.ranger for a, b in itertools.pairwise(found))
    assert all(abs(b.ticks - a.ticks - 140_000) < 8_000 for a, b in itertools.pairwise(found))


def test_the_other_rangers_echo_counts_when_it_comes_first() -> None:
    """It moves with the jitter between the triggers; the own echo does not [host/docs/design/bench.md]."""
    assert {x.outcome for x in pings_of(rows_of(2_000, (0, 0)))} == {m.Outcome.NO_ECHO}
    late_us = 30_000  # of the left ranger's ping at the right one, and the other way round
    found = pings_of(rows_of(10_000, (0, 0), (40_000, 40_000)))
    triggers = {r: np.array([x.ticks for x in found if x.ranger == r]) / 2 for r in m.Ranger}
    crossed = [x for x in found if x.outcome == m.Outcome.ECHO]
    assert crossed
    for ping in crossed:
        came_us = ping.ticks / 2 + ping.time_of_flight_us
        assert np.abs(triggers[m.Ranger(1 - ping.ranger)] + 40_000 - came_us).min() <= 1
    assert np.std([x.time_of_flight_us for x in crossed]) > 500
    own = pings_of(rows_of(5_000, (900, 900), (late_us, late_us)))
    assert {x.time_of_flight_us for x in own} == {900}


@given(st.lists(st.binary(max_size=40), max_size=5))
def test_noise_from_the_host_does_no_harm(noise: list[bytes]) -> None:
    board = PythonBoard(seed=1)
    for part in noise:
        board.send(part)
    board.send(b"\0" + encode(m.ClockQuery(7), 0))
    assert any(isinstance(x, m.ClockReply) for x in heard(board.advance(rows_of(5))))


def test_the_python_board_has_no_fault_switches() -> None:
    with pytest.raises(EchostepError, match="srf_left=nack"):
        PythonBoard().fault("srf_left=nack")


ECHO_BOARD = (
    f"SIZE = {ROW.itemsize}"
    + """
import sys
def take(n):
    b = sys.stdin.buffer.read(n)
    if len(b) < n: sys.exit(0)
    return b
t = 0
while True:
    head = take(5)
    body = take(int.from_bytes(head[1:], "little"))
    if head[:1] == b"Q": sys.exit(0)
    if head[:1] == b"R": t += len(body) // SIZE * 1000000
    stamp = t.to_bytes(8, "little")
    for kind, out in ((b"B", b"hello"), (b"T", b"trigger left"), (b"A", b"")) if head[:1] == b"R" else ():
        sys.stdout.buffer.write(kind + (8 + len(out)).to_bytes(4, "little") + stamp + out)
    sys.stdout.buffer.flush()
"""
)


@pytest.mark.process
def test_a_board_process_advances_in_lockstep() -> None:
    with closing(BoardProcess([sys.executable, "-c", ECHO_BOARD])) as board:
        board.send(b"from the host")
        assert board.advance(rows_of(50)) == [(50_000_000, b"hello")]
        assert board.advance(rows_of(10)) == [(60_000_000, b"hello")]
        assert board.trace == [(50_000_000, "trigger left"), (60_000_000, "trigger left")]


@pytest.mark.process
@pytest.mark.parametrize(
    "program",
    [
        "import sys; sys.exit(3)",
        "print('hello, this is no board' * 9)",
        "import sys; sys.stdin.buffer.read(5); sys.exit(0)",
    ],
)
def test_a_board_that_fails_is_named(program: str) -> None:
    with closing(BoardProcess([sys.executable, "-c", program])) as board, pytest.raises(EchostepError, match="python"):
        board.advance(rows_of(10))


@pytest.mark.process
def test_a_board_that_hangs_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("echostep_simulation.devices.board.TIMEOUT_S", 0.5)
    mute = [sys.executable, "-c", "import sys; sys.stdin.buffer.read()"]
    with closing(BoardProcess(mute)) as board, pytest.raises(EchostepError, match="did not answer"):
        board.advance(rows_of(10))


@pytest.mark.process
@pytest.mark.parametrize("command", [[], ["/no/such/board"]])
def test_a_board_that_cannot_start_is_named(command: list[str]) -> None:
    with pytest.raises(EchostepError, match="cannot start"):
        BoardProcess(command)
