# SPDX-License-Identifier: MIT
"""The real firmware on a USB cable that is not perfect; and a bus, plugs and a crystal that are not either."""

from __future__ import annotations

import re

import numpy as np
import pytest

from board_runs import ELF, ROOT, TWIN, Bench, kinds, needs_twin, pings, quiet_rows
from echostep.board import messages as m
from echostep_simulation.devices.board import BoardProcess

pytestmark = needs_twin


def traces(bench: Bench, pattern: str) -> list[str]:
    """The traces in which this pattern occurs."""
    return [text for _, text in bench.board.trace if re.search(pattern, text)]


def test_windows_finds_its_driver_and_two_boards_differ() -> None:
    serials = []
    for seed in ("1", "2"):
        bench = Bench(BoardProcess([str(TWIN), "--elf", str(ELF), "--seed", seed]))
        bench.run(100)
        bench.board.close()
        assert traces(bench, "usb class 02 subclass 02 serial string 3")  # what usbser.inf wants
        serials += traces(bench, "serial number [0-9A-F]{20}$")
        assert not traces(bench, "written at once")
    assert len(set(serials)) == 2


def test_the_version_is_that_of_the_header(bench: Bench) -> None:
    """In `identity`, and as the release of the USB descriptor; no modem's commands are promised, so that no modem manager asks for any."""
    header = (ROOT / "firmware/version.h").read_text()
    version = tuple(int(re.search(rf"{name} (\d+)", header)[1]) for name in ("MAJOR", "MINOR", "PATCH"))  # type: ignore[index]
    identity = next(x for x in bench.run(300) if isinstance(x, m.Identity))
    assert (identity.version_major, identity.version_minor, identity.version_patch) == version
    assert traces(bench, f"^usb release {version[0]}[.]{version[1]}{version[2]}$")
    assert traces(bench, "^usb first interface: class 02 protocol 00$")


def answer_ms(bench: Bench) -> list[int]:
    """How many milliseconds each of 20 clock queries waits for its answer."""
    waits = []
    for token in range(20):
        bench.ask(m.ClockQuery(token))
        waits.append(next(k for k in range(20) if any(isinstance(x, m.ClockReply) for x in bench.run(1))))
        bench.run(10 + token)
    return waits


def test_a_hub_in_between_costs_a_millisecond_and_no_message(bench: Bench) -> None:
    bench.run(1_500)
    direct = answer_ms(bench)
    bench.fault("host_hub=on")
    bench.fault("usb=unplug")
    bench.run(100)
    bench.fault("usb=plug")
    assert kinds(bench.run(2_000))["Ping"] >= 28
    assert np.mean(answer_ms(bench)) - np.mean(direct) == pytest.approx(1.0, abs=0.3)
    assert bench.reader.counts.lost == bench.reader.counts.rejected == 0
    assert not any(v for k, v in bench.status._asdict().items() if k.startswith("dropped_"))


@pytest.mark.parametrize("request_again", ["configure", "interface"])
def test_a_setting_that_is_set_again_costs_no_command(bench: Bench, request_again: str) -> None:
    bench.run(1_000)
    for token in range(12):  # with even and odd numbers of packets in between
        bench.ask(m.ClockQuery(token))
        bench.run(7 + token)
        bench.fault(f"usb={request_again}")
        bench.run(20)
    bench.ask(m.ClockQuery(12))
    found = bench.run(1_000)
    assert [x.token for x in bench.messages if isinstance(x, m.ClockReply)] == [*range(13)]
    assert not traces(bench, "again|repeated")
    assert kinds(found)["Ping"] >= 28  # the port has stayed open


def test_a_suspended_port_goes_on_after_the_resume(bench: Bench) -> None:
    bench.run(1_000)
    bench.fault("usb=suspend")
    bench.run(20)
    assert bench.run(2_000) == []
    bench.fault("usb=resume")
    bench.run(100)
    found = bench.run(1_000)
    assert kinds(found)["Ping"] >= 28
    assert bench.reader.counts.lost == bench.reader.counts.rejected == 0
    assert sum(v for k, v in bench.status._asdict().items() if k.startswith("dropped_")) == 0
    bench.ask(m.Subscribe(m.Reports.BOARD_HEALTH))
    assert [x.suspends for x in bench.run(50) if isinstance(x, m.BoardHealth)] == [1]


def test_bit_errors_cost_nothing(bench: Bench) -> None:
    bench.run(1_000)
    bench.fault("usb_errors=100")  # a tenth of all packets
    for token in range(20):
        bench.ask(m.ClockQuery(token))
        bench.run(50)
    found = bench.run(1_000)
    assert kinds(found)["Ping"] >= 28
    assert [x.token for x in bench.messages if isinstance(x, m.ClockReply)] == [*range(20)]
    assert bench.reader.counts.lost == bench.reader.counts.rejected == 0
    assert traces(bench, "came again")
    assert traces(bench, "drops a repeated packet")


