# SPDX-License-Identifier: MIT
"""Recordings looked into, cut and mended: whatever is wrong with the file, all that can be saved; foreign files are told with the next step."""

from __future__ import annotations

import contextlib
import gzip
import struct
import sys
from collections.abc import Callable
from functools import cache
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from board_runs import ROOT
from command_line import echostep
from echostep.errors import EchostepError
from echostep.ports.chunks import Chunk
from echostep.recording import open_recording
from echostep.recording.mcap_records import RAW_ENCODING
from echostep_app.commands.actions.foreign import foreign
from echostep_app.output.derived import PRESSURE
from echostep_app.recording.recorder import DerivedMessage, Recorder
from echostep_app.recording.repair.contents import info
from echostep_app.recording.repair.edit import cut, repair
from snapshots import expect
from waiting import ran

CHUNKS = [Chunk("board" if n % 3 else "mtx", n * 20_000_000, bytes([n % 251]) * (n % 40 + 1)) for n in range(300)]
FIXTURE = settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])


@cache
def recorded() -> bytes:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "a.mcap"
        with Recorder(path, {"seed": "4", "start_x_y_rad": "1.0,2.0,0.0"}) as recorder:
            for k, chunk in enumerate(CHUNKS):
                recorder.write(chunk)
                if not k % 10:
                    recorder.write_derived(
                        [DerivedMessage(PRESSURE, chunk.t_arrival_ns, {"ticks": k, "pressure_pa": 101_325.0})]
                    )
        return path.read_bytes()


@cache
def packed() -> bytes:
    file = BytesIO()
    writer = Writer(file, chunk_size=600, compression=CompressionType.ZSTD)
    writer.start()
    channels = {port: writer.register_channel(f"/{port}/bytes", RAW_ENCODING, 0) for port in ("board", "mtx")}
    for chunk in CHUNKS:
        writer.add_message(channels[chunk.port], chunk.t_arrival_ns, chunk.data, 0)
    writer.finish()  # type: ignore[no-untyped-call]
    return file.getvalue()


def write(path: Path) -> bytes:
    path.write_bytes(recorded())
    return recorded()


def chunks_of(path: Path) -> list[Chunk]:
    return list(open_recording(path).chunks())


def saved(content: bytes, folder: Path) -> list[Chunk]:
    """What `repair` makes of a file, by the format's own reader; empty when it says that nothing can be saved."""
    (folder / "bad.mcap").write_bytes(content)
    out = folder / "out.mcap"
    out.unlink(missing_ok=True)
    try:
        repair(folder / "bad.mcap", out)
    except EchostepError:
        assert not out.exists()
        return []
    with out.open("rb") as file:
        return [
            Chunk(channel.topic.split("/")[1], message.log_time, message.data)
            for _, channel, message in make_reader(file).iter_messages(log_time_order=False)
            if channel.topic.endswith("/bytes")
        ]


