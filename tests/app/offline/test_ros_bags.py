# SPDX-License-Identifier: MIT
"""Bags of ROS 2, written by rosbags in both storages and as two distributions do: the samples of a topic; what is no such bag is one sentence."""

from __future__ import annotations

from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from command_line import echostep as run
from echostep.board.calibration import SPEED_OF_SOUND_M_S
from echostep.board.messages import Ping, Pressure
from echostep.errors import EchostepError
from echostep.recording import Decoder, read_capture
from echostep_app.offline.foot_files import load_foot
from echostep_app.offline.foreign_columns import Naming
from foot.foot_walks import walking

STORAGES = [(plugin, store) for plugin in StoragePlugin for store in (Stores.ROS2_HUMBLE, Stores.ROS2_JAZZY)]
BEGIN_S = 1_700_000_000
TYPE = "sensor_msgs/msg/"
Rows = dict[tuple[str, str], np.ndarray]  # of topic and type: time, values


@pytest.fixture(scope="module")
def walk() -> np.ndarray:
    """A simulated walk of twelve steps: time, force, rate (n, 7)."""
    return np.column_stack(walking(12))


def bag(path: Path, rows: Rows, storage: Any = STORAGES[0], frames: str = "foot", begin_s: int = BEGIN_S) -> Path:
    """A bag of these topics; `frames`: one after the other, that of a sensor without rates: ?; the stamps begin at `begin_s`, without all are 0."""
    store = get_typestore(storage[1])
    types: Any = store.types
    vector, zeros = types["geometry_msgs/msg/Vector3"], np.zeros(9) - ("?" in frames)
    turn = types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
    variance = (0.0,) * (storage[1] is Stores.ROS2_JAZZY)
    values: dict[str, Any] = {
        "Imu": lambda v: (turn, zeros, vector(*v[3:]), zeros, vector(*v[:3]), zeros),
        "FluidPressure": lambda v: (v[0], 0.0),
        "Range": lambda v: (0, 0.1, 0.2, 6.0, v[0], *variance),
        "Temperature": lambda v: (v[0], 0.0),
    }
    with Writer(path, version=9, storage_plugin=storage[0]) as writer:
        for (topic, kind), table in rows.items():
            connection = writer.add_connection(topic, TYPE + kind, typestore=store)
            for (t_s, *v), frame in zip(table.tolist(), cycle(frames.split()), strict=False):
                nanoseconds = round(1e9 * t_s) + 10**9 * begin_s if begin_s else 0
                time = types["builtin_interfaces/msg/Time"](*divmod(nanoseconds, 10**9))
                message = types[TYPE + kind](types["std_msgs/msg/Header"](time, frame), *values[kind](v))
                writer.write(connection, 10**9 + round(1e9 * t_s), store.serialize_cdr(message, TYPE + kind))
    return path


def refused(path: Path, **topics: str) -> str:
    with pytest.raises(EchostepError) as error:
        load_foot(path, Naming(topics))
    return str(error.value)


@pytest.mark.parametrize("storage", STORAGES)
def test_a_bag_is_imported_whole(storage: Any, walk: np.ndarray, tmp_path: Path) -> None:
    """Its folder or its file; pressure and ranges of the same bag, a range beyond the limits being no echo."""
    t_s = walk[::20, 0]
    left = np.column_stack([t_s, np.where(np.arange(len(t_s)) % 2, 2.0, np.inf)])
    air = np.column_stack([t_s, 1e5 + 8.0 * t_s])
    rows = {("/imu", "Imu"): walk, ("/air", "FluidPressure"): air, ("/left", "Range"): left, ("/right", "Range"): left}
    path, out = bag(tmp_path / "bag", rows, storage), tmp_path / "walk.mcap"
    (file,) = (each for each in path.iterdir() if each.suffix != ".yaml")
    for imu in map(load_foot, (path, file)):
        assert np.allclose(imu.t_s - BEGIN_S, walk[:, 0], atol=1e-6)
        assert np.array_equal(np.hstack([imu.accel, imu.gyro]), walk[:, 1:])
    done = run("import", path, "-o", out, "--pressure", path, "--ranges", file)
    assert done.returncode == 0, done.stderr
    messages = list(read_capture(out, Decoder()))
    pings = [message for message in messages if isinstance(message, Ping)]
    assert {round(ping.time_of_flight_us / 1e6 * SPEED_OF_SOUND_M_S / 2.0, 2) for ping in pings} == {0.0, 2.0}
    assert len(pings) == 2 * sum(isinstance(message, Pressure) for message in messages) == 2 * len(t_s)


