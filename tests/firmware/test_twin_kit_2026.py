# SPDX-License-Identifier: MIT
"""The parts of the kit of 2026 in the twin, one by one: found, measured, and failing in their own ways."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from board_runs import ELF, TWIN, Bench, kinds, needs_twin, pings, quiet_rows
from echostep.board import messages as m
from echostep.board.reports import SUBSCRIBE
from echostep_app.board.faults.findings import part_text_of
from echostep_app.board.faults.health import board_findings, gyro_celsius
from echostep_simulation.devices.board import BoardProcess
from echostep_simulation.stimulus import EXTENDED_ROW, NO_SYNC

pytestmark = needs_twin


def begun(bench: Bench, *faults: str) -> Bench:
    """A board with these parts, subscribed, a second after its start."""
    bench.fault(*faults)
    bench.subscribe()
    bench.run(1_200)
    return bench


def pressures(found: list[m.Message]) -> list[m.Pressure]:
    return [x for x in found if isinstance(x, m.Pressure)]


@pytest.fixture
def barometer(bench: Bench) -> Bench:
    """A board of the papers with a BMP390, subscribed."""
    return begun(bench, "part_pressure=bmp390")


def test_the_bmp390_is_found_and_its_rate_and_pressure_are_right(barometer: Bench) -> None:
    assert barometer.parts.part_pressure == m.Part.BMP390
    assert part_text_of(barometer.reports, m.Healthy.PRESSURE) == "BMP390, identity 0x60"
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
    rows = quiet_rows(5_000)  # the part's low pass is settled
    rows["pressure"], rows["temperature"] = round(400.0 * hectopascal), round(20.0 * celsius)
    last = pressures(barometer.run(5_000, rows))[-1]
    assert abs(last.pressure - 400.0 * hectopascal) <= 1
    assert abs(last.temperature - 20.0 * celsius) <= 1


def test_the_slow_mode_of_the_bmp390(barometer: Bench) -> None:
    barometer.ask(m.Configure(0xFF, m.Schedule.CONCURRENT, 200, 10, m.PressureMode.HIGH_RESOLUTION))
    barometer.run(1_000)
    assert 5 <= len(pressures(barometer.run(2_000))) <= 7


def test_the_parts_of_the_papers_are_named(bench: Bench) -> None:
    bench.subscribe()
    bench.run(2_000)
    found = bench.parts
    assert found[1:9] == (
        m.Part.SRF02, m.Part.SRF02, m.Part.CMPS10, m.Part.ADIS16100, m.Part.ADIS16100, m.Part.ADIS16100, m.Part.SCP1000, 0,
    )  # fmt: skip
    assert found.identity_ranger_left == 6


JITTER_US = 2.0  # limit on the stamps and on the times of flight
CLOCK_BEGINS_US = 1_163  # of the true time, after power-up


def jitter_us(bench: Bench, side: str, answers: list[m.Ping]) -> float:
    """Spread of the stamps of a ranger's pings about its triggers."""
    truth_us = np.array([t for t, text in bench.board.trace if text == f"trigger {side}"]) * 1e-3
    stamps_us = np.array([p.ticks for p in answers]) * 0.5
    nearest_us = truth_us[np.abs(truth_us[:, None] - CLOCK_BEGINS_US - stamps_us).argmin(0)]
    return float(np.ptp(stamps_us - nearest_us))


@pytest.fixture
def rangers(bench: Bench) -> Bench:
    """A board of the papers with pulse rangers on both sides, subscribed."""
    return begun(bench, "part_ranger_left=pulse", "part_ranger_right=pulse")


SIDES = (("left", m.Ranger.LEFT), ("right", m.Ranger.RIGHT))


def test_pulse_rangers_are_found_and_timed_to_two_microseconds(rangers: Bench) -> None:
    """The stamps against the rising edges of the echo lines, with all other sensors running; both pings overlap at long ranges."""
    rows = quiet_rows(10_000)
    rng = np.random.default_rng(1)
    rows["own_us"] = rng.integers(1_000, 26_000, rows["own_us"].shape)
    found = rangers.run(10_000, rows)
    assert rangers.parts.part_ranger_left == rangers.parts.part_ranger_right == m.Part.PULSE
    for side, ranger in SIDES:
        answers = pings(found, ranger)
        assert len(answers) >= 145
        assert {p.outcome for p in answers} == {m.Outcome.ECHO}
        assert jitter_us(rangers, side, answers) <= JITTER_US


