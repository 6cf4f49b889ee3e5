"""Recordings: nothing that was written is lost, and a file that ends too early is read up to there."""

from __future__ import annotations

import contextlib
import struct
from io import BytesIO
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel

from echostep.errors import EchostepError
from echostep.recording import MCAP_MAGIC, PIECE, Recorder, open_recording
from echostep.sources import LATEST_NS, Chunk

CHUNKS = [Chunk("board" if n % 3 else "mtx", n * 20_000_000, bytes([n % 256]) * (n % 40 + 1)) for n in range(300)]


def write(path: Path, chunks: list[Chunk] = CHUNKS) -> bytes:
    with Recorder(path, {"seed": "4", "note": "a test"}) as recorder:
        for chunk in chunks:
            recorder.write(chunk)
    return path.read_bytes()


def test_round_trip(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap")
    recording = open_recording(tmp_path / "a.mcap")
    assert recording.about == {"seed": "4", "note": "a test"}
    assert list(recording.chunks()) == CHUNKS
    assert not recording.truncated


@given(st.data())
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_cut_file_gives_what_came_before_the_cut(tmp_path: Path, draw: st.DataObject) -> None:
    whole = write(tmp_path / "a.mcap")
    cut = draw.draw(st.integers(400, len(whole) - 200))
    (tmp_path / "cut.mcap").write_bytes(whole[:cut])
    recording = open_recording(tmp_path / "cut.mcap")
    found = list(recording.chunks())
    assert found == CHUNKS[: len(found)]
    assert len(found) >= len(CHUNKS) * (cut - 800) // len(whole) - 1


@given(st.data())
@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damage_never_raises_anything_else(tmp_path: Path, draw: st.DataObject) -> None:
    damaged = bytearray(write(tmp_path / "a.mcap", CHUNKS[:40]))
    for _ in range(draw.draw(st.integers(1, 6))):
        damaged[draw.draw(st.integers(0, len(damaged) - 1))] = draw.draw(st.integers(0, 255))
    (tmp_path / "bad.mcap").write_bytes(damaged)
    with contextlib.suppress(EchostepError):
        assert list(open_recording(tmp_path / "bad.mcap").chunks()) == naive_chunks(bytes(damaged))


def naive_chunks(file: bytes) -> list[Chunk]:
    """Slow, obviously right: record by record."""
    found: list[Chunk] = []
    ports: dict[int, str] = {}
    at = len(MCAP_MAGIC)
    while at + 9 <= len(file):
        opcode, length = struct.unpack_from("<BQ", file, at)
        body = file[at + 9 : at + 9 + length]
        if len(body) < length or opcode == Opcode.FOOTER:
            break
        at += 9 + length
        if opcode == Opcode.MESSAGE and length >= 22:
            channel, _, t_arrival_ns, _ = struct.unpack_from("<HIQQ", body)
            if channel in ports:
                found.append(Chunk(ports[channel], min(t_arrival_ns, LATEST_NS), body[22:]))
        elif opcode == Opcode.CHANNEL:
            with contextlib.suppress(McapError, struct.error, UnicodeDecodeError):
                record = Channel.read(ReadDataStream(BytesIO(body)))
                ports[record.id] = record.topic.removeprefix("/").removesuffix("/bytes")
    return found


def test_a_recording_comes_in_portions_that_join_to_all_of_it(tmp_path: Path) -> None:
    chunks = [Chunk("board" if n % 3 else "mtx", n, bytes(n % 251)) for n in range(10_000)]
    write(tmp_path / "a.mcap", chunks)
    portions = list(open_recording(tmp_path / "a.mcap").portions())
    assert len(portions) > 3
    assert [chunk for portion in portions for chunk in portion.chunks()] == chunks
    joined = b"".join(portion.of("mtx").received for portion in portions)
    assert joined == b"".join(chunk.data for chunk in chunks if chunk.port == "mtx")


def test_a_chunk_larger_than_a_portion_is_read(tmp_path: Path) -> None:
    chunks = [Chunk("board", 1, bytes(3 * PIECE)), Chunk("board", 2, b"after")]
    write(tmp_path / "a.mcap", chunks)
    assert list(open_recording(tmp_path / "a.mcap").chunks()) == chunks


def test_arrival_times_from_another_age_are_bounded(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap", [Chunk("board", (1 << 64) - 1, b"x")])
    assert list(open_recording(tmp_path / "a.mcap").chunks()) == [Chunk("board", LATEST_NS, b"x")]


def test_before_the_file_is_closed_all_but_the_last_second_is_on_disk(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.mcap", {})
    for chunk in CHUNKS:
        recorder.write(chunk)
    found = list(open_recording(tmp_path / "a.mcap").chunks())
    assert found == CHUNKS[: len(found)]
    assert CHUNKS[-1].t_arrival_ns - found[-1].t_arrival_ns <= 1_000_000_000
    recorder.close()


@pytest.mark.parametrize("content", [b"", b"hello", b"\x89MCAP0\r\n"])
def test_what_is_no_recording_is_named(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "x.mcap").write_bytes(content)
    with pytest.raises(EchostepError, match=r"x\.mcap"):
        open_recording(tmp_path / "x.mcap")


def test_a_missing_recording_is_named(tmp_path: Path) -> None:
    with pytest.raises(EchostepError, match="cannot read"):
        open_recording(tmp_path / "none.mcap")
