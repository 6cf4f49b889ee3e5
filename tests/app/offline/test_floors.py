# SPDX-License-Identifier: MIT
"""Heights and floors from pressure: stays, levels, the record's file, the command, real climbs."""

from __future__ import annotations

import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from typer.testing import CliRunner

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep_app.cli import app
from echostep_app.offline.floors.floor_table import checked_heights, parse_heights
from echostep_app.offline.floors.floors import Floors, record_floors
from echostep_app.offline.floors.pressure_csv import Pressures, load_pressures
from echostep_app.offline.floors.stays import height_record, heights_by_pressure, noise_m
from needs_data import data_or_skip

STOREYS = np.array([0.0, 3.5, 7.0])
UNEVEN = np.array([0.0, 5.0, 8.5])
METRE_PA = 11.8  # on the ground


def record(
    height_m: Floats, rate_hz: float = 9.0, noise_pa: float = 3.0, extra_pa: NDArray[Any] | float = 0.0, seed: int = 1
) -> Pressures:
    rng = np.random.default_rng(seed)
    n = len(height_m)
    air_pa = 101_325.0 * np.exp(-9.80665 * height_m / (287.053 * 293.15))  # a column of dry air at 20 degC
    return Pressures(np.arange(n) / rate_hz, air_pa + extra_pa + noise_pa * rng.standard_normal(n))


def stairs_up(rate_hz: float = 9.0, speed: float = 0.3) -> Floats:
    """A minute on the ground, stairs to 3.5 m, a minute there."""
    stand = np.zeros(round(60 * rate_hz))
    return np.concatenate([stand, np.linspace(0.0, 3.5, round(3.5 / speed * rate_hz)), stand + 3.5])


def floors_of(samples: Pressures, heights_m: Floats, start: int | None = None) -> Floors:
    return record_floors(samples.t_s, height_record(samples), heights_m, start)


def heights_of(samples: Pressures) -> Floats:
    """Heights above the start at the samples."""
    record = height_record(samples)
    return record.height_m[record.segment]


def test_stairs_are_climbed_between_two_stays() -> None:
    found = height_record(record(stairs_up()))
    before, after = found.stays
    assert after.first_m - before.last_m == pytest.approx(3.5, abs=0.3)
    assert found.t_s[before.end - 1] == pytest.approx(60.0, abs=3.0)
    assert found.t_s[after.begin] == pytest.approx(72.0, abs=3.0)


@pytest.mark.parametrize("size_pa", [-50.0, -20.0, 20.0, 50.0])
@pytest.mark.parametrize("held_s", [0.5, 5.0])
def test_a_door_moves_nobody(size_pa: float, held_s: float) -> None:
    n = 1200
    t = np.arange(n) / 9.0
    pulse = size_pa * ((t > 60.0) & (t < 60.0 + held_s))
    samples = record(np.full(n, 3.5), extra_pa=pulse)
    found = floors_of(samples, STOREYS, 1)
    assert (found.floor == 1).all()
    assert abs(heights_of(samples)[-1]) < 0.5


def test_a_building_under_pressure_for_good_moves_nobody() -> None:
    n = 1200
    step = -25.0 * (np.arange(n) > 600)
    found = floors_of(record(np.full(n, 3.5), extra_pa=step), STOREYS, 1)
    assert (found.floor == 1).all()


def test_spikes_are_no_heights() -> None:
    way = stairs_up()
    samples = record(way)
    samples.pressure_pa[::97] += 400.0
    found = floors_of(samples, STOREYS, 0)
    right = found.floor == np.abs(way[:, None] - STOREYS).argmin(axis=1)
    assert right.mean() > 0.98
    assert found.floor[-1] == 1


