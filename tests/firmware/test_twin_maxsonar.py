# SPDX-License-Identifier: MIT
"""MaxBotix I2CXL-MaxSonar-EZ rangers in the twin: told from SRF02, measured at their own pace, and failing in their own ways."""

from __future__ import annotations

import numpy as np
import pytest

from board_runs import Bench, kinds, needs_twin, pings, quiet_rows
from echostep.board import messages as m
from firmware.findings import findings_of
from firmware.test_twin_kit_2026 import JITTER_US, SIDES, jitter_us

pytestmark = needs_twin

US_PER_CM = 58


def plug(bench: Bench, part: str, *sides: str) -> None:
    for side in sides or ("left", "right"):
        bench.fault(f"part_ranger_{side}={part}")


@pytest.fixture
def rangers(bench: Bench) -> Bench:
    """A board of the papers with MaxSonar rangers on both sides, subscribed."""
    plug(bench, "maxsonar")
    bench.subscribe()
    bench.run(1_700)
    return bench


def outcomes(found: list[m.Message], ranger: m.Ranger) -> set[int]:
    return {p.outcome for p in pings(found, ranger)}


def test_maxsonars_are_found_and_ping_ten_times_a_second_each(rangers: Bench) -> None:
    found = rangers.run(10_000)
    assert rangers.parts.part_ranger_left == rangers.parts.part_ranger_right == m.Part.MAXSONAR
    for side, ranger in SIDES:
        answers = pings(found, ranger)
        assert 99 <= len(answers) <= 101
        assert {p.outcome for p in answers} == {m.Outcome.ECHO}
        assert jitter_us(rangers, side, answers) <= JITTER_US
    assert not rangers.status.errors_ranger_left
    assert kinds(found)["Gyros"] >= 1_999


@pytest.mark.parametrize(
    ("own_us", "range_cm"),
    [(0, 0), (700, 25), (1_450, 25), (5_831, 101), (7_424, 128), (22_272, 384), (44_000, 759), (45_000, 0)],
)
def test_a_range_is_given_in_centimetres_from_the_least_to_the_greatest(
    rangers: Bench, own_us: int, range_cm: int
) -> None:
    """128 and 384 cm have the low byte 0x80 of an SRF02's register 1."""
    rows = quiet_rows(1_000)
    rows["own_us"] = own_us
    rangers.run(200, rows[:200])
    for _, ranger in SIDES:
        assert {p.time_of_flight_us for p in pings(rangers.run(1_000, rows), ranger)} == {range_cm * US_PER_CM}
    assert rangers.parts.part_ranger_left == m.Part.MAXSONAR


def test_in_turn_they_ping_five_times_a_second_each(rangers: Bench) -> None:
    rangers.ask(m.Configure(0xFF, m.Schedule.SEQUENTIAL, 200, 10, m.PressureMode.HIGH_SPEED))
    rangers.run(500)
    found = rangers.run(4_000)
    for _, ranger in SIDES:
        assert 19 <= len(pings(found, ranger)) <= 21
        assert outcomes(found, ranger) == {m.Outcome.ECHO}
    times = sorted(p.ticks for p in found if isinstance(p, m.Ping))
    assert min(np.diff(times)) > 99 * 2_000


def test_a_deaf_maxsonar_reports_no_echo_and_a_long_stretch_of_the_clock_is_borne(rangers: Bench) -> None:
    rangers.fault("maxsonar_right=deaf")
    rangers.run(200)
    assert outcomes(rangers.run(1_000), m.Ranger.RIGHT) == {m.Outcome.NO_ECHO}
    rangers.fault("maxsonar_right=stretch")
    rangers.run(200)
    found = rangers.run(2_000)
    assert outcomes(found, m.Ranger.RIGHT) == outcomes(found, m.Ranger.LEFT) == {m.Outcome.ECHO}
    assert not rangers.status.bus_recoveries


NAMES = {"srf02": "an SRF02", "pulse": "a pulse ranger", "maxsonar": "a MaxSonar"}


@pytest.mark.parametrize(("unused", "used"), [("srf02", "maxsonar"), ("pulse", "maxsonar"), ("pulse", "srf02")])
def test_one_of_two_kinds_is_used_alone_and_the_other_named(bench: Bench, unused: str, used: str) -> None:
    plug(bench, unused, "left")
    plug(bench, used, "right")
    bench.subscribe()
    bench.run(2_000)
    found = bench.run(2_000)
    assert outcomes(found, m.Ranger.RIGHT) == {m.Outcome.ECHO}
    assert outcomes(found, m.Ranger.LEFT) == {m.Outcome.BUS_ERROR}
    assert bench.parts.wiring == m.Wiring.MIXED_RANGERS
    words = f"rangers: the left one is {NAMES[unused]}, the right one {NAMES[used]}; the left one is not used"
    assert any(text.startswith(words) for text in findings_of(bench))
    plug(bench, used, "left")
    bench.run(3_000)
    assert {p.outcome for p in bench.run(1_000) if isinstance(p, m.Ping)} == {m.Outcome.ECHO}
    assert bench.parts.wiring == m.Wiring.OK
