# SPDX-License-Identifier: MIT
"""What was believed once and never asked again: parts, settings and samples, each provoked to be wrong in the twin."""

from __future__ import annotations

import numpy as np
import pytest

from board_runs import ELF, TWIN, Bench, kinds, needs_twin, pings
from echostep.board import messages as m
from echostep_simulation.devices.board import BoardProcess
from echostep_simulation.stimulus import EXTENDED_ROW, NO_SYNC
from firmware.findings import findings_of

pytestmark = needs_twin
PLACES = ("thigh", "calf", "belt")
ALL_IMUS = m.Healthy.THIGH | m.Healthy.CALF | m.Healthy.BELT
ECHO_US = 5_831
RATES, FORCES, FIELD = (700, -350, 2_800), (100, -200, 4_098), (1_000, -2_000, 3_000)
GYROS = round(RATES[2] * 0.035 / 0.2439)  # counts of `gyros`
PRESSURE = (405_296, 400)


def rows(milliseconds: int) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    """Rows of a constant motion between two walls."""
    table = np.zeros(milliseconds, EXTENDED_ROW)
    table["row"]["sync_us"], table["row"]["own_us"] = NO_SYNC, ECHO_US
    table["row"]["pressure"], table["row"]["temperature"] = PRESSURE
    table["motion"]["rate"], table["motion"]["force"], table["field"] = RATES, FORCES, FIELD
    return table


def begin(bench: Bench, *faults: str) -> None:
    """A board with these faults, subscribed, a second after its start."""
    bench.fault(*faults)
    bench.subscribe(rows)
    bench.run(1_200, rows(1_200))


def wrong_values(found: list[m.Message], invalid: int = -32768) -> list[m.Message]:
    """Messages with a value that no part has measured."""
    right = {
        "Gyros": {GYROS, invalid},
        "Motion": {*RATES, *FORCES, invalid},
        "Magnetic": set(FIELD),
        "Pressure": set(PRESSURE),
    }
    return [x for x in found if not set(x[1:]) <= right.get(type(x).__name__, set(x[1:]))]


@pytest.mark.parametrize("errors", [1, 3])
def test_no_wrong_sample_of_a_belt_board_reaches_the_host(bench: Bench, errors: int) -> None:
    """P1: samples have no checksum; all parts on SPI are read twice."""
    begin(bench, "kit=2026")
    bench.fault(f"spi_errors={errors}")
    found = [x for _ in range(4) for x in bench.run(5_000, rows(5_000))]
    assert wrong_values(found) == []
    gyros = [x for x in found if isinstance(x, m.Gyros)]
    assert np.mean([m.GYROS_INVALID in x[1:] for x in gyros]) < 0.03 * errors * 3
    assert kinds(found)["Pressure"] > 200
    assert [text for text in findings_of(bench) if "sent wrong bits" in text]


@pytest.mark.parametrize("errors", [3, 10])
def test_no_wrong_field_reaches_the_host(bench: Bench, errors: int) -> None:
    """P1, on I2C: the compass is read twice."""
    begin(bench, "kit=2026")
    bench.fault(f"twi_errors={errors}")
    found = [x for _ in range(6) for x in bench.run(5_000, rows(5_000))]
    assert wrong_values(found) == []
    assert kinds(found)["Magnetic"] > 280 - 5 * errors


@pytest.mark.parametrize("value", [0x01, 0x20])
def test_a_reserved_register_may_read_anything(bench: Bench, value: int) -> None:
    """P2: register 0x1F of an LSM6DSO; three good parts had no rates."""
    begin(bench, "kit=2026", f"imu_reserved={value}")
    assert {x[1:] for x in bench.run(500, rows(500)) if isinstance(x, m.Gyros)} == {(GYROS,) * 3}
    assert findings_of(bench) == []


def test_a_part_that_is_confused_by_i3c_from_power_on_is_found(bench: Bench) -> None:
    """P3: its identity reads 0 until I3C is off, so I3C goes off first."""
    begin(bench, "kit=2026", "bootloader=none", *(f"imu_{place}=i3c" for place in PLACES))
    assert bench.status.healthy & ALL_IMUS == ALL_IMUS
    for _ in range(3):  # N5: the same after resets of the processor alone
        bench.fault("reset=external")
        bench.run(2_500, rows(2_500))
        assert bench.status.healthy & ALL_IMUS == ALL_IMUS


@pytest.mark.parametrize(("errors", "boards", "least"), [(30, 2, 30), pytest.param(10, 30, 40, marks=pytest.mark.long)])
def test_wrong_coefficients_of_the_bmp390_are_read_again(errors: int, boards: int, least: int) -> None:
    """P4: read once with a wrong bit, they made 8 kPa for the session, on five boards of thirty. Each is read again at once."""
    for seed in range(boards):
        bench = Bench(BoardProcess([str(TWIN), "--elf", str(ELF), "--seed", str(1 + seed)]))
        begin(bench, f"spi_errors={errors}", "kit=2026")
        bench.run(3_000, rows(3_000))
        bench.fault("spi_errors=0")
        bench.run(1_000, rows(1_000))
        bench.board.close()
        pressures = [x for x in bench.messages if isinstance(x, m.Pressure)]
        assert len(pressures) >= least
        assert wrong_values(list(pressures)) == []


