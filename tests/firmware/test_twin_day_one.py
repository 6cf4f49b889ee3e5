# SPDX-License-Identifier: MIT
"""What is likely to go wrong with the first board, provoked in the twin: each has its words, which stand in firmware/README.md."""

from __future__ import annotations

import numpy as np
import pytest

from board_runs import ROOT, Bench, needs_twin
from echostep.board import messages as m
from echostep.board.reports import SUBSCRIBE_ELECTRICAL, BoardReports
from echostep_app.board.faults.electrical import electrical_findings, level_line
from echostep_app.board.faults.health import Finding, board_findings
from echostep_app.commissioning.diagnosis import _echo_findings
from echostep_app.commissioning.probe import ProbeResult
from echostep_simulation.stimulus import EXTENDED_ROW, NO_SYNC

pytestmark = needs_twin
README = ROOT / "firmware/README.md"

# What is done to the board; what `echostep doctor --electrical` says; whether the README's table names it.
DAY_ONE = [
    (("kit=2026", "pulse_left=stuck_low"), "D4: is driven low and never rises"),
    (("kit=2026", "pulse_right=stuck_low"), "D13: reads zero"),
    (("kit=foot", "icm20649=zeros"), "SPI bus: no part answers on SPI, and MISO is low"),
    (("kit=2026", "imu_thigh=absent"), "thigh gyro: does not answer"),
    (("kit=2026", "imu_calf=no_self_test"), "calf gyro (LSM6DSO): failed its self-test"),
    (("kit=2026", "spi_errors=100"), "belt gyro (LSM6DSO): sent wrong bits"),
    (("kit=2026", "pulse_left=absent", "hum=50"), "D4: is open"),
    (("kit=2026", "pulse_left=held"), "left ranger: receives no echo"),
    (("kit=2026", "sda=stuck_forever"), "SDA: is held low (D2)"),
    (("kit=foot", "icm20649=never_ready"), "foot sensor (ICM-20649): answers, but its data-ready line does not pulse"),
    (("kit=2026", "bmp390=wrong_identity"), "barometer: holds a part that the firmware does not know"),
    (("kit=2026", "miso_undefined=noise"), "MISO: rests between the processor's thresholds"),
]


def rows(milliseconds: int) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    """Rows of an empty room: no echo, all parts at rest."""
    table = np.zeros(milliseconds, EXTENDED_ROW)
    table["row"]["sync_us"], table["row"]["pressure"] = NO_SYNC, 405_296
    table["motion"]["force"][:, :, 2] = 1_024
    return table


def findings(bench: Bench) -> list[Finding]:
    """All findings on all reports, as `echostep doctor --electrical` makes them."""
    reports, found = BoardReports(), []
    for message in bench.messages:
        reports.add(message)
        if isinstance(message, m.Status):
            found += board_findings(reports) + electrical_findings(reports)
    pings = [x for x in bench.messages if isinstance(x, m.Ping)]
    return found + _echo_findings(ProbeResult(reports=reports, pings=pings))


def run(bench: Bench, *faults: str) -> list[str]:
    for fault in faults:
        bench.fault(fault)
    bench.run(300, rows(300))
    bench.ask(SUBSCRIBE_ELECTRICAL)
    bench.run(6_000, rows(6_000))
    return [str(finding) for finding in findings(bench)]


@pytest.mark.parametrize(("faults", "words"), DAY_ONE)
def test_each_failure_of_the_first_day_has_its_words(bench: Bench, faults: tuple[str, ...], words: str) -> None:
    assert [text for text in run(bench, *faults) if text.startswith(words)]
    assert words in README.read_text()


@pytest.mark.parametrize(("kit", "level"), [("2026", "MISO low"), ("papers", "MISO high"), ("foot", "MISO low")])
def test_a_board_that_is_well_has_no_electrical_finding(bench: Bench, kit: str, level: str) -> None:
    run(bench, f"kit={kit}")
    reports = BoardReports()
    for message in bench.messages:
        reports.add(message)
    assert electrical_findings(reports) == []
    assert level in level_line(reports)


def test_a_resistor_makes_the_idle_line_a_one(bench: Bench) -> None:
    run(bench, "kit=2026", "miso_resistor=2200", "miso_undefined=noise")
    reports = next(x for x in reversed(bench.messages) if isinstance(x, m.Electrical))
    assert reports.miso_ones == reports.readings


def test_a_bare_processor_board_is_normal(bench: Bench) -> None:
    """As flashed in step 2, with mains hum on its open inputs."""
    faults = ["bmp390", "imu_thigh", "imu_calf", "imu_belt", "pulse_left", "pulse_right", "lis3mdl"]
    said = run(bench, "kit=2026", "hum=50", *(f"{name}=absent" for name in faults))
    assert [text for text in said if text.startswith("SPI bus: no part answers on SPI, and nothing pulls MISO down")]
    assert [text for text in said if text.startswith("D13: is open")]
    assert not any(isinstance(x, m.Ping) and x.outcome == m.Outcome.ECHO for x in bench.messages)