def test_a_whole_recording_is_described(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap")
    text = "\n".join(info(tmp_path / "a.mcap"))
    assert "6.0 s" in text
    assert f"board: {sum(len(c.data) for c in CHUNKS if c.port == 'board')} bytes in 200 chunks" in text
    assert "/pressure 30" in text
    assert text.endswith("whole")


def swapped(apart_ns: int, folder: Path) -> list[str]:
    """`info` of a recording in which a chunk of the board stands behind one of the MTx that came so much later."""
    with Recorder(folder / "a.mcap", {}) as recorder:
        for k in range(1, 50):
            t_ns = k * 1_000_000_000
            recorder.write(Chunk("mtx", t_ns + apart_ns, b"x"))
            recorder.write(Chunk("board", t_ns, b"x"))
    return info(folder / "a.mcap")


def test_some_milliseconds_between_two_ports_are_no_fault(tmp_path: Path) -> None:
    assert swapped(20_000_000, tmp_path)[-1] == "  whole"


def test_a_repair_is_offered_for_what_it_mends_alone(tmp_path: Path) -> None:
    late = swapped(500_000_000, tmp_path)
    assert late[-1] == "  49 chunks of one port came long after later ones of another: repair leaves them so"
    (tmp_path / "cut.mcap").write_bytes(write(tmp_path / "b.mcap")[:-100])
    assert info(tmp_path / "cut.mcap")[-1].endswith("makes a whole file of what is readable")
    repair(tmp_path / "cut.mcap", tmp_path / "c.mcap")
    assert info(tmp_path / "c.mcap")[-1] == "  whole"


def test_no_terminal_obeys_a_strangers_recording(tmp_path: Path) -> None:
    with Recorder(tmp_path / "a.mcap", {"note": "\x1b]0;owned\x07" + "x" * 10_000}) as recorder:
        recorder.write(Chunk("bo\x1b[2Jard", 1, b"x"))
    text = "\n".join(info(tmp_path / "a.mcap"))
    assert "\x1b" not in text
    assert len(text) < 6000


def test_mending_a_whole_file_changes_nothing_in_it(tmp_path: Path) -> None:
    assert saved(write(tmp_path / "a.mcap"), tmp_path) == CHUNKS
    assert open_recording(tmp_path / "out.mcap").metadata == {"seed": "4", "start_x_y_rad": "1.0,2.0,0.0"}
    assert "nothing was wrong" in "\n".join(repair(tmp_path / "a.mcap", tmp_path / "b.mcap"))


def test_records_of_other_programs_are_read_over_and_kept(tmp_path: Path) -> None:
    """In a file that was not closed, too; a message with a wrong bit in its opcode is none of them."""
    write(tmp_path / "a.mcap")
    with (tmp_path / "a.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    begin = summary.chunk_indexes[0].chunk_start_offset
    notes = struct.pack("<BQ", 0x85, 26) + b"a record that others wrote", struct.pack("<BQ", 0xFF, 0)
    content = recorded()[:begin] + b"".join(notes) + recorded()[begin:]
    assert saved(content[: -(len(recorded()) - summary.chunk_indexes[0].chunk_length - begin)], tmp_path) == CHUNKS
    (tmp_path / "a.mcap").write_bytes(content)
    assert not open_recording(tmp_path / "a.mcap").damage()
    assert all(note in (tmp_path / "out.mcap").read_bytes() for note in notes)
    assert info(tmp_path / "out.mcap")[-1] == "  whole, but made of a damaged recording"
    message = content.index(CHUNKS[199].data) - 22 - 9
    assert saved(content[:message] + b"\x85" + content[message + 1 :], tmp_path) == CHUNKS[:199] + CHUNKS[200:]
    assert "damaged bytes in one place were not used" in "\n".join(info(tmp_path / "bad.mcap"))


@given(st.data())
@FIXTURE
def test_a_file_cut_off_anywhere_keeps_all_before(tmp_path: Path, draw: st.DataObject) -> None:
    whole = write(tmp_path / "a.mcap")
    end = draw.draw(st.integers(0, len(whole)))
    found = saved(whole[:end], tmp_path)
    assert found == CHUNKS[: len(found)]
    (tmp_path / "cut.mcap").write_bytes(whole[:end])
    with contextlib.suppress(EchostepError):
        assert chunks_of(tmp_path / "cut.mcap") == found


def test_one_byte_between_others_costs_no_record_after_it(tmp_path: Path) -> None:
    """Shifted bytes look like records of any kind: none may swallow what follows."""
    whole = write(tmp_path / "a.mcap")
    for begin in range(2000, len(whole) - 2000, 97):
        assert len(saved(whole[:begin] + b"\0" + whole[begin:], tmp_path)) >= len(CHUNKS) - 8


@pytest.mark.slow
@given(st.data())
@FIXTURE
def test_damage_in_the_middle_costs_what_is_damaged_and_little_more(tmp_path: Path, draw: st.DataObject) -> None:
    """Bytes overwritten, removed or put in between: all messages that are not touched, but for a few beside them, are saved."""
    whole = write(tmp_path / "a.mcap")
    begin = draw.draw(st.integers(2000, len(whole) - 2000))
    gone = draw.draw(st.integers(0, 300))
    junk = draw.draw(st.binary(max_size=300))
    found = saved(whole[:begin] + junk + whole[begin + gone :], tmp_path)
    unhurt = [chunk for chunk in found if chunk in CHUNKS]
    size = len(whole) / (len(CHUNKS) * 1.1)
    assert len(unhurt) >= len(CHUNKS) - gone / size - 8


@pytest.mark.parametrize("length", [(1 << 64) - 1, 1 << 63, 1 << 40, 1 << 28, 0])
def test_a_record_of_impossible_length_is_passed_over(tmp_path: Path, length: int) -> None:
    whole = bytearray(write(tmp_path / "a.mcap"))
    at = whole.index(CHUNKS[150].data, 5000) - 31
    assert whole[at] == 5
    whole[at + 1 : at + 9] = struct.pack("<Q", length)
    assert saved(bytes(whole), tmp_path) == CHUNKS[:150] + CHUNKS[151:]


def test_a_lost_beginning_is_made_up_for_by_the_summary(tmp_path: Path) -> None:
    whole = bytearray(write(tmp_path / "a.mcap"))
    whole[8:700] = bytes(692)
    found = saved(bytes(whole), tmp_path)
    assert found == CHUNKS[-len(found) :]
    assert len(found) > 280


@pytest.mark.slow
@given(st.data())
@FIXTURE
def test_a_damaged_byte_in_a_compressed_file_costs_a_chunk_at_most(tmp_path: Path, draw: st.DataObject) -> None:
    damaged = bytearray(packed())
    damaged[draw.draw(st.integers(8, len(damaged) - 1))] ^= draw.draw(st.integers(1, 255))
    found = saved(bytes(damaged), tmp_path)
    assert len([chunk for chunk in found if chunk in CHUNKS]) > len(CHUNKS) - 30


@given(st.floats(0.0, 7.0), st.floats(0.0, 7.0))
@FIXTURE
def test_a_piece_is_what_came_in_between(tmp_path: Path, begin_s: float, end_s: float) -> None:
    write(tmp_path / "a.mcap")
    out = tmp_path / "piece.mcap"
    out.unlink(missing_ok=True)
    expected = [c for c in CHUNKS if round(begin_s * 1e9) <= c.t_arrival_ns < round(end_s * 1e9)]
    if not expected:
        with pytest.raises(EchostepError):
            cut(tmp_path / "a.mcap", begin_s, end_s, out)
        assert not out.exists()
        return
    cut(tmp_path / "a.mcap", begin_s, end_s, out)
    assert chunks_of(out) == expected


def test_a_piece_is_not_written_over_its_origin(tmp_path: Path) -> None:
    whole = write(tmp_path / "a.mcap")
    here = tmp_path / "a.mcap"
    runs: list[Callable[[], object]] = [lambda: cut(here, 0, 3, here), lambda: repair(here, here)]
    for run in runs:
        with pytest.raises(EchostepError, match="another name"):
            run()
    assert (tmp_path / "a.mcap").read_bytes() == whole


@pytest.mark.process
def test_a_full_disk_under_a_piece_is_named(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap")
    limited = (
        "import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))\n"
        "sys.argv = ['echostep', 'repair', sys.argv[1], '-o', sys.argv[2]]\n"
        "from echostep_app.cli import main; main()"
    )
    done = ran([sys.executable, "-c", limited, tmp_path / "a.mcap", tmp_path / "b.mcap"])
    assert (done.returncode, done.stderr) == (2, f"echostep: {tmp_path}/b.mcap: cannot write: File too large\n")
    assert not (tmp_path / "b.mcap").exists()


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
    "mt.txt": b"// Update Rate: 100.0Hz\nPacketCounter\tAcc_X\tAcc_Y\tAcc_Z\tGyr_X\tGyr_Y\tGyr_Z\n0\t0\t0\t9.8\t0\t0\t0\n",
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