def test_the_time_of_flight_of_a_pulse_is_right_to_two_microseconds(rangers: Bench) -> None:
    for own_us in (200, 5_831, 15_003, 26_000):
        rows = quiet_rows(1_000)
        rows["own_us"] = own_us
        rangers.run(200, rows[:200])
        answers = [p for p in rangers.run(1_000, rows) if isinstance(p, m.Ping)]
        assert len(answers) >= 28
        assert max(abs(p.time_of_flight_us - own_us) for p in answers) <= JITTER_US


@pytest.mark.parametrize(("part", "cross_us"), [("srf02", 34_000), ("pulse", 45_000), ("maxsonar", 65_000)])
def test_an_echo_of_the_other_ping_moves_with_the_schedule(bench: Bench, part: str, cross_us: int) -> None:
    """An own one stays."""
    bench.fault(*(f"part_ranger_{side}={part}" for side, _ in SIDES))
    bench.run(1_700)
    rows = quiet_rows(5_000)
    rows["own_us"][:, 0], rows["own_us"][:, 1], rows["cross_us"][:, 0] = 0, 7_000, cross_us
    found = bench.run(5_000, rows)
    heard = [p.time_of_flight_us for p in pings(found, m.Ranger.LEFT) if p.outcome == m.Outcome.ECHO]
    assert len(heard) > 30
    assert np.ptp(heard) > 2_000
    assert np.ptp([p.time_of_flight_us for p in pings(found, m.Ranger.RIGHT)]) == 0


@pytest.mark.parametrize(("kind", "per_second"), [("deaf", 15), ("held", 11), ("long", 4)])
def test_a_pulse_ranger_without_an_echo_is_no_failure(rangers: Bench, kind: str, per_second: int) -> None:
    """Also one that holds its line for 70 or 200 ms: it is triggered again when the line is low."""
    rows = quiet_rows(2_000)
    rows["own_us"][:, 1] = rows["cross_us"] = 0
    rangers.fault(f"pulse_right={kind}")
    rangers.run(300, rows[:300])
    found = rangers.run(2_000, rows)
    answers = pings(found, m.Ranger.RIGHT)
    assert {p.outcome for p in answers} == {m.Outcome.NO_ECHO}
    assert len(answers) >= 2 * per_second
    assert kinds(found)["Compass"] >= 19  # its transfers wait for the triggers
    assert len(pings(found, m.Ranger.LEFT)) >= 30


def test_a_module_of_70_ms_is_found_in_open_space(bench: Bench) -> None:
    bench.fault(*(f"part_ranger_{side}=pulse" for side, _ in SIDES), *(f"pulse_{side}=held" for side, _ in SIDES))
    rows = quiet_rows(2_000)
    rows["own_us"] = rows["cross_us"] = 0
    bench.ask(SUBSCRIBE)
    bench.run(2_000, rows)
    found = bench.run(2_000, rows)
    assert {p.outcome for p in found if isinstance(p, m.Ping)} == {m.Outcome.NO_ECHO}
    assert bench.parts.part_ranger_left == bench.parts.part_ranger_right == m.Part.PULSE


@pytest.mark.parametrize("kit", ["2026", "papers"])
def test_hum_on_open_echo_lines_is_no_ranger(bench: Bench, kit: str) -> None:
    part = "pulse" if kit == "2026" else "srf"
    bench.fault(f"kit={kit}", f"{part}_left=absent", f"{part}_right=absent", "hum=50")
    bench.ask(SUBSCRIBE)
    rows = quiet_rows(3_000)
    rows["sync_us"] = NO_SYNC
    found = bench.run(3_000, rows)
    assert {p.outcome for p in found if isinstance(p, m.Ping)} == {m.Outcome.BUS_ERROR}
    assert bench.parts.part_ranger_left == bench.parts.part_ranger_right == m.Part.NONE
    assert kinds(found)["Sync"] <= 1