def test_an_unknown_start_is_uniform_unless_the_heights_tell() -> None:
    way = np.concatenate([np.zeros(400), np.linspace(0.0, 5.0, 150), np.full(400, 5.0)])
    unmoved = floors_of(record(way[:300]), UNEVEN)
    assert (unmoved.floor == 0).all()
    assert unmoved.probability[-1] == pytest.approx(1 / 3, abs=0.05)
    found = floors_of(record(way), UNEVEN)
    assert (found.floor[:390] == 0).all()
    assert found.floor[-1] == 1
    assert found.probability[-1] > 0.9


def test_the_range_of_floors_excludes_starts() -> None:
    way = np.concatenate([np.zeros(400), np.linspace(0.0, 7.0, 240), np.full(400, 7.0)])
    found = floors_of(record(way), STOREYS)
    assert (found.floor[[100, -1]] == [0, 2]).all()
    assert found.probability.min() > 0.9


@settings(max_examples=15, deadline=None)
@given(st.lists(st.tuples(st.floats(0.01, 60.0), st.floats(20_000.0, 120_000.0)), min_size=1, max_size=30))
def test_any_pressures_have_finite_heights_and_probabilities(rows: list[tuple[float, float]]) -> None:
    samples = Pressures(np.cumsum([r[0] for r in rows]), np.array([r[1] for r in rows]))
    found = floors_of(samples, STOREYS)
    assert np.isfinite(found.height_m).all()
    assert (found.probability > 0.9 / 3).all()
    assert (found.probability < 1.0 + 1e-6).all()


def test_noise_is_measured_on_a_record() -> None:
    samples = record(stairs_up(), noise_pa=3.0)
    assert METRE_PA * noise_m(heights_by_pressure(samples)) == pytest.approx(3.0, rel=0.1)


def write(path: Path, samples: Pressures, factor: float = 1.0, seconds: float = 1.0) -> Path:
    rows = [
        f"{t * seconds:.6f},{p * factor:.4f}"
        for t, p in zip(samples.t_s.tolist(), samples.pressure_pa.tolist(), strict=True)
    ]
    path.write_text("\n".join(["t_s,pressure_pa", *rows]) + "\n")
    return path


def test_the_command_tells_floors_and_stays(tmp_path: Path) -> None:
    source, out = write(tmp_path / "up.csv", record(stairs_up())), tmp_path / "floors.csv"
    options = ["--heights", "0,3.5", "--out", str(out), "--picture", str(picture := tmp_path / "floors.svg")]
    result = CliRunner().invoke(app, ["floors", str(source), *options])
    assert result.exit_code == 0, result.output
    assert "climbed 3.5 m up, 0.0 m down" in result.output
    lines = out.read_text().splitlines()
    assert lines[0] == "t_s,floor,probability,height_m"
    assert len(lines) == 1 + len(stairs_up())
    assert [line.split(",")[1] for line in (lines[1], lines[-1])] == ["0", "1"]
    assert "height / m" in picture.read_text()
    assert f"floors: {out}, picture: {picture}" in result.output


@pytest.mark.parametrize(
    ("factor", "seconds", "words"),
    [
        (0.01, 1.0, "hPa"),
        (0.001, 1.0, "kPa"),
        (1.0, 1000.0, "milliseconds"),
        (1e-5, 1.0, "bar"),
        (30.0, 1.0, "not the pressure of air"),
    ],
)
def test_wrong_units_are_named(tmp_path: Path, factor: float, seconds: float, words: str) -> None:
    source = write(tmp_path / "unit.csv", record(stairs_up()), factor, seconds)
    with pytest.raises(EchostepError, match=words) as caught:
        load_pressures(source)
    assert str(source) in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no column t_s, pressure_pa"),
        ("t_s,pressure\n0,1\n", "line 1: no column pressure_pa"),
        ("t_s,pressure_pa\n", "no samples"),
        ("t_s,pressure_pa\n0,abc\n1,x\n2,100000\n", "line 2: no number in pressure_pa"),
        ("t_s,pressure_pa\n0,101325\n1,101325\n2,101325\n", "never changes"),
        ("t_s,pressure_pa\n5,101325\n4,101320\n3,101325\n2,101326\n", "line 3: t_s does not advance"),
        ("t_s,pressure_pa\n0,101325\n3,101320\n6,101325\n", "is it in seconds"),
        ("t_s,t_s,pressure_pa\n0,0,1\n", "two columns are named t_s"),
        ("t_s,pressure_pa\n" + "7" * 2000, "longer than"),
    ],
)
def test_bad_files_are_named(tmp_path: Path, text: str, words: str) -> None:
    source = tmp_path / "bad.csv"
    source.write_text(text)
    with pytest.raises(EchostepError, match=words):
        load_pressures(source)


