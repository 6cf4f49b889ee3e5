# SPDX-License-Identifier: MIT
"""Each part of both kits in the twin, failing in each of its ways: it alone falls silent, it is named with the cause, and it comes back."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import pytest

from board_runs import Bench, needs_twin, quiet_rows
from echostep.board import messages as m
from echostep_app.board.faults.health import board_findings
from firmware.findings import findings_of
from firmware.test_twin_kit_2026 import extended_rows

pytestmark = needs_twin

GYROS = ("thigh", "calf", "belt")
I2C, SPI = "does not answer at I2C address", "does not answer"


@dataclass(frozen=True)
class Failure:
    """What is plugged in, the switch of the part and its setting, what it measures, and how the failure is reported."""

    plugged: str
    switch: str
    measures: str
    cause: m.Fault | None
    words: str


def failures(plugged: str, part: str, measures: str, *ways: tuple[str, m.Fault | None, str]) -> list[Failure]:
    return [Failure(plugged, f"{part}={way}", measures, cause, words) for way, cause, words in ways]


NO_ANSWER, ALWAYS, NEVER, BAD = m.Fault.NO_ANSWER, m.Fault.ALWAYS_READY, m.Fault.NEVER_READY, m.Fault.BAD_VALUE
LINE = "foot sensor (ICM-20649): answers, but its data-ready line does not pulse"
WHILE_RUNNING = [
    *failures("", "srf_left", "ranger_left", ("absent", NO_ANSWER, f"left ranger: {I2C} 0x70")),
    *failures("", "srf_right", "ranger_right", *((way, NO_ANSWER, f"right ranger: {I2C} 0x71") for way in ("absent", "nack", "mute"))),
    *failures("", "thigh", "thigh", ("absent", NO_ANSWER, f"thigh gyro: {SPI}; check its SPI cable, 5 V and its chip select (D8)")),
    *(
        Failure("", f"{name}=wrong_channel", name, m.Fault.WRONG_CHANNEL, f"{name} gyro: answers with another channel")
        for name in GYROS
    ),
    *failures("", "belt", "belt", ("absent", NO_ANSWER, f"belt gyro: {SPI}"), ("zeros", NO_ANSWER, f"belt gyro: {SPI}")),
    *failures(
        "", "scp1000", "pressure", ("absent", NO_ANSWER, f"barometer: {SPI}"), ("zeros", NO_ANSWER, f"barometer: {SPI}"),
        ("drdy_stuck", ALWAYS, "barometer: DRDY stays high"), ("drdy_low", NEVER, "barometer: has had no sample for 2 s"),
    ),
    *failures(
        "", "compass", "compass", ("absent", NO_ANSWER, f"compass: {I2C} 0x60"), ("nack", NO_ANSWER, f"compass: {I2C} 0x60"),
        ("bad_value", BAD, "compass: gives bearings above"),
    ),
    *failures(
        "part_pressure=bmp390", "bmp390", "pressure", ("absent", NO_ANSWER, f"barometer (BMP390): {SPI}"),
        ("zeros", NEVER, "barometer (BMP390): has had no sample for 2 s"),
        ("stuck_ready", ALWAYS, "barometer (BMP390): reports a sample that it cannot have yet"),
        ("never_ready", NEVER, "barometer (BMP390): has had no sample for 2 s"),
    ),
    *failures(
        "part_ranger_left=pulse part_ranger_right=pulse", "pulse_left", "ranger_left",
        ("absent", ALWAYS, "left ranger (pulse ranger): its echo line stays high; check its plug"),
        ("stuck_low", NO_ANSWER, "left ranger (pulse ranger): does not answer its trigger"),
        ("stuck_high", ALWAYS, "left ranger (pulse ranger): its echo line stays high"),
    ),
    *failures(
        " ".join(f"part_{place}=lsm6dso" for place in GYROS), "imu_calf", "calf", ("absent", NO_ANSWER, f"calf gyro (LSM6DSO): {SPI}"),
        ("zeros", NO_ANSWER, f"calf gyro (LSM6DSO): {SPI}"), ("never_ready", NEVER, "calf gyro (LSM6DSO): has no new rates"),
    ),
    *failures(
        "part_compass=lis3mdl", "lis3mdl", "compass", ("absent", NO_ANSWER, f"compass (LIS3MDL): {I2C} 0x1C or 0x1E"),
        ("nack", NO_ANSWER, f"compass (LIS3MDL): {I2C} 0x1C or 0x1E"), ("never_ready", NEVER, "compass (LIS3MDL): has no new field"),
    ),
    *failures(
        "part_ranger_left=maxsonar part_ranger_right=maxsonar", "maxsonar_left", "ranger_left",
        *((way, NO_ANSWER, f"left ranger (MaxSonar): {I2C} 0x70") for way in ("absent", "nack", "mute")),
        ("misread", BAD, "left ranger (MaxSonar): gives ranges above 765 cm"),
    ),
    *failures(
        "kit=foot", "icm20649", "foot", *((way, NO_ANSWER, f"foot sensor (ICM-20649): {SPI}") for way in ("absent", "zeros")),
        ("never_ready", NEVER, LINE), ("stuck_ready", NEVER, LINE),
    ),
]  # fmt: skip
FROM_THE_START = [
    *failures("", "scp1000", "pressure", ("no_eeprom", m.Fault.EEPROM, "barometer: EEPROM"), ("no_start", m.Fault.NEVER_STARTED, "barometer: ")),
    *failures(
        "part_pressure=bmp390", "bmp390", "pressure", ("empty", m.Fault.EEPROM, "barometer (BMP390): its calibration reads with a wrong check sum"),
        ("wrong_identity", None, "barometer: holds a part that the firmware does not know (identity register 0x58)"),
    ),
    *failures("part_thigh=lsm6dso", "imu_thigh", "thigh", ("wrong_identity", None, "thigh gyro: ")),
    *failures(
        "part_compass=lis3mdl", "lis3mdl", "compass",
        ("wrong_identity", None, "compass: holds a part that the firmware does not know (identity register 0x40)"),
    ),
    *failures("kit=foot", "icm20649", "foot", ("wrong_identity", None, "thigh gyro: an ICM-20948 answers at its chip select")),
]  # fmt: skip


def measured(found: list[m.Message]) -> Counter[str]:
    """Number of good values of each quantity."""
    values = Counter[str]()
    for x in found:
        if isinstance(x, m.Ping):
            values["ranger_left" if x.ranger == m.Ranger.LEFT else "ranger_right"] += x.outcome == m.Outcome.ECHO
        elif isinstance(x, m.Gyros):
            values.update(name for name in GYROS if getattr(x, name) != m.GYROS_INVALID)
        elif isinstance(x, m.Compass | m.Magnetic):
            values["compass"] += not isinstance(x, m.Compass) or x.bearing <= 3599
        elif isinstance(x, m.Pressure | m.Foot):
            values[type(x).__name__.lower()] += 1
    return values


def causes(bench: Bench, quantity: str) -> set[int]:
    """All causes that were reported of a part."""
    if quantity == "foot":
        return {x.fault for x in bench.messages if isinstance(x, m.FootHealth)}
    return {getattr(x, f"fault_{quantity}") for x in bench.messages if isinstance(x, m.Status)}


def named(failure: Failure) -> str:
    return failure.switch


def begun(bench: Bench, *switches: str) -> Callable[[int], list[m.Message]]:
    """A board with these parts, subscribed; what it sends in so many milliseconds, on a foot or on a belt that stand still."""
    bench.fault(*switches)
    bench.subscribe()
    rows = extended_rows if "kit=foot" in switches else quiet_rows
    return lambda milliseconds: bench.run(milliseconds, rows(milliseconds))


@pytest.mark.parametrize("failure", WHILE_RUNNING, ids=named)
def test_a_part_that_fails_is_named_and_comes_back(bench: Bench, failure: Failure) -> None:
    run = begun(bench, *failure.plugged.split())
    run(2_000)
    before = measured(run(1_000))
    assert before[failure.measures]
    assert board_findings(bench.reports) == []
    bench.fault(failure.switch)
    run(3_500 if failure.measures == "pressure" else 2_200)
    silent = measured(run(1_000))
    assert [name for name, count in before.items() if silent[name] < 0.75 * count] == [failure.measures]
    assert not silent[failure.measures]
    assert failure.cause in causes(bench, failure.measures)
    assert any(text.startswith(failure.words) for text in findings_of(bench))
    bench.fault(failure.switch.partition("=")[0] + "=ok")
    run(4_500 if failure.measures == "pressure" else 3_000)
    assert measured(run(1_000))[failure.measures] >= 0.9 * before[failure.measures]
    assert board_findings(bench.reports) == []


@pytest.mark.parametrize("failure", FROM_THE_START, ids=named)
def test_a_part_that_is_wrong_from_the_start_is_named(bench: Bench, failure: Failure) -> None:
    run = begun(bench, *failure.plugged.split(), failure.switch)
    run(2_500)
    assert not measured(bench.messages)[failure.measures]
    assert failure.cause is None or failure.cause in causes(bench, failure.measures)
    assert any(text.startswith(failure.words) for text in findings_of(bench))
    bench.fault(failure.switch.partition("=")[0] + "=ok")
    run(4_500)
    assert measured(run(1_000))[failure.measures]


SWAPPED = {  # at first the parts are those of the papers
    "barometers": ("part_pressure={}", ("bmp390",)),
    "compasses": ("part_compass={}", ("lis3mdl",)),
    "rangers of one bus": ("part_ranger_left={0} part_ranger_right={0}", ("maxsonar", "srf02")),
    "rangers of two kinds": ("part_ranger_left={0} part_ranger_right={0}", ("pulse", "maxsonar")),
}


@pytest.mark.parametrize("kind", SWAPPED)
def test_parts_may_be_swapped_in_mid_walk_and_survive_a_reset(bench: Bench, kind: str) -> None:
    run = begun(bench)
    plugged, parts = SWAPPED[kind]
    everything = {"belt", "calf", "compass", "pressure", "ranger_left", "ranger_right", "thigh"}

    def is_seen(part: str) -> bool:
        """Whether all is measured in the next second, and the part is named."""
        values = measured(run(1_000))
        return {name for name in values if values[name]} == everything and part.upper() in {
            m.Part(value).name for value in bench.parts[1:9]
        }

    for part in parts:
        bench.fault(*plugged.format(part).split())
        assert any(is_seen(part) for _ in range(6))
        bench.fault("reset=watchdog")
        bench.subscribe()
        pings = ({p.outcome for p in run(1_000) if isinstance(p, m.Ping)} for _ in range(3))
        assert any(found == {m.Outcome.ECHO} for found in pings)
        after_a_crash = ("was not tested", "restarted")
        assert [
            f for f in board_findings(bench.reports)[1:] if not any(words in str(f) for words in after_a_crash)
        ] == []
