# SPDX-License-Identifier: MIT
"""Recordings of a foot as other programs keep them: one walk in each format gives the same samples; what a format lacks is one sentence."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from scipy.spatial.transform import Rotation

from echostep.errors import EchostepError
from echostep_app.offline.foot_files import load_foot
from foot.foot_walks import walking

G = 9.80665


@pytest.fixture(scope="module")
def walk() -> np.ndarray:
    """A simulated walk of four steps: time, force, rate (n, 7)."""
    return np.column_stack(walking(4))


def table(path: Path, header: str, *columns: np.ndarray) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.12g")
    return path


def sensor_logger(folder: Path, walk: np.ndarray) -> Path:
    """An archive of Android's: the axes from z to x, times since 1970 beside."""
    t_s, force, rate = walk[:, 0], walk[:, 3:0:-1], walk[:, 6:3:-1]
    names = "time,seconds_elapsed,z,y,x"
    table(folder / "Accelerometer.csv", names, 1.7e18 + 1e9 * t_s, t_s, force * 0.0)
    table(folder / "TotalAcceleration.csv", names, 1.7e18 + 1e9 * t_s, t_s, force)
    table(folder / "AccelerometerUncalibrated.csv", names, 1.7e18 + 1e9 * t_s, t_s, force / G)
    table(folder / "Gyroscope.csv", names, 1.7e18 + 1e9 * t_s, t_s, rate)
    with zipfile.ZipFile(folder / "walk.zip", "w") as packed:
        for file in folder.glob("*.csv"):
            packed.write(file, f"2026-11-28/{file.name}")
    return folder / "walk.zip"


def sensor_logger_of_ios(folder: Path, walk: np.ndarray) -> Path:
    """Gravity in a table of its own."""
    gravity = np.tile([0.0, 0.0, G], (len(walk), 1))
    for name, values in (("Accelerometer", walk[:, 1:4] - gravity), ("Gravity", gravity), ("Gyroscope", walk[:, 4:7])):
        table(folder / f"{name}.csv", "time,seconds_elapsed,x,y,z", 1e9 * walk[:, 0], walk[:, 0], values)
    return folder


def sensor_logger_of_an_iphone(folder: Path, walk: np.ndarray) -> Path:
    """The signs of iOS, as Metadata.csv tells."""
    (folder / "Metadata.csv").write_text('version,device name,platform,standardisation\n3,"A, B",ios,false\n')
    return sensor_logger_of_ios(folder, walk * [1, -1, -1, -1, 1, 1, 1])


def sensor_log(folder: Path, walk: np.ndarray) -> Path:
    """An iPhone's, with the signs of iOS."""
    names = "accelerometerTimestamp_sinceReboot(s)," + titles("accelerometerAcceleration{}(G)", "gyroRotation{}(rad/s)")
    return table(folder / "walk.csv", names, walk[:, 0], walk[:, 4:7], -walk[:, 1:4] / G)


def phyphox(folder: Path, walk: np.ndarray) -> Path:
    """The accelerometer's rows are others than the gyroscope's."""
    table(folder / "Accelerometer.csv", '"Time (s)","X (m/s^2)","Y (m/s^2)","Z (m/s^2)"', walk[:, :4])
    table(folder / "Gyroscope.csv", '"Time (s)","X (rad/s)","Y (rad/s)","Z (rad/s)"', walk[5:-5, 0], walk[5:-5, 4:7])
    return folder


def meta_base(folder: Path, walk: np.ndarray) -> Path:
    """A file of each sensor, with the seconds since its own start beside the time of day."""
    for name, unit, values in (
        ("Accelerometer", "g", walk[:, 1:4] / G),
        ("Gyroscope", "deg/s", np.degrees(walk[:, 4:7])),
    ):
        names = "epoch (ms),timestamp (-0700),elapsed (s)," + ",".join(f"{axis}-axis ({unit})" for axis in "xyz")
        elapsed_s = walk[:, 0] * 1.01
        table(folder / f"Left_E3_{name}_100.000Hz_1.4.2.csv", names, 1e3 * walk[:, 0], elapsed_s, elapsed_s, values)
    return folder


def titles(accel: str, gyro: str, letters: str = "XYZ") -> str:
    return ",".join(title.format(letter) for title in (gyro, accel) for letter in letters)


def x_imu3(folder: Path, walk: np.ndarray) -> Path:
    names = "Timestamp (us)," + titles("Accelerometer {} (g)", "Gyroscope {} (deg/s)")
    table(folder / "Inertial.csv", names, 1e6 * walk[:, 0], np.degrees(walk[:, 4:7]), walk[:, 1:4] / G)
    table(folder / "HighGAccelerometer.csv", "Timestamp (us),X", 1e6 * walk[:, 0], walk[:, 1])
    return folder


def ngimu(folder: Path, walk: np.ndarray) -> Path:
    names = "Time (s)," + titles("Accelerometer {} (g)", "Gyroscope {} (deg/s)")
    table(folder / "sensors.csv", names, walk[:, 0], np.degrees(walk[:, 4:7]), walk[:, 1:4] / G)
    return folder


def pyshoe(folder: Path, walk: np.ndarray) -> Path:
    savemat(folder / "walk.mat", {"ts": walk[:, :1].T, "imu": walk[:, 1:7], "gt": walk[:, :3]})
    return folder / "walk.mat"


def sensor_connect(folder: Path, walk: np.ndarray) -> Path:
    names = "Time," + titles("inertial-6253.76535:scaledAccel{}", "inertial-6253.76535:scaledGyro{}")
    return table(folder / "walk.csv", names, walk[:, 0], walk[:, 4:7], walk[:, 1:4] / G)


