# SPDX-License-Identifier: MIT
"""Recordings: nothing that was written is lost, a file that ends too early is read up to there, and other programs' readers find all."""

from __future__ import annotations

import contextlib
import re
import struct
import subprocess
import sys
from pathlib import Path

import pytest
import zstandard
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader
from mcap.writer import CompressionType, Writer

from command_line import echostep
from echostep.ports.chunks import LATEST_NS, Chunk
from echostep.recording import open_recording
from echostep.recording.mcap_records import RECORD_LIMIT, decompress_chunk, port_of
from echostep.recording.message_runs import PORTION_BYTES
from echostep_app.recording.recorder import Recorder
from echostep_app.recording.repair.contents import info
from echostep_app.recording.repair.recovery import Recovery
from recording.damages import read_by_index, write_recording
from waiting import PATIENCE_S, ran, until
from walks import DEMO

CHUNKS = [Chunk("board" if n % 3 else "mtx", n * 20_000_000, bytes([n % 256]) * (n % 40 + 1)) for n in range(300)]


def write(path: Path, chunks: list[Chunk] = CHUNKS) -> bytes:
    path.unlink(missing_ok=True)
    return write_recording(path, chunks, {"seed": "4", "note": "a test"})


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


def recovered_chunks(path: Path) -> list[Chunk]:
    """The same by the recovery, message by message."""
    return [
        Chunk(port_of(m.channel), min(m.t_ns, LATEST_NS), m.body)
        for m in Recovery(path).messages()
        if port_of(m.channel)
    ]


def test_a_recording_comes_in_portions_that_join_to_all_of_it(tmp_path: Path) -> None:
    chunks = [Chunk("board" if n % 3 else "mtx", n, bytes(n % 251)) for n in range(10_000)]
    write(tmp_path / "a.mcap", chunks)
    portions = list(open_recording(tmp_path / "a.mcap").portions())
    assert len(portions) > 3
    assert [chunk for portion in portions for chunk in portion.chunks()] == chunks
    joined = b"".join(portion.of("mtx").received for portion in portions)
    assert joined == b"".join(chunk.data for chunk in chunks if chunk.port == "mtx")


def test_a_run_is_read_by_its_index_of_chunks_alone(tmp_path: Path) -> None:
    chunks = [Chunk("board" if n % 3 else "mtx", n, bytes(n % 251)) for n in range(5000)]
    write(tmp_path / "a.mcap", chunks)
    for reverse in (False, True):
        data = read_by_index(tmp_path / "a.mcap", 3, reverse=reverse)
        assert data == [chunk.data for chunk in chunks][:: -1 if reverse else 1]


def test_a_killed_run_leaves_all_its_messages_to_every_reader(tmp_path: Path) -> None:
    """At any of its bytes, on the disk already: the last chunk is open."""
    chunks = [Chunk("board" if n % 3 else "mtx", n, bytes(n % 251)) for n in range(4000)]
    recorder, sizes = Recorder(tmp_path / "a.mcap", {}), []
    for chunk in chunks:
        recorder.write(chunk)
        sizes.append(recorder.offset)
    assert until(lambda: (tmp_path / "a.mcap").stat().st_size == sizes[-1] and not recorder._file.unwritten_bytes)
    killed = (tmp_path / "a.mcap").read_bytes()
    recorder.close()
    for count in (1, 2500, len(chunks)):
        (tmp_path / "b.mcap").write_bytes(killed[: sizes[count - 1]])
        assert list(open_recording(tmp_path / "b.mcap").chunks()) == chunks[:count]
        assert recovered_chunks(tmp_path / "b.mcap") == chunks[:count]
    with (tmp_path / "b.mcap").open("rb") as file, contextlib.suppress(EndOfFile):
        messages = NonSeekingReader(file).iter_messages(log_time_order=False)
        assert all(message.data == chunk.data for (_, _, message), chunk in zip(messages, chunks, strict=False))


def test_a_chunk_larger_than_a_portion_is_read(tmp_path: Path) -> None:
    chunks = [Chunk("board", 1, bytes(3 * PORTION_BYTES)), Chunk("board", 2, b"after")]
    write(tmp_path / "a.mcap", chunks)
    assert list(open_recording(tmp_path / "a.mcap").chunks()) == chunks


