# SPDX-License-Identifier: MIT
"""The real firmware on a USB cable, a bus, plugs and a crystal that are not perfect, and behind the bootloader: causes of restarts."""

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
    bench.fault("usb_errors=100")  # a tenth of all packets, from the enumeration on
    bench.run(1_000)
    for token in range(20):
        bench.ask(m.ClockQuery(token))
        bench.run(50)
    found = bench.run(1_000)
    assert kinds(found)["Ping"] >= 28
    assert [x.token for x in bench.messages if isinstance(x, m.ClockReply)] == [*range(20)]
    assert bench.reader.counts.lost == bench.reader.counts.rejected == 0
    assert traces(bench, "came again")
    assert traces(bench, "drops a repeated packet")


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


@pytest.mark.parametrize(("way", "waits"), [("touch", True), ("twiggle", False)])
def test_a_touch_at_1200_baud_starts_the_bootloader(bench: Bench, way: str, waits: bool) -> None:
    """Not a DTR that twiggles: most hosts let it when a program opens the port at another rate [Arduino, cores/arduino/CDC.cpp]."""
    bench.run(1_000)
    bench.fault(f"usb={way}")
    bench.run(400)
    assert bool(traces(bench, "bootloader waits")) == waits
    assert (kinds(bench.run(1_000))["Ping"] >= 28) != waits


BOOTLOADER_MS = 8_000


def subscribe(bench: Bench) -> m.BoardHealth:
    """The answer to a subscription to the board's health."""
    bench.ask(m.Subscribe(m.Reports.BOARD_HEALTH))
    return next(x for x in reversed(bench.run(100)) if isinstance(x, m.BoardHealth))


def cause(bench: Bench) -> int:
    """Cause of the newest start."""
    return next(x for x in reversed(bench.messages) if isinstance(x, m.Identity)).reset_cause


def traced(bench: Bench, word: str) -> list[str]:
    """What follows this word in the traces."""
    return [text.removeprefix(word).strip() for _, text in bench.board.trace if text.startswith(word)]


def longest_gap_s(bench: Bench) -> float:
    """Longest time between two packets of the board."""
    times_ns = [t_ns for t_ns, _ in bench.sent]
    return max(b - a for a, b in zip(times_ns, times_ns[1:], strict=False)) * 1e-9


def test_a_crash_costs_a_quarter_of_a_second_and_says_where_it_was(bench: Bench) -> None:
    bench.run(1_500)
    bench.fault("reset=watchdog")
    found = bench.run(2_000)
    assert traced(bench, "reset") == ["power", "watchdog"]
    assert cause(bench) == m.ResetCause.WATCHDOG
    assert longest_gap_s(bench) < 0.25
    assert not any(-32768 in g[1:] for g in found if isinstance(g, m.Gyros))
    assert {x.self_test for x in bench.reports.gyros.values()} == {m.SelfTest.NOT_RUN}
    health = subscribe(bench)
    assert (health.starts, health.crashes, health.crash_place) == (2, 1, m.CrashPlace.SLEEP)
    assert [f"{health.crash_address:04x}"] == traced(bench, "hang")


@pytest.mark.parametrize("kind", ["hang_in_spi", "hang_deaf"])
def test_a_crash_while_a_gyro_is_read(bench: Bench, kind: str) -> None:
    bench.run(1_500)
    bench.fault(f"cpu={kind}")
    bench.run(1_500)
    assert cause(bench) == m.ResetCause.WATCHDOG
    health = subscribe(bench)
    assert health.crash_place == m.CrashPlace.GYROS
    assert health.crash_address == (int(traced(bench, "hang")[0], 16) if kind == "hang_in_spi" else 0)


def test_the_reset_button_costs_the_bootloaders_wait_and_a_self_test(bench: Bench) -> None:
    bench.run(300)
    bench.fault("reset=external")
    assert bench.run(BOOTLOADER_MS - 10) == []
    bench.run(2_000)
    assert cause(bench) == m.ResetCause.EXTERNAL
    assert {x.self_test for x in bench.reports.gyros.values()} == {m.SelfTest.PASSED}
    assert subscribe(bench).crashes == 0


