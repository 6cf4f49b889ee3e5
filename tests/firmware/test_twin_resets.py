# SPDX-License-Identifier: MIT
"""The real firmware in the simulator: resets, unplugging, a host that does not read, mistakes of its user."""

from __future__ import annotations

import hashlib
import subprocess

import numpy as np
import pytest

from board_runs import ELF, TWIN, Bench, kinds, needs_twin, pings, quiet_rows
from echostep.board import messages as m
from echostep.errors import EchostepError
from echostep_simulation.devices.board import BoardProcess
from waiting import PATIENCE_S

pytestmark = needs_twin


def test_a_host_that_does_not_read_costs_counted_frames_and_heals_at_once(bench: Bench) -> None:
    bench.run(1_000)
    bench.fault("host=stall")
    assert sum(kinds(bench.run(3_000)).values()) < 60  # what the host had already fetched
    bench.fault("host=read")
    found = bench.run(2_000)
    dropped = sum(v for k, v in bench.status._asdict().items() if k.startswith("dropped_"))
    assert dropped > 600
    assert bench.reader.counts.lost == dropped
    assert bench.reader.counts.rejected == 0  # no torn frame
    assert kinds(found)["Ping"] >= 2 * 28


def test_unplugged_and_plugged_in_again(bench: Bench) -> None:
    bench.run(1_000)
    bench.fault("usb=unplug")
    assert bench.run(1_000) == []
    bench.fault("usb=plug")
    found = bench.run(2_000)
    first = next(x for x in found if isinstance(x, m.Identity))
    assert first.reset_cause == m.ResetCause.POWER_ON
    assert first.ticks < 2_000_000
    assert kinds(found)["Ping"] >= 28


def test_a_bus_reset_enumerates_again(bench: Bench) -> None:
    bench.run(1_000)
    bench.fault("usb=reset")
    bench.run(300)
    assert kinds(bench.run(1_000))["Ping"] >= 28


def test_an_echo_of_the_other_ping_is_heard(bench: Bench) -> None:
    rows = quiet_rows(3_000)
    rows["own_us"] = 0
    rows["cross_us"] = [34_000, 0]  # the right ranger's ping reaches the left one
    found = pings(bench.run(3_000, rows), m.Ranger.LEFT)
    heard = [p.time_of_flight_us for p in found if p.outcome == m.Outcome.ECHO]
    assert heard
    assert len(set(heard)) > len(heard) // 2  # it moves with the jitter, an own echo would stay


@pytest.mark.long
def test_equal_input_gives_equal_bytes() -> None:
    def run(seed: int) -> str:
        bench = Bench(BoardProcess([str(TWIN), "--elf", str(ELF), "--seed", str(seed)]))
        sha = hashlib.sha256()
        for fault in ("srf_left=nack", "sda=stuck", "usb=unplug", "usb=plug", "host=stall", "host=read"):
            bench.run(500)
            bench.fault(fault)
        bench.run(1_000)
        for t_ns, part in bench.sent:
            sha.update(t_ns.to_bytes(8, "little") + part)
        bench.board.close()
        return sha.hexdigest()

    assert run(1) == run(1)
    assert run(1) != run(2)


@pytest.mark.parametrize(
    ("arguments", "sent", "reason"),
    [
        ([], b"Q\0\0\0\0", "no firmware given"),
        (["--elf", "none.elf"], b"Q\0\0\0\0", "cannot read the firmware"),
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


def test_a_twin_that_is_not_there_or_ends_is_named() -> None:
    with pytest.raises(EchostepError, match="cannot start"):
        BoardProcess(["/no/such/twin"])
    board = BoardProcess([str(TWIN), "--elf", str(ELF)])
    board.fault("nonsense=1")
    with pytest.raises(EchostepError, match="ended"):
        board.advance(quiet_rows(1_000))
    board.close()
