# SPDX-License-Identifier: MIT
"""The real firmware in the simulator: sensors and buses that fail, resets, unplugging, a host that does not read, mistakes of its user."""

from __future__ import annotations

import hashlib
import re
import subprocess

import numpy as np
import pytest

from board_runs import ELF, ROOT, TWIN, Bench, kinds, needs_twin, pings, quiet_rows
from echostep.board import messages as m
from echostep.errors import EchostepError
from echostep_simulation.devices.board import BoardProcess
from waiting import PATIENCE_S

pytestmark = needs_twin


def test_a_ranger_that_hears_nothing_is_no_failure(bench: Bench) -> None:
    bench.fault("srf_left=deaf")
    bench.run(1_000)
    assert {p.outcome for p in pings(bench.run(1_000), m.Ranger.LEFT)} == {m.Outcome.NO_ECHO}
    assert bench.status.healthy & m.Healthy.RANGER_LEFT


def test_clock_stretching_is_borne(bench: Bench) -> None:
    bench.fault("srf_left=stretch", "compass=stretch")
    bench.run(1_000)
    found = bench.run(2_000)
    assert {p.outcome for p in pings(found, m.Ranger.LEFT)} == {m.Outcome.ECHO}
    assert {c.bearing for c in found if isinstance(c, m.Compass)} == {900}


def test_a_stuck_bus_is_clocked_free(bench: Bench) -> None:
    bench.run(1_000)
    bench.fault("sda=stuck")
    bench.run(1_000)
    found = bench.run(2_000)
    assert bench.status.bus_recoveries >= 1
    assert {p.outcome for p in pings(found, m.Ranger.LEFT)} == {m.Outcome.ECHO}


def test_a_bus_that_stays_stuck_leaves_the_rest_running(bench: Bench) -> None:
    bench.run(1_000)
    bench.fault("sda=stuck_forever")
    found = bench.run(3_000)
    assert {p.outcome for p in found[200:] if isinstance(p, m.Ping)} == {m.Outcome.BUS_ERROR}
    assert abs(kinds(found)["Gyros"] - 600) <= 3
    assert kinds(found)["Pressure"] >= 24
    assert bench.status.fault_compass == bench.status.fault_ranger_left == m.Fault.BUS_STUCK
    bench.fault("sda=ok")
    bench.run(1_000)
    assert {p.outcome for p in pings(bench.run(1_000), m.Ranger.LEFT)} == {m.Outcome.ECHO}


def test_the_gyros_test_themselves_at_the_start(bench: Bench) -> None:
    first = [g for g in bench.run(1_000) if isinstance(g, m.Gyros)]
    tested = [g for g in first if g.thigh == g.calf == g.belt == -32768]
    assert 139 <= len(tested) <= 156  # 0.72 s without rates
    assert not any(-32768 in g[1:] for g in first[len(tested) :])
    bench.run(1_000)
    found = bench.reports.gyros
    assert {g.self_test for g in found.values()} == {m.SelfTest.PASSED}
    assert all(g.response_st1 < -121 and g.response_st2 > 121 for g in found.values())


@pytest.mark.parametrize(
    ("kind", "outcome"),
    [
        ("absent", m.SelfTest.NO_ANSWER),
        ("wrong_channel", m.SelfTest.NO_ANSWER),
        ("zeros", m.SelfTest.NO_ANSWER),
        ("stuck", m.SelfTest.FAILED),
        ("no_self_test", m.SelfTest.FAILED),
        ("ok", m.SelfTest.PASSED),
    ],
)
def test_a_self_test_on_request_finds_the_gyro_that_fails(bench: Bench, kind: str, outcome: m.SelfTest) -> None:
    bench.run(1_500)
    bench.fault(f"calf={kind}")
    bench.ask(m.CheckGyros())
    bench.run(2_000)
    found = bench.reports.gyros
    assert found[m.Gyro.CALF].self_test == outcome
    assert found[m.Gyro.THIGH].self_test == found[m.Gyro.BELT].self_test == m.SelfTest.PASSED


def test_a_self_test_in_motion_is_not_judged(bench: Bench) -> None:
    bench.run(1_000)
    rows = quiet_rows(2_000)
    rows["thigh"] = np.round(300 * np.sin(np.arange(2_000) * 0.006))
    bench.ask(m.CheckGyros())
    bench.run(2_000, rows)
    found = bench.reports.gyros
    assert found[m.Gyro.THIGH].self_test == m.SelfTest.MOVED
    assert found[m.Gyro.BELT].self_test == m.SelfTest.PASSED


def test_a_reset_in_the_middle_of_a_self_test_is_borne(bench: Bench) -> None:
    bench.run(300)
    bench.fault("reset=external")
    bench.run(10_000)  # most of it in the bootloader
    assert {g.self_test for g in bench.reports.gyros.values()} == {m.SelfTest.PASSED}


def test_the_barometer_has_two_modes(bench: Bench) -> None:
    rows = quiet_rows(5_000)
    rows["pressure"] = 405_303
    bench.run(500)
    modes = (  # 1.8 Hz and 17 bits, 9 Hz and 15 bits
        (m.PressureMode.HIGH_RESOLUTION, 8, 10, 405_300),
        (m.PressureMode.HIGH_SPEED, 42, 46, 405_296),
    )
    for mode, least, most, counts in modes:
        bench.ask(m.Configure(0xFF, 0, 200, 10, mode))
        bench.run(1_500, rows[:1_500])
        found = [p for p in bench.run(5_000, rows) if isinstance(p, m.Pressure)]
        assert least <= len(found) <= most
        assert {p.pressure for p in found} == {counts}
    assert bench.status.errors_pressure == 0


def test_every_fault_that_is_documented_exists(bench: Bench) -> None:
    rows = re.findall(r"^\| (`[a-z_0-9`, ]+`) \| (.*) \|$", (ROOT / "tools/twin/README.md").read_text(), flags=re.M)
    switches = [
        f"{name}={value}"
        for names, values in rows
        for name in re.findall(r"`(\w+)`", names)
        for value in re.findall(r"`(\w+)`", values)
    ]
    assert len(switches) > 65
    bench.fault(*switches)
    bench.run(10)


def test_wrong_bits_on_i2c_cost_pings_and_nothing_else(bench: Bench) -> None:
    """Nothing on I2C has a checksum: an impossible reply costs its slot, a possible one is a wrong range; afterwards all is well."""
    bench.run(1_000)
    bench.fault("twi_errors=50")
    found = bench.run(5_000)
    assert 5 * 22 <= kinds(found)["Ping"] < 5 * 30
    assert kinds(found)["Gyros"] >= 998
    assert len({p.time_of_flight_us for p in pings(found, m.Ranger.LEFT)}) > 1
    bench.fault("twi_errors=0")
    bench.run(1_000)
    assert {p.outcome for p in bench.run(1_000) if isinstance(p, m.Ping)} == {m.Outcome.ECHO}


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


def test_a_twin_that_ends_is_named() -> None:
    board = BoardProcess([str(TWIN), "--elf", str(ELF)])
    board.fault("nonsense=1")
    with pytest.raises(EchostepError, match="ended"):
        board.advance(quiet_rows(1_000))
    board.close()