def test_enumeration_survives_bit_errors(bench: Bench) -> None:
    bench.fault("usb_errors=100")
    assert kinds(bench.run(2_000))["Gyros"] > 300


@pytest.mark.parametrize("line", ["sda", "scl"])
def test_a_bus_hung_at_power_up(bench: Bench, line: str) -> None:
    bench.fault(f"{line}=stuck")
    found = bench.run(2_000)
    if line == "sda":  # nine clocks free it
        assert bench.status.bus_recoveries >= 1
    else:
        assert {p.outcome for p in found if isinstance(p, m.Ping)} == {m.Outcome.BUS_ERROR}
        assert bench.status.fault_compass == m.Fault.BUS_STUCK
        assert kinds(found)["Gyros"] > 370
        bench.fault("scl=ok")
    bench.run(500)
    assert {p.outcome for p in pings(bench.run(500), m.Ranger.LEFT)} == {m.Outcome.ECHO}


def test_pulse_rangers_are_found_beside_a_bus_that_is_stuck_from_the_start(bench: Bench) -> None:
    bench.fault("kit=2026")
    bench.fault("sda=stuck_forever")
    bench.subscribe()
    bench.run(1_500)
    found = bench.run(1_000)
    assert {p.outcome for p in found if isinstance(p, m.Ping)} == {m.Outcome.ECHO}
    assert kinds(found)["Ping"] >= 28
    assert bench.parts.part_ranger_left == bench.parts.part_ranger_right == m.Part.PULSE
    assert bench.status.fault_compass == m.Fault.BUS_STUCK


def test_a_ranger_on_a_bus_that_is_stuck_from_the_start_is_named_so(bench: Bench) -> None:
    bench.fault("sda=stuck_forever")
    bench.run(3_000)
    assert bench.status.fault_ranger_left == bench.status.fault_ranger_right == m.Fault.BUS_STUCK
    bench.fault("sda=ok")
    bench.run(1_500)
    assert {p.outcome for p in bench.run(500) if isinstance(p, m.Ping)} == {m.Outcome.ECHO}


def test_plugs_that_are_exchanged(bench: Bench) -> None:
    bench.fault("swapped=thigh_calf")
    bench.run(1_000)
    assert {g[1:] for g in bench.run(200) if isinstance(g, m.Gyros)} == {(-82, 41, 5)}
    bench.fault("swapped=rangers")
    bench.run(100)
    found = bench.run(500)
    assert {p.time_of_flight_us for p in pings(found, m.Ranger.LEFT)} == {7_000}
    assert {p.time_of_flight_us for p in pings(found, m.Ranger.RIGHT)} == {5_831}


@pytest.mark.parametrize(("kind", "degrees", "ppm"), [("drift", 25, 30), ("drift", -10, 32.5), ("resonator", 55, 2100)])
def test_a_crystal_is_off_by_its_temperature(bench: Bench, kind: str, degrees: int, ppm: float) -> None:
    bench.fault(f"crystal={kind}")
    rows = quiet_rows(2_000)
    rows["temperature"] = 20 * degrees
    found = np.array([(x.edge, x.ticks) for x in bench.run(2_000, rows) if isinstance(x, m.Sync)])
    measured = np.polyfit(found[:, 0] * 20_000, found[:, 1], 1)[0] - 1.0
    assert measured * 1e6 == pytest.approx(ppm, abs=1.0)


def test_a_touch_at_1200_baud_starts_the_bootloader(bench: Bench) -> None:
    bench.run(1_000)
    bench.fault("usb=touch")
    bench.run(400)
    assert traces(bench, "bootloader waits")


def test_a_dtr_that_twiggles_does_not(bench: Bench) -> None:
    """Most hosts let DTR fall and rise when a program opens the port at another rate [Arduino, cores/arduino/CDC.cpp]."""
    bench.run(1_000)
    bench.fault("usb=twiggle")
    bench.run(400)
    assert not traces(bench, "bootloader waits")
    assert kinds(bench.run(1_000))["Ping"] >= 28


@pytest.mark.parametrize("system", ["windows", "macos"])
def test_the_board_answers_whatever_the_order_of_requests(bench: Bench, system: str) -> None:
    bench.fault(f"host_system={system}")
    bench.run(600)
    assert traces(bench, "^enumerated$")
    assert traces(bench, "serial number [0-9A-F]{20}$")
    assert not traces(bench, "no answer")
    bench.ask(m.ClockQuery(7))
    found = bench.run(1_000)
    assert [x.token for x in found if isinstance(x, m.ClockReply)] == [7]
    assert kinds(found)["Ping"] >= 28