@settings(max_examples=60, deadline=None)
@given(st.binary(max_size=400))
def test_garbage_is_refused_in_words(tmp_path_factory: pytest.TempPathFactory, junk: bytes) -> None:
    source = tmp_path_factory.mktemp("junk") / "junk.csv"
    source.write_bytes(b"t_s,pressure_pa,temperature_c\n" + junk)
    with pytest.raises(EchostepError):
        load_pressures(source)


@pytest.mark.parametrize("text", ["", "0,", "0,x", "3,0", "0,0.2", "nan,3", "0,1e9", "0 3"])
def test_impossible_heights_are_refused(text: str) -> None:
    with pytest.raises(EchostepError):
        parse_heights(text)
    with pytest.raises(EchostepError):
        checked_heights(np.zeros((2, 2)))


def test_a_start_that_is_no_floor_is_refused(tmp_path: Path) -> None:
    source = write(tmp_path / "up.csv", record(stairs_up()))
    for more in (["--heights", "0,3.5", "--start", "2"], ["--heights", "auto", "--start", "0"]):
        result = CliRunner().invoke(app, ["floors", str(source), *more, "--out", str(tmp_path / "o.csv")])
        assert isinstance(result.exception, EchostepError)


def climb(place: str) -> Pressures:
    """The BMP180 of a log: its start and end are dated to the second, its rows come evenly."""
    lines = (data_or_skip("baro") / f"{place}.log").read_text().splitlines()  # loruro/Barometer_STM32
    rows = [line.split(";") for line in lines if line[:1].isdigit() and line.count(";") == 2]
    t0, t1 = (
        datetime.datetime.strptime(line, "Date: %Y-%m-%d - %H:%M:%S") for line in lines if line.startswith("Date")
    )
    table = np.array(rows, float)
    t_s = np.arange(len(table)) * (t1 - t0).total_seconds() / len(table)
    return Pressures(t_s, table[:, 1] / 10.0, table[:, 2] / 1000.0)


@pytest.mark.parametrize(("place", "about_m"), [("kapitol", 41.2), ("b5", 31.15)])
def test_real_stairs_are_as_high_up_as_down(place: str, about_m: float) -> None:
    up, down = (heights_of(climb(f"{way}_{place}"))[-1] for way in ("up", "down"))
    print(f"{place}: {up:.2f} m up, {down:.2f} m down")
    assert -down == pytest.approx(up, rel=0.015)
    assert up == pytest.approx(about_m, rel=0.03)


@pytest.mark.parametrize(("place", "top_m", "floors"), [("kapitol", 41.2, 15), ("b5", 31.15, 10)])
@pytest.mark.parametrize("way", ["up", "down"])
def test_each_floor_of_real_stairs_is_passed_once_and_in_order(place: str, top_m: float, floors: int, way: str) -> None:
    """Storeys evenly between the ground and the top; an unknown start is resolved by the whole climb."""
    found = floors_of(climb(f"{way}_{place}"), np.linspace(0.0, top_m, floors))
    passed = found.floor[np.flatnonzero(np.diff(found.floor, prepend=-1))]
    assert passed.tolist() == list(range(floors) if way == "up" else reversed(range(floors)))
