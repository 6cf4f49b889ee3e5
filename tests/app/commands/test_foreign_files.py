# SPDX-License-Identifier: MIT
"""`echostep info` of files that are no recording: one sentence says what it is and the next step."""

from __future__ import annotations

import gzip
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import Writer

from board_runs import ROOT
from command_line import echostep
from echostep_app.commands.actions.foreign import foreign

CAPTURES = ROOT / "tests/captures"
FOOT = b"\xef\xbb\xbft_s;ax;ay;az;gx;gy;gz\r\n0;0,1;0;9,81;0;0;0\r\n"
FILES = {
    "a.pcap": (b"\xd4\xc3\xb2\xa1\x02\x00\x04\x00" + bytes(16), "packets of a network or of USB", "tshark -r"),
    "a.pcapng": (b"\x0a\x0d\x0d\x0a\x1c\x00\x00\x00\x4d\x3c\x2b\x1a", "packets", "tshark -r"),
    "walk.mcap.gz": (gzip.compress(b"x"), "packed", "unpack it first"),
    "plan.pdf": (b"%PDF-1.7 a drawing", "a PDF", "echostep plan import"),
    "plan.png": (b"\x89PNG\r\n\x1a\n", "a picture", "echostep plan edit"),
    "plan.json": (b'{"echostep_plan": 2}', "JSON", "echostep plan check"),
    "plan.ifcxml": (b'<?xml version="1.0"?>', "XML", "echostep plan import"),
    "foot.csv": (FOOT, "a table with samples of a foot", "echostep foot"),
    "foot16.csv": (FOOT[3:].decode().encode("utf-16"), "a table with samples of a foot", "echostep foot"),
    "leg.csv": (b"t_s,thigh_rad_s,shank_rad_s\n0,0,0\n", "a table with samples of a leg", "echostep legs"),
    "air.csv": (b"t_s,pressure_pa\n0,101325\n", "a table with samples of a barometer", "echostep floors"),
    "track.csv": (b"t_s,x_m,y_m\n0,1,2\n", "a table with a track", "echostep score"),
    "other.csv": (b"Datum,Betrag\n1,2\n", "a table whose columns no command knows (Datum, Betrag)", "manual"),
    "notes.txt": ("Grüße".encode(), "a text", "no command reads"),
    "board.bin": ((CAPTURES / "board.bin").read_bytes(), "bytes of the board's port", "echostep decode"),
    "mtx.bin": ((CAPTURES / "mtx.bin").read_bytes(), "bytes of an MT's port", "echostep decode"),
    "ros.bag": (b"#ROSBAG V2.0\n" + bytes(100), "a bag of ROS 1", "mcap convert"),
    "noise": (bytes(range(128, 256)) * 4, "bytes of an unknown kind", "neither frames of a board or an MT, nor a text"),
    "empty": (b"", "an empty file", ""),
}


@pytest.mark.parametrize("name", FILES)
def test_what_it_is_and_the_next_step_is_one_line(tmp_path: Path, name: str) -> None:
    content, what, step = FILES[name]
    path = tmp_path / name
    path.write_bytes(content)
    done = echostep("info", path)
    assert (done.returncode, done.stderr.count("\n"), done.stdout) == (2, 1, "")
    assert done.stderr.startswith(f"echostep: {path}: no recording but {what}")
    assert step in done.stderr
    assert "FILE" not in done.stderr.replace("FILE OUT", "")


def test_a_folder_and_a_missing_file_are_named(tmp_path: Path) -> None:
    assert "a folder: give one file of it" in echostep("info", tmp_path).stderr
    assert "No such file" in echostep("info", tmp_path / "none").stderr


@given(st.binary(max_size=300))
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_bytes_are_one_printable_line(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "any"
    path.write_bytes(content)
    assert foreign(path).isprintable()


def test_a_recording_of_another_program_is_described_as_such(tmp_path: Path) -> None:
    path = tmp_path / "robot.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start("ros2", "libmcap 1.0")
        schema = writer.register_schema("sensor_msgs/msg/Imu", "ros2msg", b"")
        channel = writer.register_channel("/imu", "cdr", schema)
        for k in range(11):
            writer.add_message(channel, 1_800_000_000_000_000_000 + k * 100_000_000, b"x", 0)
        writer.finish()  # type: ignore[no-untyped-call]
    done = echostep("info", path)
    assert done.returncode == 0, done.stderr
    assert "robot.mcap: 0.0 MB, 1.0 s" in done.stdout
    assert "/imu 11" in done.stdout
    assert "no bytes of a board or an MT: not a walk that echostep can replay" in done.stdout
