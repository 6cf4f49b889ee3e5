# SPDX-License-Identifier: MIT
"""Recorded barometers as phones have them: coarse steps, sensors that filter, silences, rows that repeat, storeys that are not stated.

First readings may be the reset value: they make no rise, and a file says that they were left out.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep_app.offline.floors.floor_table import describe, find_levels, visits
from echostep_app.offline.floors.floors import record_floors
from echostep_app.offline.floors.pressure_csv import Pressures, load_pressures
from echostep_app.offline.floors.stays import coarse_m, height_record, heights_by_pressure, noise_m
from offline.test_floors import STOREYS, heights_of, write

METRE_PA = 11.7


def walk(legs: list[tuple[float, float]], rate_hz: float) -> Floats:
    """Heights: each leg goes evenly to a height in so many seconds, from where the one before ended; the first begins at its own height."""
    found, at = [], legs[0][0]
    for to, seconds in legs:
        found.append(np.linspace(at, to, round(seconds * rate_hz)))
        at = to
    return np.concatenate(found)


UP_AND_DOWN = [
    (0.0, 40.0), (1.75, 6.3), (1.75, 1.5), (3.5, 6.3), (3.5, 30.0), (7.0, 14.0), (7.0, 60.0),
    (3.5, 11.0), (3.5, 3.0), (0.0, 11.0), (0.0, 40.0),
]  # fmt: skip


def record(
    heights_m: Floats, rate_hz: float, noise_pa: float = 2.0, step_pa: float = 0.01, drift_pa_h: float = 100.0
) -> Pressures:
    t = np.arange(len(heights_m)) / rate_hz
    noise = noise_pa * np.random.default_rng(11).standard_normal(len(t))
    pressure = 100_800.0 - METRE_PA * heights_m + drift_pa_h / 3600.0 * t + noise
    return Pressures(t, step_pa * np.rint(pressure / step_pa))


def right(samples: Pressures, heights_m: Floats, storeys_m: Floats, start: int | None = None) -> float:
    """Share of samples on the right floor; within a quarter of a metre of the middle both are."""
    away = np.abs(heights_m[:, None] - storeys_m)
    found = record_floors(samples.t_s, height_record(samples), storeys_m, start)
    return float((away[np.arange(len(away)), found.floor] <= away.min(axis=1) + 0.5).mean())


def levels(samples: Pressures) -> Floats:
    return find_levels(height_record(samples), "a.csv")


@pytest.mark.parametrize(("step_pa", "rate_hz"), [(4.0, 5.0), (10.0, 1.0), (10.0, 25.0)])
def test_coarse_steps_are_no_floors(step_pa: float, rate_hz: float) -> None:
    way = walk(UP_AND_DOWN, rate_hz)
    samples = record(way, rate_hz, 0.3, step_pa)
    assert METRE_PA * coarse_m(samples.pressure_pa) == pytest.approx(0.5 * step_pa, rel=0.1)
    assert right(samples, way, STOREYS) > 0.985
    assert levels(samples)[-1] == pytest.approx(7.0, abs=0.4)


def test_a_sensor_that_filters_is_not_more_exact() -> None:
    """Errors that last for a second are as bad as so many more of one sample."""
    way = walk(UP_AND_DOWN, 10.0)
    samples = record(way, 10.0, 0.0)
    lasting = np.convolve(np.random.default_rng(5).standard_normal(len(way) + 9), np.full(10, 10**-0.5), mode="valid")
    filtered = Pressures(samples.t_s, samples.pressure_pa + 3.0 * lasting)
    halves = heights_by_pressure(filtered)[:2230].reshape(-1, 5).mean(axis=1)  # of a second
    assert METRE_PA * noise_m(halves) > 2.0
    assert right(filtered, way, STOREYS) > 0.98


def silent(samples: Pressures, heights_m: Floats, from_s: float, to_s: float) -> tuple[Pressures, Floats]:
    kept = (samples.t_s < from_s) | (samples.t_s > to_s)
    return Pressures(samples.t_s[kept], samples.pressure_pa[kept]), heights_m[kept]


@pytest.mark.parametrize("start", [None, 0])
def test_what_happened_in_a_silence_is_weighed(start: int | None) -> None:
    """Two storeys up in 45 s that nobody saw: the pressure before and after tells, also where he began."""
    way = walk(UP_AND_DOWN, 5.0)
    samples, kept = silent(record(way, 5.0), way, 45.0, 100.0)
    assert right(samples, kept, STOREYS, start) > 0.99


def test_a_silence_moves_nobody() -> None:
    way = np.full(5 * 900, 3.5)
    samples, kept = silent(record(way, 5.0), way, 100.0, 700.0)
    assert right(samples, kept, STOREYS, 1) == 1.0
    assert abs(heights_of(samples)[-1]) < 2.0


def test_without_storeys_a_rise_in_a_silence_is_seen() -> None:
    way = walk(UP_AND_DOWN, 5.0)
    samples, _ = silent(record(way, 5.0), way, 45.0, 100.0)
    assert heights_of(samples)[np.searchsorted(samples.t_s, 110.0)] == pytest.approx(7.0, abs=0.7)


@pytest.mark.slow
@pytest.mark.parametrize(("rate_hz", "noise_pa"), [(1.0, 6.0), (5.0, 2.0), (25.0, 10.0)])
def test_unequal_storeys_are_found(rate_hz: float, noise_pa: float) -> None:
    legs = [
        (0.0, 40.0),
        (5.0, 19.0),
        (5.0, 40.0),
        (8.3, 13.0),
        (8.3, 40.0),
        (14.9, 12.0),
        (14.9, 40.0),
        (0.0, 16.0),
        (0.0, 40.0),
    ]
    assert levels(record(walk(legs, rate_hz), rate_hz, noise_pa)) == pytest.approx([0.0, 5.0, 8.3, 14.9], abs=0.5)


def test_stays_of_twelve_seconds_are_storeys() -> None:
    legs = [
        (0.0, 12.0), (3.5, 9.0), (3.5, 12.0), (7.0, 9.0), (7.0, 12.0), (10.5, 9.0), (10.5, 12.0), (0.0, 27.0), (0.0, 12.0),
    ]  # fmt: skip
    assert levels(record(walk(legs, 5.0), 5.0)) == pytest.approx([0.0, 3.5, 7.0, 10.5], abs=0.4)


def test_one_way_without_a_stay_has_two_ends() -> None:
    found = levels(record(walk([(20.0, 0.5), (0.0, 70.0)], 2.0), 2.0))
    assert found == pytest.approx([0.0, 20.0], abs=1.5)


@pytest.mark.slow
def test_weather_lifts_no_storey() -> None:
    """Half an hour on each floor while the pressure falls by 2 hPa an hour."""
    legs = [(0.0, 1800.0), (3.5, 14.0), (3.5, 1800.0), (0.0, 12.0), (0.0, 900.0)]
    found = levels(record(walk(legs, 1.0), 1.0, drift_pa_h=-200.0))
    assert found == pytest.approx([0.0, 3.5], abs=0.25)


def test_a_building_under_pressure_is_no_storey() -> None:
    samples = record(np.zeros(600), 1.0, 3.0, drift_pa_h=0.0)
    samples.pressure_pa[100:400] -= 25.0
    with pytest.raises(EchostepError, match=r"a\.csv: heights: the record shows one storey only"):
        levels(samples)


def test_rows_with_the_time_of_the_row_before_are_skipped(tmp_path: Path) -> None:
    """Loggers write the last pressure again when there is no new one."""
    samples = record(walk(UP_AND_DOWN, 5.0), 5.0)
    thrice = Pressures(samples.t_s.repeat(3), samples.pressure_pa.repeat(3))
    found = load_pressures(write(tmp_path / "thrice.csv", thrice))
    assert len(found.samples.t_s) == len(samples.t_s)
    assert f"{2 * len(samples.t_s)} rows with the t_s of the row before" in found.notes[0]


BRIEF_VISIT = [
    (0.0, 40.0), (3.5, 11.0), (3.5, 2.0), (0.0, 11.0), (0.0, 40.0), (10.5, 33.0), (10.5, 30.0), (0.0, 33.0), (0.0, 2.0),
]  # fmt: skip


@pytest.mark.parametrize(
    ("way", "storeys", "floors", "climbed"),
    [
        (BRIEF_VISIT, 4, [0, 1, 0, 3, 0], 14.0),
        (UP_AND_DOWN, 3, [0, 1, 2, 0], 7.0),
        ([(0.0, 20.0), (10.5, 35.0), (0.0, 35.0)], 4, [0, 3, 0], 10.5),
    ],
)
@pytest.mark.parametrize("rate_hz", [1.0, 5.0])
def test_what_is_printed_agrees_with_the_rows(
    way: list[tuple[float, float]], storeys: int, floors: list[int], climbed: float, rate_hz: float
) -> None:
    """A visit of two seconds is no stay, but the way turned there; each printed span has one floor in every row, and the climbs add up."""
    samples = record(walk(way, rate_hz), rate_hz)
    above = height_record(samples)
    found = record_floors(samples.t_s, above, np.arange(0.0, 3.5 * storeys, 3.5))
    visited = visits(found, above)
    for visit in visited:
        rows = (found.t_s >= visit.from_s) & (found.t_s <= visit.to_s)
        assert set(found.floor[rows].tolist()) == {visit.floor}
    assert [visit.floor for visit in visited] == floors
    lines = describe(found, above).splitlines()
    assert f"climbed {climbed:.1f} m up, {climbed:.1f} m down" in lines[len(floors)]


RNG = np.random.default_rng(1)
T_S = np.arange(0, 150, 0.1)
CLIMB_PA = 100_944.0 * np.exp(-np.interp(T_S, [0, 60, 75, 150], [0, 0, 3.5, 3.5]) / 8434) + RNG.normal(0, 1.5, 1500)


@pytest.mark.parametrize("first_pa", [None, 81_732.34, 60_982.0, 100_884.0, 100_794.0, 100_994.0])
def test_a_wrong_first_sample_makes_no_rise_and_hides_none(first_pa: float | None) -> None:
    pressure_pa = CLIMB_PA.copy()
    if first_pa:
        pressure_pa[0] = first_pa
    height_m = heights_of(Pressures(T_S, pressure_pa))
    assert height_m[1400] - height_m[500] == pytest.approx(3.5, abs=0.3)
    assert height_m[-1] == pytest.approx(3.5, abs=0.3)


def test_a_lift_from_the_first_sample_on_is_a_rise() -> None:
    pressure_pa = 101_325.0 * np.exp(-np.minimum(5.0 * T_S, 60.0) / 8434)
    assert heights_of(Pressures(T_S, pressure_pa))[-1] == pytest.approx(60.0, abs=2.0)


@pytest.mark.parametrize(("wrong", "pa"), [(0, 0.0), (1, 68_500.0), (5, 118_000.0)])
def test_a_file_says_how_many_first_readings_were_left_out(tmp_path: Path, wrong: int, pa: float) -> None:
    pressure_pa = CLIMB_PA.copy()
    pressure_pa[:wrong] = pa
    record = load_pressures(write(tmp_path / "p.csv", Pressures(T_S, pressure_pa)))
    assert len(record.samples.t_s) == len(T_S) - wrong
    expected = f"{wrong} rows before the barometer had settled, as its reset value: skipped (first: line 2)"
    assert record.notes == ((expected,) if wrong else ())


def test_a_spike_or_a_slammed_door_in_the_middle_leaves_nothing_out(tmp_path: Path) -> None:
    pressure_pa = CLIMB_PA.copy()
    pressure_pa[300] = 99_000.0
    pressure_pa[500:503] -= 60.0
    assert load_pressures(write(tmp_path / "p.csv", Pressures(T_S, pressure_pa))).notes == ()
