# SPDX-License-Identifier: MIT
"""Files of other loggers: recognised by their headers, or named by `--columns` and `--units`; the track is that of the same samples in SI."""

from __future__ import annotations

import shlex
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from command_line import echostep
from echostep.errors import EchostepError
from echostep_app.cli import app
from echostep_app.offline.floors.pressure_csv import load_pressures
from echostep_app.offline.foot_files import load_foot
from echostep_app.offline.foreign_columns import LOGGERS, OWN, Naming, parse_naming, read_header
from echostep_app.offline.leg_csv import load_legs, load_pair
from foot.foot_walks import walking
from needs_data import data_or_skip

G = 9.80665
AXES = ("x", "y", "z")
PAIRS = Naming({"t_s": "time", **{f"a{a}": f"acc_{a}" for a in AXES}, **{f"g{a}": f"gyr_{a}" for a in AXES}})


@pytest.fixture(scope="module")
def table() -> np.ndarray:
    """A simulated walk of six steps: time, force, rate (n, 7)."""
    return np.column_stack(walking(6))


def write(path: Path, header: str, rows: np.ndarray, separator: str = ",", above: str = "") -> Path:
    """The file of a logger."""
    np.savetxt(path, rows, delimiter=separator, header=above + header, comments="", fmt="%.9g")
    return path


def same(path: Path, table: np.ndarray, naming: Naming = OWN) -> tuple[str, ...]:
    """The file holds the table's samples, as far as its digits go; its notes."""
    imu = load_foot(path, naming)
    assert np.allclose(np.diff(imu.t_s), np.diff(table[:, 0]), atol=1e-5)
    assert np.allclose(imu.accel, table[:, 1:4], atol=1e-5)
    assert np.allclose(imu.gyro, table[:, 4:7], atol=1e-5)
    return imu.notes


def titles(accel: str, gyro: str, letters: str) -> list[str]:
    """Titles of the columns of three axes each."""
    return [title.format(letter) for title in (accel, gyro) for letter in letters]


@pytest.mark.parametrize("separator", [",", "\t"])
def test_a_file_of_phyphox_is_in_si_with_its_titles_in_quotes(
    separator: str, table: np.ndarray, tmp_path: Path
) -> None:
    names = ["Time (s)", *titles("Acceleration {} (m/s^2)", "Gyroscope {} (rad/s)", "xyz")]
    header = separator.join(f'"{name}"' for name in names)
    assert same(write(tmp_path / "a.csv", header, table, separator), table) == ("read as an export of phyphox",)


@pytest.mark.parametrize(
    "above", ["// Start Time: Unknown\n// Update Rate: 100.0Hz\n", "Acquisition frequency: 100 Hz\n"]
)
def test_an_export_of_mt_manager_counts_samples_and_the_counter_wraps(
    above: str, table: np.ndarray, tmp_path: Path
) -> None:
    counter = (65_500 + np.arange(len(table))) % 65_536
    header = "\t".join(["PacketCounter", *titles("Acc_{}", "Gyr_{}", "XYZ")])
    path = write(tmp_path / "MT_00.txt", header, np.column_stack([counter, table[:, 1:7]]), "\t", above)
    assert same(path, table) == ("read as an export of MT Manager",)
    write(path, f"{header}\tSampleTimeFine", np.column_stack([counter, table[:, 1:7], np.nan * counter]), "\t")
    with pytest.raises(EchostepError, match=r"MT_00\.txt: PacketCounter counts samples, .*Update Rate.*Fine is empty"):
        load_foot(path)


def test_an_export_of_picoquake_counts_samples_at_the_rate_above(table: np.ndarray, tmp_path: Path) -> None:
    above = "# PLab PicoQuake Data\n# Time: 2024-05-06, Device: A\n# Config: data_rate = 100.0 Hz, filter = 42 Hz\n\n"
    rows = np.column_stack([1 + np.arange(len(table)), table[:, 1:4] / G, np.degrees(table[:, 4:7])])
    path = write(tmp_path / "a.csv", "count," + ",".join(titles("a_{}", "g_{}", "xyz")), rows, above=above)
    assert same(path, table) == ("read as an export of PicoQuake",)