def test_sync_pulses_are_not_taken_for_a_pulse_ranger(bench: Bench) -> None:
    bench.fault("srf_left=absent", "srf_right=absent")
    found = bench.run(3_000)
    assert {p.outcome for p in found if isinstance(p, m.Ping)} == {m.Outcome.BUS_ERROR}
    assert kinds(found)["Sync"] >= 290


PLACES = ("thigh", "calf", "belt")


@pytest.fixture
def imus(bench: Bench) -> Bench:
    """A board of the papers with LSM6DSO on thigh, calf and belt, subscribed."""
    return begun(bench, *(f"part_{place}=lsm6dso" for place in PLACES))


def extended_rows(milliseconds: int) -> NDArray[Any]:
    """Rows with all axes: each axis of each place has its own value."""
    rows = np.zeros(milliseconds, EXTENDED_ROW)
    rows["row"] = quiet_rows(milliseconds)
    rows["motion"]["rate"] = np.arange(9).reshape(3, 3) * 100 - 300
    rows["motion"]["force"] = np.arange(9).reshape(3, 3) * 1_000 - 4_000
    rows["field"] = 1_000, -2_000, 3_000
    return rows


def test_all_axes_of_three_lsm6dso_come_at_200_hz(imus: Bench) -> None:
    found = imus.run(2_000, extended_rows(2_000))
    motions = [x for x in found if isinstance(x, m.Motion)]
    gyros = [x for x in found if isinstance(x, m.Gyros)]
    assert 399 <= len(motions) <= 401
    assert [x.ticks for x in motions] == [x.ticks for x in gyros]
    grid = motions[0].ticks + 10_000 * np.arange(len(motions))  # 5 ms
    late = [x.ticks for x in motions] - grid
    assert np.ptp(late) <= 1_200  # 0.6 ms [firmware/README.md]; 0.48 by avr-gcc 5.4, 0.57 by 16.2
    values = np.array(motions[-1][1:]).reshape(3, 2, 3)
    assert (values[:, 0] == np.arange(9).reshape(3, 3) * 100 - 300).all()
    assert (values[:, 1] == np.arange(9).reshape(3, 3) * 1_000 - 4_000).all()
    assert gyros[-1][1:] == tuple(round(z * 0.035 / 0.2439) for z in (-100, 200, 500))
    assert [imus.parts[1 + k] for k in (3, 4, 5)] == [m.Part.LSM6DSO] * 3
    assert imus.status.dropped_gyros == imus.reader.counts.lost == 0


def test_a_vibration_faster_than_the_samples_is_filtered(imus: Bench) -> None:
    """Polled at 200 Hz, 400 Hz would look like a slow force of 2 g."""
    imus.fault("imu_calf=vibrating")
    found = imus.run(1_000, extended_rows(1_000))
    forces = [x.calf_acceleration_z for x in found if isinstance(x, m.Motion)]
    assert np.ptp(forces) < 0.2 / 0.244e-3


def test_lsm6dso_test_themselves_at_the_start(imus: Bench) -> None:
    newest = imus.reports.gyros
    assert {x.self_test for x in newest.values()} == {m.SelfTest.PASSED}
    assert all(615 <= -x.response_st1 <= 2_870 and 615 <= x.response_st2 <= 2_870 for x in newest.values())
    assert all(abs(gyro_celsius(x) - 20.0) < 0.2 for x in newest.values())
    assert board_findings(imus.reports) == []


def test_lsm6dso_of_all_boards_pass_their_self_test() -> None:
    """The data sheet's limits are those of 2000 deg/s; at another range a good part may fail them."""
    for seed in range(1, 5):
        bench = Bench(BoardProcess([str(TWIN), "--elf", str(ELF), "--seed", str(seed)]))
        bench.fault("kit=2026")
        bench.run(2_500)
        bench.board.close()
        tested = [x for x in bench.messages if isinstance(x, m.GyroHealth)]
        assert {x.self_test for x in tested[-3:]} == {m.SelfTest.PASSED}


def test_a_saturated_lsm6dso_shows_its_full_scale(imus: Bench) -> None:
    imus.fault("imu_thigh=saturated")
    imus.run(100)
    assert {x.thigh for x in imus.run(200) if isinstance(x, m.Gyros)} == {4_702}