@pytest.mark.parametrize(("fuse", "low_mv"), [("2600", 2500), ("4300", 4200)])
def test_a_brown_out_is_told_from_the_button(bench: Bench, fuse: str, low_mv: int) -> None:
    bench.fault(f"brown_out_fuse={fuse}")
    bench.run(1_500)
    for mv in (4_800, 4_500, low_mv, 5_000):
        bench.fault(f"supply={mv}")
        bench.run(20)
    bench.run(BOOTLOADER_MS + 2_000)
    assert traced(bench, "reset") == ["power", "brown_out"]
    assert cause(bench) == m.ResetCause.BROWN_OUT
    assert {x.self_test for x in bench.reports.gyros.values()} == {m.SelfTest.NOT_RUN}


def test_below_the_stock_fuse_the_processor_may_hang_and_is_restarted(bench: Bench) -> None:
    bench.run(1_500)
    bench.fault("supply=3000")
    bench.run(500)
    bench.fault("supply=5000")
    found = bench.run(2_000)
    assert cause(bench) == m.ResetCause.WATCHDOG
    assert kinds(found)["Ping"] >= 28


def test_a_loss_of_power_is_one_whatever_memory_holds(bench: Bench) -> None:
    bench.run(500)
    for fault in ("reset=watchdog", "supply=0", "supply=5000"):
        bench.fault(fault)
        bench.run(300)
    assert cause(bench) == m.ResetCause.POWER_ON
    assert subscribe(bench)[3:7] == (1, 0, m.CrashPlace.NONE, 0)


def test_the_supply_voltage_is_measured(bench: Bench) -> None:
    bench.run(1_000)
    usual = subscribe(bench)
    bench.fault("supply=4500")
    bench.run(30)
    bench.fault("supply=5000")
    reported = [x for x in bench.run(2_200) if isinstance(x, m.BoardHealth)]
    assert usual.supply_mv == pytest.approx(5_000, rel=0.04)  # spread of the references
    assert reported[0].supply_mv == pytest.approx(usual.supply_mv, rel=0.01)
    assert reported[0].supply_least_mv == pytest.approx(usual.supply_mv * 0.9, rel=0.01)
    assert reported[-1].supply_least_mv == pytest.approx(usual.supply_mv, rel=0.01)


def test_without_a_bootloader_the_register_tells(bench: Bench) -> None:
    bench.fault("bootloader=none")
    bench.run(300)
    found = []
    for fault in ("reset=external", "reset=watchdog", "supply=2500", "reset=power"):
        bench.fault(fault)
        bench.run(100)
        bench.fault("supply=5000")
        bench.run(300)
        found.append(cause(bench))
    assert found == [m.ResetCause.EXTERNAL, m.ResetCause.WATCHDOG, m.ResetCause.BROWN_OUT, m.ResetCause.POWER_ON]


def test_only_a_host_that_subscribes_gets_the_new_message(bench: Bench) -> None:
    assert "BoardHealth" not in kinds(bench.run(2_500))
    subscribe(bench)
    assert kinds(bench.run(2_000))["BoardHealth"] == 2
    assert bench.status.bad_frames == 0
    bench.ask(m.Subscribe(0))
    assert "BoardHealth" not in kinds(bench.run(2_000))
    subscribe(bench)
    bench.fault("reset=watchdog")
    bench.run(100)
    assert "BoardHealth" not in kinds(bench.run(2_000))  # the host must ask again


@pytest.mark.parametrize(("resistor", "meet"), [("1000", 0), ("none", 1)])
def test_the_bootloaders_led_meets_the_right_ranger_without_its_resistor(resistor: str, meet: int) -> None:
    """While it waits, PC7 is driven against Echo; afterwards the ranger answers, as the firmware has made the pin an input again."""
    bench = Bench()
    bench.fault("kit=2026")
    bench.fault(f"echo_resistor={resistor}")
    bench.run(1_000)
    bench.fault("reset=external")
    bench.run(BOOTLOADER_MS + 1_000)
    found = pings(bench.run(1_000), m.Ranger.RIGHT)
    bench.board.close()
    assert len(traced(bench, "contention on PC7, by the bootloader")) == meet
    assert {p.outcome for p in found} == {m.Outcome.ECHO}


def test_a_board_whose_jtag_fuse_is_programmed_has_its_triggers(bench: Bench) -> None:
    """JTAG owns A0 to A3 until the firmware has switched it off."""
    bench.fault("kit=2026")
    bench.fault("jtag_fuse=programmed")
    bench.run(1_500)
    assert {p.outcome for p in bench.run(500) if isinstance(p, m.Ping)} == {m.Outcome.ECHO}