@pytest.mark.parametrize("errors", [100, 300])
def test_settings_that_arrive_wrong_are_set_anew(bench: Bench, errors: int) -> None:
    """P5: all parts are plugged in anew while bits to them go wrong: a leg had half its speed for ever."""
    begin(bench, "kit=2026")
    bench.fault(f"mosi_errors={errors}", f"twi_errors={errors}")
    for part in ("imu_thigh", "imu_calf", "imu_belt", "bmp390", "lis3mdl"):
        bench.fault(f"{part}=absent", f"{part}=ok")
    bench.run(3_000, rows(3_000))
    bench.fault("mosi_errors=0", "twi_errors=0")
    bench.run(4_000, rows(4_000))
    found = bench.run(1_000, rows(1_000))
    assert wrong_values(found, invalid=0) == []
    assert {x.calf for x in found if isinstance(x, m.Gyros)} == {GYROS}
    assert kinds(found)["Magnetic"] >= 9
    assert kinds(found)["Pressure"] >= 11
    said = findings_of(bench)
    assert [x for x in said if x.startswith("calf gyro (LSM6DSO): sent wrong bits")]
    assert [x for x in said if x.startswith("compass (LIS3MDL): sent wrong bits") and "pull-ups" in x]


def test_settings_of_a_foot_that_arrive_wrong_are_set_anew(bench: Bench) -> None:
    begin(bench, "kit=foot", "mosi_errors=100")
    bench.run(3_000, rows(3_000))
    bench.fault("mosi_errors=0")
    bench.run(2_500, rows(2_500))
    found = [x for x in bench.run(1_000, rows(1_000)) if isinstance(x, m.Foot)]
    assert len(found) > 220
    assert {x[2:] for x in found} == {(*RATES, *FORCES)}


@pytest.mark.parametrize("seconds", [60, pytest.param(240, marks=pytest.mark.long)])
def test_a_belt_board_does_not_become_a_foot_board(bench: Bench, seconds: int) -> None:
    """P6: one reply in 1,024 of an idle line is an ICM-20649's, and switched all sensors off."""
    begin(bench, "kit=2026", "imu_thigh=absent", "miso_undefined=noise")
    for _ in range(seconds // 5):
        found = bench.run(5_000, rows(5_000))
    assert kinds(found)["Ping"] > 100
    assert kinds(found)["Gyros"] > 900
    assert bench.parts.part_foot == bench.parts.part_thigh == m.Part.NONE


@pytest.mark.parametrize("seconds", [50, pytest.param(200, marks=pytest.mark.long)])
def test_a_bare_board_with_a_noisy_line_becomes_nothing(bench: Bench, seconds: int) -> None:
    """P6: five equal answers, before anything else is known."""
    absent = ("imu_thigh", "imu_calf", "lis3mdl", "pulse_left", "pulse_right")
    begin(bench, "kit=2026", "miso_undefined=noise", *(f"{name}=absent" for name in absent))
    for _ in range(seconds // 5):
        bench.run(5_000, rows(5_000))
    assert set(bench.parts[1:9]) == {m.Part.NONE, m.Part.LSM6DSO, m.Part.BMP390}
    assert (bench.parts.part_belt, bench.parts.part_pressure) == (m.Part.LSM6DSO, m.Part.BMP390)


def test_noise_on_d13_is_no_ranger(bench: Bench) -> None:
    """P7: 153 of 154 pings were echoes of 17 to 86 cm."""
    begin(bench, "kit=2026", "pulse_right=absent", "d13_led=noise")
    found = [x for _ in range(6) for x in bench.run(5_000, rows(5_000))]
    assert {p.outcome for p in pings(found, m.Ranger.RIGHT)} == {m.Outcome.BUS_ERROR}
    assert bench.parts.part_ranger_right == m.Part.NONE
    assert [x for x in findings_of(bench) if x.startswith("right ranger: does not answer")]


def test_a_broken_echo_wire_makes_no_sync(bench: Bench) -> None:
    """P8: the board pulled D4 low and took its own edge for SyncOut's."""
    begin(bench, "kit=2026")
    bench.fault("pulse_left=absent")
    assert kinds(bench.run(5_000, rows(5_000)))["Sync"] <= 1  # of the break itself


def test_a_good_board_has_no_fault_in_its_first_second(bench: Bench) -> None:
    begin(bench, "kit=2026")
    for _ in range(20):
        bench.run(100, rows(100))
    assert findings_of(bench) == []


def test_a_bus_reset_between_two_looks_is_not_lost(bench: Bench) -> None:
    begin(bench, "kit=2026", "late_reset=on")
    assert kinds(bench.run(1_000, rows(1_000)))["Gyros"] > 190
    assert not [text for _, text in bench.board.trace if text.startswith("usb: no answer")]