def test_old_and_new_gyros_may_be_mixed_and_swapped(imus: Bench) -> None:
    imus.fault("part_calf=adis16100")
    imus.run(2_500)
    found = imus.run(500)
    assert {x[1:] for x in found if isinstance(x, m.Gyros)} == {(41, -82, 5)}
    assert {(x.calf_rate_z, x.thigh_rate_z) for x in found if isinstance(x, m.Motion)} == {(-32768, 286)}
    assert (imus.parts.part_thigh, imus.parts.part_calf) == (m.Part.LSM6DSO, m.Part.ADIS16100)
    imus.fault("part_calf=lsm6dso")
    imus.run(2_500)
    assert {x[1:] for x in imus.run(500) if isinstance(x, m.Gyros)} == {(41, -82, 5)}
    assert imus.parts.part_calf == m.Part.LSM6DSO


@pytest.mark.parametrize("undefined", ["zeros", "ones", "noise"])
def test_an_imu_that_is_not_plugged_in_has_no_rate(bench: Bench, undefined: str) -> None:
    """The boards of the others hold MISO between a zero and a one; 0x0000 would be a good rate of an ADIS16100."""
    bench.fault("kit=2026", "imu_thigh=absent", f"miso_undefined={undefined}")
    bench.subscribe(extended_rows)
    bench.run(1_000, extended_rows(1_000))
    found = bench.run(2_000, extended_rows(2_000))
    assert {x.thigh for x in found if isinstance(x, m.Gyros)} == {-32768}
    assert all(x.calf == 29 and x.belt == 72 for x in found if isinstance(x, m.Gyros))
    assert not any(x.healthy & m.Healthy.THIGH for x in found if isinstance(x, m.Status))
    assert bench.parts.part_thigh == m.Part.NONE
    (text,) = [str(f) for f in board_findings(bench.reports)]
    assert text.startswith("thigh gyro: does not answer; check its SPI cable, 5 V and its chip select (D8)")
    bench.fault("imu_thigh=ok")
    bench.run(1_000, extended_rows(1_000))
    assert {x.thigh for x in bench.run(500, extended_rows(500)) if isinstance(x, m.Gyros)} == {-14}
    assert not [text for _, text in bench.board.trace if "misreads" in text]


@pytest.fixture
def magnetometer(bench: Bench) -> Bench:
    """A board of the papers with a LIS3MDL, subscribed."""
    return begun(bench, "part_compass=lis3mdl")


def fields_of(found: list[m.Message]) -> list[tuple[int, ...]]:
    return [x[1:] for x in found if isinstance(x, m.Magnetic)]


def test_the_field_of_a_lis3mdl_comes_at_the_compass_rate(magnetometer: Bench) -> None:
    found = magnetometer.run(2_000, extended_rows(2_000))
    assert 19 <= len(fields_of(found)) <= 21
    assert fields_of(found)[-1] == (1_000, -2_000, 3_000)
    assert not kinds(found)["Compass"]
    assert magnetometer.parts.part_compass == m.Part.LIS3MDL
    assert magnetometer.parts.identity_compass == 0x3D
    assert magnetometer.status.errors_compass == 0
    assert kinds(found)["Ping"] >= 56  # the bus is shared with SRF02


def test_an_older_host_reads_the_kit_of_2026_but_for_its_compass(bench: Bench) -> None:
    """A host that subscribes to nothing gets the messages that it knows."""
    bench.fault("kit=2026")
    bench.run(1_500)
    found = kinds(bench.run(2_000))
    assert set(found) <= {"Ping", "Gyros", "Pressure", "Identity", "Status", "GyroHealth"}
    assert found["Ping"] >= 56
    assert found["Gyros"] >= 399
    assert found["Pressure"] >= 24


def test_the_whole_kit_of_2026_at_once_keeps_all_rates(bench: Bench) -> None:
    bench.fault("kit=2026")
    bench.subscribe()
    bench.run(1_500)
    found = kinds(bench.run(5_000, extended_rows(5_000)))
    assert found["Ping"] >= 5 * 28
    assert min(found["Gyros"], found["Motion"]) >= 998
    assert found["Magnetic"] >= 48
    assert bench.reader.counts.lost == 0
    assert not any(v for k, v in bench.status._asdict().items() if k.startswith(("dropped_", "errors_")))
    assert bench.status.memory_used < 2_200
    assert board_findings(bench.reports) == []
