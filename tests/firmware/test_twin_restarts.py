# SPDX-License-Identifier: MIT
"""The real firmware behind the bootloader of its boards: causes of restarts, crash marker, supply voltage."""

from __future__ import annotations

import pytest

from board_runs import Bench, kinds, needs_twin, pings
from echostep.board import messages as m

pytestmark = needs_twin

BOOTLOADER_MS = 8_000


def subscribe(bench: Bench) -> m.BoardHealth:
    """The answer to a subscription to the board's health."""
    bench.ask(m.Subscribe(m.Reports.BOARD_HEALTH))
    return next(x for x in reversed(bench.run(100)) if isinstance(x, m.BoardHealth))


def cause(bench: Bench) -> int:
    """Cause of the newest start."""
    return next(x for x in reversed(bench.messages) if isinstance(x, m.Identity)).reset_cause


def self_tests(bench: Bench) -> set[int]:
    """The newest self-test of each gyro."""
    return set({x.gyro: x.self_test for x in bench.messages if isinstance(x, m.GyroHealth)}.values())


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
    assert self_tests(bench) == {m.SelfTest.NOT_RUN}
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
    assert self_tests(bench) == {m.SelfTest.PASSED}
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
    assert self_tests(bench) == {m.SelfTest.NOT_RUN}


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
