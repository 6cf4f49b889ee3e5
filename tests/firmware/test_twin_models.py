# SPDX-License-Identifier: MIT
"""The models of the twin: a probe program with faults, mistakes of the caller, the pseudo terminal."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import serial

from board_runs import ELF, TWIN, Bench, needs_twin, pings, quiet_rows
from echostep.board import messages as m
from echostep.board.frames import BoardReader
from echostep.errors import EchostepError
from echostep_simulation.devices.board import BoardProcess
from twin.run import PtyBoard
from waiting import PATIENCE_S

pytestmark = needs_twin
PROBE = Path(__file__).parent / "twin_probe.c"
TWI_AFTER_RESET, SPI_WRONG, STOPPED, PULLED_UP, TIMER_FLAGS = range(5)
STAMP_STEP_TICKS = 2


def probe(folder: Path, mode: int) -> BoardProcess:
    """The twin with the probe program, one case."""
    if not shutil.which("avr-gcc"):
        pytest.skip("avr-gcc is missing")
    elf = folder / "probe.elf"
    command = [
        "avr-gcc",
        "-mmcu=atmega32u4",
        "-DF_CPU=16000000UL",
        "-std=c11",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-Os",
        f"-DMODE={mode}",
    ]
    subprocess.run([*command, "-o", str(elf), str(PROBE)], check=True, timeout=PATIENCE_S)
    return BoardProcess([str(TWIN), "--elf", str(elf)])


def run_for_long(board: BoardProcess) -> None:
    """Up to a tenth of a second."""
    for _ in range(100):
        board.advance(quiet_rows(1))


def words(board: BoardProcess) -> list[str]:
    """What happened on the buses, but for the sync pulses."""
    return [text for _, text in board.trace if text != "sync"]


def test_a_watchdog_reset_in_a_transfer_leaves_the_bus_idle(tmp_path: Path) -> None:
    board = probe(tmp_path, TWI_AFTER_RESET)
    board.fault("bootloader=none")  # the program reads MCUSR
    board.advance(quiet_rows(50))
    board.close()
    assert words(board) == ["reset power", "reset watchdog", "trigger left"]


def test_a_wrong_clock_on_spi_is_told(tmp_path: Path) -> None:
    board = probe(tmp_path, SPI_WRONG)
    board.advance(quiet_rows(5))
    board.close()
    assert words(board) == [
        "reset power",
        "adis16100 too fast",
        "scp1000 too fast",
        "adis16100 too fast",
        "adis16100 wrong mode",
    ]


def test_a_pull_up_does_not_override_what_drives_the_pin(tmp_path: Path) -> None:
    board = probe(tmp_path, PULLED_UP)
    board.advance(quiet_rows(9))
    board.close()
    assert words(board) == ["reset power", "trigger left"]


def test_clearing_one_flag_of_a_timer_keeps_the_others(tmp_path: Path) -> None:
    """By itself simavr clears all of them, which costs the clock an overflow in a few minutes of pulse rangers."""
    board = probe(tmp_path, TIMER_FLAGS)
    board.advance(quiet_rows(5))
    board.close()
    assert words(board) == ["reset power", "trigger left"]


def test_a_program_that_stops_ends_the_twin(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    board = probe(tmp_path, STOPPED)
    try:
        with pytest.raises(EchostepError, match="ended"):
            run_for_long(board)
    finally:
        board.close()
    assert re.fullmatch(r"echostep-twin: the firmware stopped at [0-9.]+ s\n", capfd.readouterr().err)


@pytest.mark.parametrize(
    ("arguments", "sent", "reason"),
    [
        (["--elf", "/bin/sh"], b"Q\0\0\0\0", "not a program for an AVR"),
        (["--elf", "/etc/passwd"], b"Q\0\0\0\0", "not a program for an AVR"),
        (["--elf", str(ELF), "--seed", "x"], b"Q\0\0\0\0", "not a number"),
        (["--elf", str(ELF), "more"], b"Q\0\0\0\0", "not an option"),
        (["--elf", str(ELF)], b"", "ends without a record Q"),
        (["--elf", str(ELF)], b"R\x18\0", "middle of a record"),
        (["--elf", str(ELF)], b"R\x18\0\0\0abc", "middle of a record"),
        (["--elf", str(ELF)], b"R\xff\xff\xff\xff", "too long"),
        (["--elf", str(ELF)], b"R\x05\0\0\0abcde", "not a multiple"),
        (["--elf", str(ELF)], b"X\0\0\0\0", "unknown record"),
    ],
)
def test_mistakes_are_named(arguments: list[str], sent: bytes, reason: str) -> None:
    found = subprocess.run([str(TWIN), *arguments], input=sent, capture_output=True, timeout=PATIENCE_S, check=False)
    lines = found.stderr.decode().splitlines()
    assert found.returncode == 2
    assert len(lines) == 1
    assert reason in lines[0]


def test_rangers_keep_power_when_the_processor_is_reset() -> None:
    """A ping under way goes on: its ranger does not answer until the ranging is over."""
    bench = Bench()
    bench.run(1_000)
    bench.fault("reset=external")
    bench.run(1_000)
    bench.board.close()
    for side in ("left", "right"):
        t_ns = np.array([t for t, text in bench.board.trace if text == f"trigger {side}"])
        assert np.diff(t_ns).min() >= 61_000_000


def test_trigger_truth_is_the_stop_condition() -> None:
    """Firmware and truth count from the same edge: what differs is the start of the clock, a constant."""
    bench = Bench()
    bench.run(4_000)
    bench.board.close()
    for side, ranger in (("left", m.Ranger.LEFT), ("right", m.Ranger.RIGHT)):
        truth = [t / 500 for t, text in bench.board.trace if text == f"trigger {side}"]
        stamps = [p.ticks for p in pings(bench.messages, ranger)]
        offsets = [a - b for a, b in zip(stamps, truth, strict=False)]
        assert len(offsets) > 40
        assert max(offsets) - min(offsets) <= STAMP_STEP_TICKS


def test_nothing_is_read_through_a_stuck_line() -> None:
    """Whatever the bus is at when the line gets stuck; a byte that is on its way then arrives."""
    for milliseconds in range(1_045, 1_065):
        bench = Bench()
        bench.fault("srf_left=stretch")
        bench.run(milliseconds)
        bench.fault("sda=stuck_forever")
        bench.run(2)
        found = [x for x in bench.run(100) if isinstance(x, m.Ping)]
        bench.board.close()
        assert found
        assert {p.outcome for p in found} == {m.Outcome.BUS_ERROR}


class PtyTwin(PtyBoard):
    """The twin with a pseudo terminal, whose time passes by `run`."""

    def run(self, milliseconds: int) -> None:
        """Let time pass."""
        self.advance(quiet_rows(milliseconds))

    def listen(self, port: serial.Serial) -> list[m.Message]:
        """What a program gets that reads while time passes."""
        reader, found = BoardReader(), []
        for _ in range(100):
            self.run(10)
            found += reader.feed(port.read(port.in_waiting))
        port.timeout = 1.0  # the kernel hands over the last bytes in its own time
        while part := port.read(4096):
            found += reader.feed(part)
        port.timeout = 0
        return found


def write_for_long(port: serial.Serial) -> None:
    """For as long as a test is patient, unless the port goes away."""
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        os.write(port.fileno(), b"\0")
        port.read(1)


@pytest.fixture
def pty_twin() -> Iterator[PtyTwin]:
    with contextlib.closing(PtyTwin()) as twin:
        yield twin


def test_a_program_opens_closes_and_opens_the_pty(pty_twin: PtyTwin) -> None:
    pty_twin.run(300)
    for _ in range(2):
        with serial.Serial(pty_twin.port, timeout=0) as port:
            found = pty_twin.listen(port)
        assert sum(isinstance(x, m.Ping) for x in found) >= 28
        assert any(isinstance(x, m.Configuration) for x in found)  # sent when the port opens
        pty_twin.run(100)


def test_an_unplugged_pty_goes_away_and_comes_back(pty_twin: PtyTwin) -> None:
    pty_twin.run(300)
    with serial.Serial(pty_twin.port, timeout=0) as port:
        pty_twin.listen(port)
        pty_twin.fault("usb=unplug")
        pty_twin.run(50)
        with pytest.raises((serial.SerialException, OSError)):
            write_for_long(port)
    pty_twin.fault("usb=plug")
    pty_twin.run(300)
    with serial.Serial(pty_twin.port, timeout=0) as port:
        assert sum(isinstance(x, m.Ping) for x in pty_twin.listen(port)) >= 28
