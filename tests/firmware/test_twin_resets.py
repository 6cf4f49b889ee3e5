# SPDX-License-Identifier: MIT
"""The real firmware in the simulator: resets, unplugging, a host that does not read, mistakes of its user."""

from __future__ import annotations

import hashlib

import pytest

from board_runs import ELF, TWIN, Bench, kinds, needs_twin, pings, quiet_rows
from echostep.board import messages as m
from echostep.errors import EchostepError
from echostep_simulation.devices.board import BoardProcess

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


def provoke(board: BoardProcess, fault: str) -> None:
    for _ in range(100):
        if fault:
            board.fault(fault)
        board.advance(quiet_rows(1))


@pytest.mark.parametrize(
    ("arguments", "fault"), [(["--elf", "none.elf"], ""), (["--elf", str(ELF)], "nonsense=1"), ([], "")]
)
def test_mistakes_end_the_twin_with_one_line(
    capfd: pytest.CaptureFixture[str], arguments: list[str], fault: str
) -> None:
    board = BoardProcess([str(TWIN), *arguments])
    try:
        with pytest.raises(EchostepError, match="ended"):
            provoke(board, fault)
    finally:
        board.close()
    assert capfd.readouterr().err.count("\n") == 1


def test_a_twin_that_is_not_there_is_named() -> None:
    with pytest.raises(EchostepError, match="cannot start"):
        BoardProcess(["/no/such/twin"])