def test_a_topic_is_asked_for(walk: np.ndarray, tmp_path: Path) -> None:
    rows = {("/foot", "Imu"): walk, ("/chest", "Imu"): walk * 0.5, ("/t", "Temperature"): walk[:2, :2]}
    path = bag(tmp_path / "bag", rows)
    assert f"bag: 2 topics of {TYPE}Imu for imu: say --columns imu=TOPIC; there are /chest ({TYPE}Imu), " in refused(
        path
    )
    assert np.array_equal(load_foot(path, Naming({"imu": "/foot"})).accel, walk[:, 1:4])
    assert f"no messages of {TYPE}Imu for imu: say --columns imu=TOPIC; there are" in refused(path, imu="/t")
    assert "--columns gx: a bag has no columns" in refused(path, gx="w")
    done = run("floors", path, "--heights", "auto", "-o", tmp_path / "floors.csv")
    assert done.returncode == 2
    assert f"no messages of {TYPE}FluidPressure for pressure" in done.stderr


def test_units_are_those_of_a_file(walk: np.ndarray, tmp_path: Path) -> None:
    path = bag(tmp_path / "bag", {("/imu", "Imu"): walk / [1.0, *[9.80665] * 3, 1.0, 1.0, 1.0]})
    assert "say --units g" in refused(path)
    assert np.allclose(load_foot(path, Naming(units={"force": "g"})).accel, walk[:, 1:4])


def test_samples_of_no_sensor_are_refused(walk: np.ndarray, tmp_path: Path) -> None:
    rows = {("/imu", "Imu"): walk[:200]}
    assert "/imu: the stamps of its headers are zero" in refused(bag(tmp_path / "a", rows, begin_s=0))
    assert "/imu: turned into the frame map: samples in the sensor's own" in refused(
        bag(tmp_path / "b", rows, frames="map")
    )
    assert "/imu: frames chest, foot: one sensor" in refused(bag(tmp_path / "c", rows, frames="foot chest"))
    assert "/imu: no rates or no forces (covariance -1)" in refused(bag(tmp_path / "d", rows, frames="?"))


@pytest.mark.parametrize("storage", STORAGES[::2])
def test_a_damaged_bag_is_one_sentence(storage: Any, walk: np.ndarray, tmp_path: Path) -> None:
    """Cut at each tenth of its length, or bytes in the middle are others; a folder without its file, a text of this name."""
    path = bag(tmp_path / "bag", {("/imu", "Imu"): walk}, storage)
    (file,) = (each for each in path.iterdir() if each.suffix != ".yaml")
    whole = file.read_bytes()
    for k in range(10):
        file.write_bytes(whole[: k * len(whole) // 10])
        assert "no bag of ROS 2 that can be read: " in refused(path)
    file.write_bytes(whole.replace(whole[2000:9000], b"\xff" * 7000))
    assert refused(file).startswith(f"{file}: ")
    file.unlink()
    assert "that can be read: Some database files are missing" in refused(path)
    file.write_text("t_s,ax\n")
    (path / "metadata.yaml").write_text("rosbag2_bagfile_information: [")
    for each in (path, file):
        assert "no bag of ROS 2 that can be read: " in refused(each)