def test_a_file_of_an_openlog_artemis_goes_on_at_midnight(table: np.ndarray, tmp_path: Path) -> None:
    """Its times of day have hundredths of a second, and each line ends with a comma; the axes of its magnetometer are not those of its gyroscope."""
    at = datetime(2026, 11, 30, 23, 59, 58)
    times = [(at + timedelta(seconds=t_s)).strftime("%m/%d/%Y,%H:%M:%S.%f")[:-4] for t_s in table[:, 0].tolist()]
    rows = np.column_stack([table[:, 1:4] / G * 1e3, np.degrees(table[:, 4:7])])
    names = ",".join(titles("a{}", "g{}", "XYZ"))
    lines = [
        f"{time},{','.join(f'{v:.7g}' for v in row)},1.0,2.0,3.0,25.1,98.5,"
        for time, row in zip(times, rows, strict=True)
    ]
    path = tmp_path / "dataLog00001.TXT"
    path.write_text("\n".join([f"rtcDate,rtcTime,{names},mX,mY,mZ,imu_degC,output_Hz,", *lines]) + "\n")
    assert same(path, table) == ("read as an export of OpenLog Artemis",)
    assert load_foot(path).mag is None


DOT_ABOVE = (
    "sep=,\nDeviceTag:,bei\nFirmwareVersion:,1.6.0\nAppVersion:,2021.0\nStartTime: ,2021-08-30_17:05:05_000 GMT+8\n"
    "© Xsens Technologies B. V. 2005-2021\n\n"
)
DOT_LIVE = (
    "SyncStatus:,Synced,,,\nOutputRate:,60Hz,,,\nFilterProfile:,General,,,\nMeasurement Mode:,Rate quantities,,,\n"
)


@pytest.mark.parametrize(
    ("above", "more", "end"),
    [(DOT_ABOVE, "Euler_X,Euler_Y,Euler_Z,", ""), (DOT_ABOVE.replace("StartTime", DOT_LIVE + "StartTime"), "", ",")],
)
def test_an_export_of_movella_dot_counts_microseconds_and_turns_in_degrees(
    above: str, more: str, end: str, table: np.ndarray, tmp_path: Path
) -> None:
    """The clock wraps after 71 minutes; a recording's lines end with a comma."""
    clock = ((1 << 32) - 500_000 + np.round(table[:, 0] * 1e6)) % (1 << 32)
    header = f"PacketCounter,SampleTimeFine,{more}{','.join(titles('Acc_{}', 'Gyr_{}', 'XYZ'))}{end}"
    fused = np.zeros((len(table), more.count(",")))
    rows = np.column_stack([np.arange(len(table)), clock, fused, table[:, 1:4], np.degrees(table[:, 4:7])])
    path = tmp_path / "bei.csv"
    lines = [", ".join(f"{value:.12g}" for value in row) + end for row in rows]
    path.write_text(above + "\n".join([header, *lines]), encoding="utf-8")
    assert same(path, table) == ("read as an export of Movella DOT",)


def test_an_export_of_movella_dot_without_gravity_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "free.csv"
    path.write_text(DOT_ABOVE + "PacketCounter,SampleTimeFine,Euler_X,FreeAcc_X\n1,2,3,4\n", encoding="utf-8")
    with pytest.raises(EchostepError, match=r"free\.csv: an export of Movella DOT without .*Acc_X.* custom mode 5"):
        load_foot(path)


def test_no_logger_is_taken_for_another_one() -> None:
    for logger in LOGGERS:
        theirs = [*logger.has.values(), *logger.may_have.values()]
        more = [] if "SampleTimeFine" in theirs else ["SampleTimeFine"]  # as MT Manager has it, too
        above = [f"{logger.above},"] if logger.above else []
        header = read_header(iter(["// Update Rate: 100.0Hz", *above, ",".join(theirs + more)]))
        assert header.notes == (f"read as an export of {logger.name}",)
        assert set(logger.has) | set(logger.may_have) <= set(header.names)


def test_names_and_units_of_any_file_are_given(table: np.ndarray, tmp_path: Path) -> None:
    rows = np.column_stack([table[:, 0] * 1e3, table[:, 1:4] / G, np.degrees(table[:, 4:7]), table[:, :1]])
    names = ",".join([*PAIRS.columns.values(), "t_s"])  # a column of our name that is not ours
    path = write(tmp_path / "a.csv", names, rows)
    naming = Naming(PAIRS.columns, {"time": "ms", "force": "g", "rate": "deg/s"})
    assert same(path, table, naming) == ()
    pairs = ",".join(f"{ours}={theirs}" for ours, theirs in PAIRS.columns.items())
    assert parse_naming(pairs, "ms, g, deg/s") == naming