def test_arrival_times_from_another_age_are_bounded(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap", [Chunk("board", (1 << 64) - 1, b"x")])
    assert list(open_recording(tmp_path / "a.mcap").chunks()) == [Chunk("board", LATEST_NS, b"x")]


def test_a_source_that_can_wait_is_never_more_than_half_a_second_ahead_of_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("echostep_app.recording.background_writer.MAX_WAIT_S", PATIENCE_S)
    recorder = Recorder(tmp_path / "a.mcap", {})
    for chunk in CHUNKS:
        recorder.write(chunk)
        recorder.wait_for_disk(chunk)
    found = list(open_recording(tmp_path / "a.mcap").chunks())
    assert found == CHUNKS[: len(found)]
    assert CHUNKS[-1].t_arrival_ns - found[-1].t_arrival_ns <= 500_000_000
    recorder.close()


@pytest.mark.parametrize("compression", list(CompressionType))
def test_a_recording_that_another_tool_has_packed_into_chunks_is_the_same(
    tmp_path: Path, compression: CompressionType
) -> None:
    write(tmp_path / "a.mcap")
    with (tmp_path / "a.mcap").open("rb") as file, (tmp_path / "b.mcap").open("wb") as packed:
        writer = Writer(packed, chunk_size=1000, compression=compression)
        writer.start()
        reader = NonSeekingReader(file)
        topics: dict[str, int] = {}
        for _, channel, message in reader.iter_messages(log_time_order=False):
            if channel.topic not in topics:
                topics[channel.topic] = writer.register_channel(channel.topic, channel.message_encoding, 0)
            writer.add_message(topics[channel.topic], message.log_time, message.data, message.publish_time)
        writer.add_metadata("echostep", {"seed": "4", "note": "a test"})
        writer.finish()  # type: ignore[no-untyped-call]
    recording = open_recording(tmp_path / "b.mcap")
    assert recording.metadata == {"seed": "4", "note": "a test"}
    assert list(recording.chunks()) == CHUNKS
    assert not recording.own_damage.truncated


@pytest.mark.parametrize("compression", ["zstd", "lz4", "unheard"])
@given(junk=st.binary(max_size=200), claimed=st.integers(0, (1 << 64) - 1))
@settings(max_examples=40)
def test_a_damaged_chunk_is_left_closed(compression: str, junk: bytes, claimed: int) -> None:
    name = compression.encode()
    body = struct.pack("<QQQII", 0, 0, claimed, 0, len(name)) + name + struct.pack("<Q", len(junk)) + junk
    assert decompress_chunk(body) in (None, b"")


def test_a_chunk_that_would_fill_the_memory_is_left_closed() -> None:
    squeezed = zstandard.ZstdCompressor(level=19).compress(bytes(RECORD_LIMIT + 5))
    head = struct.pack("<QQQII", 0, 0, 10, 0, 4) + b"zstd" + struct.pack("<Q", len(squeezed))
    assert len(squeezed) < 100_000
    assert decompress_chunk(head + squeezed) is None


@pytest.mark.parametrize(("exponent", "opened"), [(27, True), (28, False)])
def test_a_chunk_with_a_window_above_128_mib_is_left_closed(exponent: int, opened: bool) -> None:
    """A frame of one raw block [RFC 8878, 3.1.1]: window descriptor without mantissa, block header with size and the mark of the last."""
    frame = struct.pack("<IBB", 0xFD2FB528, 0, exponent - 10 << 3) + (10 << 3 | 1).to_bytes(3, "little") + bytes(10)
    head = struct.pack("<QQQII", 0, 0, 10, 0, 4) + b"zstd" + struct.pack("<Q", len(frame))
    assert decompress_chunk(head + frame) == (bytes(10) if opened else None)


PYTHON = ["rerun-sdk==0.41.0", "databeam-mcap-reader==0.5.2"]  # the second brings the program mcap 0.0.62
NODE = ["@mcap/core@2.2.2", "@mcap/nodejs@1.0.2"]
INDEXED = """
import { open } from "fs/promises";
import { McapIndexedReader } from "@mcap/core";
import { FileHandleReadable } from "@mcap/nodejs";
const readable = new FileHandleReadable(await open(process.argv[2], "r"));
const reader = await McapIndexedReader.Initialize({ readable });
let count = 0;
for await (const _ of reader.readMessages()) count++;
console.log(count);
"""


def run(*words: str | Path, cwd: Path) -> str:
    done = ran([*map(str, words)], cwd=cwd)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture
def readers(tmp_path: Path) -> Path:
    """A folder with the readers; the test is skipped where a registry gives none."""
    for words in (
        [sys.executable, "-m", "venv", tmp_path / "env"],
        [tmp_path / "env/bin/pip", "install", "--quiet", *PYTHON],
        ["npm", "install", "--silent", *NODE],
    ):
        try:
            subprocess.run([*map(str, words)], capture_output=True, check=True, cwd=tmp_path)
        except (OSError, subprocess.CalledProcessError) as error:
            pytest.skip(f"no reader to be had: {error}")
    (tmp_path / "read.mjs").write_text(INDEXED)
    return tmp_path


@pytest.mark.long
@pytest.mark.process
def test_every_reader_of_a_registry_finds_every_message(readers: Path) -> None:
    walk = readers / "out/walk.mcap"
    assert echostep("demo", "--plan", DEMO, "--out", walk.parent, "--no-page").returncode == 0
    told = "\n".join(info(walk))
    count = sum(int(n) for pair in re.findall(r"in (\d+) chunks|/[a-z/]+ (\d+)", told) for n in pair if n)
    (mcap,) = readers.glob("env/lib/*/site-packages/databeam_mcap_reader/mcap_cli")
    assert int(run("node", "read.mjs", walk, cwd=readers)) == count
    assert len(run(mcap, "cat", walk, cwd=readers).splitlines()) == count
    run(mcap, "doctor", walk, cwd=readers)
    run(mcap, "sort", walk, "-o", readers / "sorted.mcap", cwd=readers)
    run(readers / "env/bin/rerun", "mcap", "convert", walk, "-o", readers / "walk.rrd", cwd=readers)
    told = run(readers / "env/bin/rerun", "rrd", "stats", readers / "walk.rrd", cwd=readers)
    assert int(re.sub(r"\s", "", told.partition("num_rows = ")[2].splitlines()[0])) >= count