def gaitmap(folder: Path, walk: np.ndarray) -> Path:
    names = titles("acc_{}", "gyr_{}", "xyz")
    above = ",".join(["", *["left_sensor"] * 6, *["right_sensor"] * 6]) + "\n"
    left = (np.degrees(walk[:, 4:7]), walk[:, 1:4])
    return table(folder / "walk.csv", f"{above},{names},{names}", walk[:, 0], *left, walk[:, 1:7] * 0.5)


PHONES = (sensor_logger, sensor_logger_of_ios, sensor_logger_of_an_iphone, sensor_log, phyphox, meta_base)
FORMATS = (*PHONES, x_imu3, ngimu, pyshoe, sensor_connect, gaitmap)


@pytest.mark.parametrize("made", FORMATS)
def test_one_walk_in_each_format(made: Callable[[Path, np.ndarray], Path], walk: np.ndarray, tmp_path: Path) -> None:
    imu = load_foot(made(tmp_path, walk))
    kept = np.searchsorted(walk[:, 0], imu.t_s - 1e-6)
    assert len(kept) >= len(walk) - 10
    assert np.allclose(imu.t_s, walk[kept, 0], atol=1e-6)
    assert np.allclose(imu.accel, walk[kept, 1:4], atol=1e-5)
    assert np.allclose(imu.gyro, walk[kept, 4:7], atol=1e-5)
    assert imu.notes[0].startswith("read ")
    assert ("mirrored" in str(imu.notes)) == (made is sensor_logger_of_ios)


def test_an_mvnx_file_gives_force_and_rates_of_the_foot(tmp_path: Path) -> None:
    """A foot that turns about a tilted axis at an uneven pace, at rest otherwise: the force is gravity in its own frame."""
    t_s = np.arange(300) / 100.0
    axis = np.array([0.6, 0.0, 0.8])
    turned = Rotation.from_rotvec((t_s + 0.2 * np.sin(3.0 * t_s))[:, None] * axis)
    frames = "".join(
        f'<frame time="{1e3 * t:.0f}" type="normal"><sensorFreeAcceleration>9 9 9 0 0 0</sensorFreeAcceleration>'
        f"<sensorOrientation>1 0 0 0 {' '.join(f'{value:.12f}' for value in turn.as_quat(scalar_first=True))}</sensorOrientation></frame>"
        for t, turn in zip(t_s, turned, strict=True)
    )
    file = tmp_path / "walk.mvnx"
    sensors = '<sensors><sensor label="Pelvis"/><sensor label="RightFoot"/></sensors>'
    file.write_text(
        f'<mvnx xmlns="http://www.xsens.com/mvn/mvnx"><subject frameRate="100">{sensors}<frames><frame type="identity"/>{frames}'
        "</frames></subject></mvnx>"
    )
    imu = load_foot(file)
    assert "the sensor of RightFoot: its rates are computed" in imu.notes[0]
    assert np.allclose(imu.accel, turned.inv().apply([0.0, 0.0, G])[1:], atol=1e-6)
    assert np.allclose(imu.gyro, (1.0 + 0.6 * np.cos(3.0 * (imu.t_s - 0.005)))[:, None] * axis, atol=1e-3)
    file.write_text(file.read_text().replace("RightFoot", "RightHand"))
    with pytest.raises(EchostepError, match=r"walk\.mvnx: no sensor of a foot; there are Pelvis, RightHand"):
        load_foot(file)


def refused(folder: Path, name: str, content: bytes) -> str:
    path = folder / name
    path.write_bytes(content)
    with pytest.raises(EchostepError) as error:
        load_foot(path)
    return str(error.value)


def test_what_a_file_lacks_is_one_sentence(tmp_path: Path) -> None:
    assert "a.xls: binary, not a table: export it as CSV" in refused(tmp_path, "a.xls", b"\xd0\xcf" + bytes(99))
    assert "a.json: JSON, not a table: export it as CSV" in refused(
        tmp_path, "a.json", b'[{"sensor":"Gyroscope","x":"0"}]'
    )
    lines = b"$COL,IMU,time,wx,ax\n$UNIT,IMU,s,deg/s,g\n$BARO,1,2\n$IMU,1,2,3\n"
    assert "lines begin with the kind of their numbers ($BARO, $IMU)" in refused(tmp_path, "a.csv", lines)
    assert "no XML" in refused(tmp_path, "a.mvnx", b"<mvnx><frame")
    assert "no MAT file that can be read" in refused(tmp_path, "a.mat", b"MATLAB 5.0 MAT-file" + bytes(200))
    savemat(tmp_path / "huge.mat", {"ts": np.arange(300) / 100.0, "imu": np.full((300, 6), 1e300)})
    with pytest.raises(EchostepError, match=r"huge\.mat: t_s does not advance"):
        load_foot(tmp_path / "huge.mat")
    savemat(tmp_path / "b.mat", {"angles": np.eye(3)})
    with pytest.raises(EchostepError, match=r"b\.mat: no timestamps_all or .* there are angles"):
        load_foot(tmp_path / "b.mat")
    with zipfile.ZipFile(tmp_path / "c.zip", "w") as packed:
        packed.writestr("Gyroscope.csv", "seconds_elapsed,x,y,z\n0,0,0,0\n1,0,0,0\n")
    with pytest.raises(
        EchostepError, match=r"c\.zip: no table of an accelerometer \(there are: gyroscope\); record both"
    ):
        load_foot(tmp_path / "c.zip")
    broken = bytearray((tmp_path / "c.zip").read_bytes())
    broken[40:60] = bytes(20)
    assert "c.zip: " in refused(tmp_path, "c.zip", bytes(broken))
