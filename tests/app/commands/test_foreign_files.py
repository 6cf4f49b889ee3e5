# SPDX-License-Identifier: MIT
"""`echostep info` of files that are no recording: one sentence says what it is and the next step."""

from __future__ import annotations

import gzip
from pathlib import Path

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import Writer

from board_runs import ROOT
from command_line import echostep
from echostep_app.commands.actions.foreign import foreign
from snapshots import expect

CAPTURES = ROOT / "tests/captures"
FOOT = b"\xef\xbb\xbft_s;ax;ay;az;gx;gy;gz\r\n0;0,1;0;9,81;0;0;0\r\n"
FILES = {
    "a.pcap": b"\xd4\xc3\xb2\xa1\x02\x00\x04\x00" + bytes(16),
    "a.pcapng": b"\x0a\x0d\x0d\x0a\x1c\x00\x00\x00\x4d\x3c\x2b\x1a",
    "walk.mcap.gz": gzip.compress(b"x"),
    "plan.pdf": b"%PDF-1.7 a drawing",
    "plan.png": b"\x89PNG\r\n\x1a\n",
    "plan.json": b'{"echostep_plan": 2}',
    "plan.ifcxml": b'<?xml version="1.0"?>',
    "foot.csv": FOOT,
    "foot16.csv": FOOT[3:].decode().encode("utf-16"),
    "leg.csv": b"t_s,thigh_rad_s,shank_rad_s\n0,0,0\n",
    "air.csv": b"t_s,pressure_pa\n0,101325\n",
    "track.csv": b"t_s,x_m,y_m\n0,1,2\n",
    "other.csv": b"Datum,Betrag\n1,2\n",
    "notes.txt": "Grüße".encode(),
    "board.bin": (CAPTURES / "board.bin").read_bytes(),
    "mtx.bin": (CAPTURES / "mtx.bin").read_bytes(),
    "ros.bag": b"#ROSBAG V2.0\n" + bytes(100),
    "noise": bytes(range(128, 256)) * 4,
    "empty": b"",
}


def test_what_it_is_and_the_next_step_is_one_line(tmp_path: Path) -> None:
    for name, content in FILES.items():
        (tmp_path / name).write_bytes(content)
    (tmp_path / "folder").mkdir()
    said = {f"of {name}": echostep("info", tmp_path / name) for name in (*FILES, "folder", "none")}
    expect("info", said, FOLDER=tmp_path)


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