@pytest.mark.parametrize(("columns", "units", "said"), [
    ("t_s", None, "--columns t_s: pairs of names are expected, as t_s=time"),
    (None, "furlong", "--units furlong: unknown; there are s, ms, us"),
    (None, "g,mg", "--units g,mg: two units of one quantity"),
    ("t_s=clock", None, "a.csv: --columns t_s=clock: no column clock; there are time, acc_x"),
    (None, "hPa", "a.csv: --units hPa: no column has such a unit"),
    (None, None, "no column ax, ay, az, gx, gy, gz; there are t_s, acc_x, acc_y, acc_z, gyr_x, gyr_y, gyr_z; by their titles: --columns t_s=time,ax"),
])  # fmt: skip
def test_what_does_not_fit_is_one_line_that_names_it(
    columns: str | None, units: str | None, said: str, tmp_path: Path
) -> None:
    path = write(tmp_path / "a.csv", ",".join(PAIRS.columns.values()), np.zeros((9, 7)))
    options = [word for name, text in (("--columns", columns), ("--units", units)) if text for word in (name, text)]
    done = echostep("foot", path, *options, cwd=tmp_path)
    assert done.returncode == 2
    assert said in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_counter_without_a_rate_is_asked_about(table: np.ndarray, tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", f"count,{axes('acc_{}', 'gyro_{}')}", table * [100, 1, 1, 1, 1, 1, 1])
    asked = echostep("foot", path, cwd=tmp_path, ends=2).stderr
    options = shlex.split(asked.partition("by their titles: ")[2])
    assert "no line '// Update Rate: 100.0Hz' says how many" in asked
    assert "no line '// Update Rate" in echostep("foot", path, *options, cwd=tmp_path, ends=2).stderr
    path.write_text(f"// Update Rate: 100.0Hz\n{path.read_text()}")
    assert "6 steps" in echostep("foot", path, *options, cwd=tmp_path, ends=0).stdout


def test_a_stated_unit_is_believed_or_asked_about(table: np.ndarray, tmp_path: Path) -> None:
    units = [1e3, 1 / G, 1, 1e3 / G, 180 / np.pi, 180 / np.pi, 1]
    for titles in (
        "t (msec),ax (G),ay (m/s/s),az (mg),gx (dps),gy [deg/s],gz",
        "t_s,ax,ay,az,gx,gy,gz\nms,g,,mg,dps,deg/s,",
    ):
        assert not same(write(tmp_path / "a.csv", titles, table * units), table)
    for title in ("gx (rpm)", "gx (rev/s)", "gx (deg)", "ax (LSB)", "t (min)"):
        path = write(tmp_path / "b.csv", f"time,{title}", np.zeros((9, 2)))
        with pytest.raises(EchostepError, match=r"b\.csv: .*: its unit is none of"):
            load_foot(path)


def axes(*names: str) -> str:
    return ",".join(name.format(letter) for name in names for letter in "XYZ")


@pytest.mark.parametrize(("titles", "factors"), [
    (f"Timestamp (ms),{axes('Acc_{} [g]', 'Gyr_{} [deg/s]')},Temp", (1e3, 1 / G, 180 / np.pi)),
    (f"time,{axes('Acc{}', 'w{} (deg/s)')}", (1, 1, 180 / np.pi)),
    (f"time_us,{axes('accelerometer_{}', 'gyroscope_{}')}", (1e6, 1, 1)),
    (f"time,{axes('acc_{}_g', 'gyro_{}_dps')},{axes('LinAcc{}', 'Mag{}')}", (1, 1 / G, 180 / np.pi)),
    (f"field.header.stamp,{axes('field.linear_acceleration.{}', 'field.angular_velocity.{}')},%time", (1e9, 1, 1)),
    (f"#timestamp [ns],{axes('a_RS_S_{} [m s^-2]', 'w_RS_S_{} [rad s^-1]')}", (1e9, 1, 1)),
    (f'"sep=,"\nS_B5_Timestamp_Unix_CAL,{axes("S_B5_Accel_WR_{}_CAL", "S_B5_Gyro_{}_CAL", "S_B5_Accel_LN_{}_CAL")}\n'
     "ms,m/(s^2),m/(s^2),m/(s^2),deg/s,deg/s,deg/s,g,g,g", (1e3, 1, 180 / np.pi)),
])  # fmt: skip
def test_the_options_that_a_file_needs_are_proposed_by_its_titles(
    titles: str, factors: tuple[float, ...], table: np.ndarray, tmp_path: Path
) -> None:
    scale = np.repeat(factors, (1, 3, 3))
    rows = np.hstack([table * scale, np.zeros((len(table), titles.splitlines()[-1].count(",") - 6))])
    path = write(tmp_path / "a.csv", titles, rows)
    refused = echostep("foot", path, cwd=tmp_path)
    assert refused.returncode == 2
    options = refused.stderr.partition("by their titles: ")[2]
    assert options, refused.stderr
    done = echostep("foot", path, *shlex.split(options), cwd=tmp_path)
    assert "6 steps" in done.stdout, done.stderr


@pytest.mark.parametrize(("titles", "said"), [
    (f"time,{axes('LinAcc{}', 'Gyro{}')}", "LinAccX is without gravity, which a track needs: record the accelerometer itself"),
    (f"time,timestamp,{axes('Acc{}', 'Gyro{}')}", "other names: --columns OURS=THEIRS"),
    (axes("Acc{}", "Gyro{}"), "no column of times: add t_s in seconds, or one named count that counts the samples"),
    (f"time,{axes('Acc{} (LSB)', 'Gyro{}')}", "other names: --columns OURS=THEIRS"),
    (f"time,{axes('Acc{}', 'Acc.{}', 'Gyro{}')}", "other names: --columns OURS=THEIRS"),
    ("time,Acc X (g),AccY (m/s2),AccZ (g),GyroX,GyroY,GyroZ", "other names: --columns OURS=THEIRS"),
])  # fmt: skip
def test_titles_that_are_not_certain_are_not_proposed(titles: str, said: str, tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", titles, np.zeros((9, titles.count(",") + 1)))
    refused = echostep("foot", path, cwd=tmp_path)
    assert said in refused.stderr
    assert "by their titles" not in refused.stderr


def test_a_line_is_named_by_its_number_in_the_file_below_a_preamble(tmp_path: Path) -> None:
    above = "// Update Rate: 10.0Hz\n// a note\n"
    path = write(tmp_path / "a.csv", "t_s,pressure_pa", np.array([[0.0, 9.0], [0.1, 9.0]]), above=above)
    with pytest.raises(EchostepError, match="line 4: pressure_pa is 9"):
        load_pressures(path)


def test_legs_take_degrees_of_both_legs(tmp_path: Path) -> None:
    t_s = np.arange(0.0, 4.0, 0.01)
    legs = [np.sin(5.0 * t_s + k) for k in range(4)]
    own = write(
        tmp_path / "own.csv",
        "t_s,thigh_rad_s,shank_rad_s,other_thigh_rad_s,other_shank_rad_s",
        np.column_stack([t_s, *legs]),
    )
    theirs = write(tmp_path / "theirs.csv", "ms,lt,ls,rt,rs", np.column_stack([1e3 * t_s, *np.degrees(legs)]))
    columns = "t_s=ms,thigh_rad_s=lt,shank_rad_s=ls,other_thigh_rad_s=rt,other_shank_rad_s=rs"
    for ours, read in zip(load_pair([own]), load_pair([theirs], parse_naming(columns, "ms,deg/s")), strict=True):
        assert np.allclose(read.thigh, ours.thigh, atol=1e-6)
        assert np.allclose(read.shank, ours.shank, atol=1e-6)
    assert np.allclose(load_legs(theirs, "", parse_naming(columns, "ms,deg/s")).t_s, t_s)


@pytest.mark.parametrize(("header", "naming", "notes"), [
    ('"Time (s)","Pressure (hPa)"', OWN, ("read as an export of phyphox",)),
    ("seconds_elapsed,pressure,time", OWN, ("read as an export of Sensor Logger",)),
    ("t,p", parse_naming("t_s=t,pressure_pa=p", "hPa"), ()),
])  # fmt: skip
def test_pressures_of_phones_are_in_hectopascals(
    header: str, naming: Naming, notes: tuple[str, ...], tmp_path: Path
) -> None:
    t_s = np.arange(100.0)
    path = write(tmp_path / "a.csv", header, np.column_stack([t_s, 1000.0 + 0.001 * t_s]))
    record = load_pressures(path, naming)
    assert np.allclose(record.samples.pressure_pa, 100_000.0 + 0.1 * t_s)
    assert record.notes == notes


def test_the_public_exports_are_read_without_options(tmp_path: Path) -> None:
    for name, steps in (("xio_ngimu/short_walk.csv", 16), ("xsens_mtw_voisard/1-2_rf.txt", 17)):
        path = data_or_skip(name.partition("/")[0]) / name.partition("/")[2]
        shown = CliRunner().invoke(app, ["foot", str(path), "--out", str(tmp_path / "track.csv")])
        assert f"{steps} steps" in shown.output
