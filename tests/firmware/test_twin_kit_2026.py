# SPDX-License-Identifier: MIT
"""The parts of the kit of 2026 in the twin, one by one: found, measured, and failing in their own ways."""

from __future__ import annotations

import numpy as np
import pytest

from board_runs import Bench, kinds, needs_twin, quiet_rows
from echostep.board import messages as m
from echostep.board.findings import BoardReports, part_text_of
from echostep.board.health import board_findings
from echostep.board.subscription import SUBSCRIBE

pytestmark = needs_twin


def reports(bench: Bench) -> BoardReports:
    """What the host keeps of all messages so far."""
    kept = BoardReports()
    for message in bench.messages:
        kept.add(message)
    return kept


def parts(bench: Bench) -> m.Parts:
    """The newest report of the parts, which the bench must have subscribed to."""
    return next(x for x in reversed(bench.messages) if isinstance(x, m.Parts))


def pressures(found: list[m.Message]) -> list[m.Pressure]:
    return [x for x in found if isinstance(x, m.Pressure)]


@pytest.fixture
def barometer(bench: Bench) -> Bench:
    """A board of the papers with a BMP390, subscribed."""
    bench.fault("part_pressure=bmp390")
    bench.run(300)
    bench.ask(SUBSCRIBE)
    bench.run(1_200)
    return bench


def test_the_bmp390_is_found_and_its_rate_and_pressure_are_right(barometer: Bench) -> None:
    assert parts(barometer).part_pressure == m.Part.BMP390
    assert part_text_of(reports(barometer), m.Healthy.PRESSURE) == "BMP390, identity 0x60"
    found = pressures(barometer.run(2_000))
    assert 24 <= len(found) <= 26  # 12.5 Hz
    assert {(x.pressure, x.temperature) for x in found} == {(405_296, 400)}
    assert not barometer.status.errors_pressure


@pytest.mark.parametrize("celsius", [-20.0, 10.0, 55.0])
@pytest.mark.parametrize("hectopascal", [310.0, 700.0, 1_013.25, 1_100.0])
def test_the_compensation_of_the_bmp390_is_right_to_a_count(
    barometer: Bench, celsius: float, hectopascal: float
) -> None:
    """The twin inverts the data sheet's formula with doubles; the firmware computes it with floats."""
    rows = quiet_rows(500)
    rows["pressure"], rows["temperature"] = round(400.0 * hectopascal), round(20.0 * celsius)
    last = pressures(barometer.run(500, rows))[-1]
    assert abs(last.pressure - 400.0 * hectopascal) <= 1
    assert abs(last.temperature - 20.0 * celsius) <= 1


def test_the_slow_mode_of_the_bmp390(barometer: Bench) -> None:
    barometer.ask(m.Configure(0xFF, m.Schedule.CONCURRENT, 200, 10, m.PressureMode.HIGH_RESOLUTION))
    barometer.run(1_000)
    assert 5 <= len(pressures(barometer.run(2_000))) <= 7


@pytest.mark.parametrize(
    ("kind", "cause", "words"),
    [
        ("absent", m.Fault.NO_ANSWER, "barometer (BMP390): does not answer"),
        ("zeros", m.Fault.NEVER_READY, "barometer (BMP390): has had no sample for 2 s"),
        ("stuck_ready", m.Fault.ALWAYS_READY, "barometer (BMP390): reports a sample that it cannot have yet"),
        ("never_ready", m.Fault.NEVER_READY, "barometer (BMP390): has had no sample for 2 s"),
    ],
)
def test_a_bmp390_that_fails_is_named_and_comes_back(barometer: Bench, kind: str, cause: m.Fault, words: str) -> None:
    before = kinds(barometer.run(1_000))
    barometer.fault(f"bmp390={kind}")
    barometer.run(3_500)
    assert cause in {x.fault_pressure for x in barometer.messages if isinstance(x, m.Status)}
    assert any(str(f).startswith(words) for f in all_findings(barometer))
    barometer.fault("bmp390=ok")
    barometer.run(4_000)
    again = kinds(barometer.run(1_000))
    assert again["Pressure"] >= 12
    assert again["Gyros"] == pytest.approx(before["Gyros"], abs=2)
    assert barometer.status.healthy & m.Healthy.PRESSURE


def all_findings(bench: Bench) -> list[str]:
    """Every finding that any status gave rise to."""
    kept, found = BoardReports(), []
    for message in bench.messages:
        kept.add(message)
        if isinstance(message, m.Status):
            found += [str(f) for f in board_findings(kept)]
    return found


@pytest.mark.parametrize(
    ("kind", "cause", "words"),
    [
        ("wrong_identity", None, "barometer: holds a part that the firmware does not know (identity register 0x58)"),
        ("empty", m.Fault.EEPROM, "barometer (BMP390): its calibration is empty"),
    ],
)
def test_a_wrong_part_and_an_empty_memory_are_named_at_the_start(
    bench: Bench, kind: str, cause: m.Fault | None, words: str
) -> None:
    bench.fault("part_pressure=bmp390")
    bench.fault(f"bmp390={kind}")
    bench.run(300)
    bench.ask(SUBSCRIBE)
    bench.run(2_500)
    assert not pressures(bench.messages)
    assert cause is None or bench.status.fault_pressure == cause
    assert any(text.startswith(words) for text in all_findings(bench))


def test_barometers_may_be_swapped_in_mid_walk(barometer: Bench) -> None:
    for part, name in (("scp1000", m.Part.SCP1000), ("bmp390", m.Part.BMP390)):
        barometer.fault(f"part_pressure={part}")
        barometer.run(5_000)
        found = pressures(barometer.run(1_000))
        assert parts(barometer).part_pressure == name
        assert np.ptp([x.pressure for x in found]) <= 1
        assert abs(found[-1].pressure - 405_296) <= 8  # 15 bits of an SCP1000


def test_a_board_that_nobody_has_asked_sends_no_parts(bench: Bench) -> None:
    assert not kinds(bench.run(2_000))["Parts"]


def test_the_parts_of_the_papers_are_named(bench: Bench) -> None:
    bench.run(300)
    bench.ask(SUBSCRIBE)
    bench.run(2_000)
    found = parts(bench)
    assert found[1:9] == (
        m.Part.SRF02, m.Part.SRF02, m.Part.CMPS10, m.Part.ADIS16100, m.Part.ADIS16100, m.Part.ADIS16100, m.Part.SCP1000, 0,
    )  # fmt: skip
    assert found.identity_ranger_left == 6
