# SPDX-License-Identifier: MIT
"""Damage of recordings: what it costs, that it is told, by the file itself and by every file that is made of it."""

from __future__ import annotations

import random
import struct
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer

from command_line import echostep
from echostep.ports.chunks import Chunk
from echostep.recording import Recording, open_recording
from echostep.recording.damage.placing import Placement
from echostep.recording.mcap_records import HEAD_SIZE, RAW_ENCODING
from echostep.tracker import Tracker
from echostep_app.recording.recorder import Recorder
from echostep_app.recording.repair.contents import info
from echostep_app.recording.repair.edit import cut, repair
from echostep_app.session.losses import skipped
from recording.damages import arrival_offsets, flipped, message_records, read_by_index, write_recording
from walks import DEMO, PLAN, walk_chunks

CHUNKS = [Chunk("board" if n % 3 else "mtx", n * 20_000_000, bytes([n % 251]) * (n % 40 + 1)) for n in range(1200)]
CHUNKS_A_SECOND = 50
CHECKSUM = "its checksum is wrong"


@cache
def content() -> bytes:
    with TemporaryDirectory() as folder:
        return write_recording(Path(folder) / "a.mcap", CHUNKS, {"seed": "4"})


def read(path: Path) -> tuple[Recording, list[Chunk]]:
    recording = open_recording(path)
    return recording, list(recording.chunks())


def replay_says(recording: Recording) -> str:
    return "\n".join(skipped(recording, Tracker(PLAN).streams))


def made(folder: Path, kind: str) -> bytes:
    """A file that `cut` or `repair` writes of a whole recording."""
    (folder / "a.mcap").write_bytes(content())
    out = folder / f"{kind}.mcap"
    if kind == "cut":
        cut(folder / "a.mcap", 0.0, 100.0, out)
    else:
        repair(folder / "a.mcap", out)
    return out.read_bytes()


@pytest.mark.long
@pytest.mark.parametrize("kind", ["cut", "repair"])
def test_a_flipped_bit_of_what_we_write_costs_less_than_a_second(tmp_path: Path, kind: str) -> None:
    whole, rng = made(tmp_path, kind), random.Random(1)
    for _ in range(40):
        path = tmp_path / "flip.mcap"
        path.write_bytes(flipped(whole, rng.randrange(8, len(whole)), rng.randrange(8)))
        found = read(path)[1]
        assert sum(chunk in set(found) for chunk in CHUNKS) > len(CHUNKS) - CHUNKS_A_SECOND


def test_a_flipped_bit_in_a_chunk_that_is_not_compressed_is_told_without_the_files_own_checksum(tmp_path: Path) -> None:
    """The end of the file is missing; the chunk has a checksum of its own."""
    whole, path = made(tmp_path, "repair"), tmp_path / "flip.mcap"
    at = whole.index(CHUNKS[700].data)
    path.write_bytes(flipped(whole, at + 3, 2)[: whole.rindex(b"\x0f" + struct.pack("<Q", 4))])
    recording, found = read(path)
    assert len(found) == len(CHUNKS)
    for told in (recording.damage(), info(path), repair(path, tmp_path / "b.mcap")):
        assert CHECKSUM in "\n".join(told)


@pytest.mark.parametrize("kind", ["cut", "repair"])
def test_a_file_in_chunks_that_is_cut_anywhere_is_read_to_its_last_whole_message(tmp_path: Path, kind: str) -> None:
    """Also within the first chunk, whose head claims more than the file has."""
    whole, path, rng = made(tmp_path, kind), tmp_path / "b.mcap", random.Random(2)
    ends = [record.stop for record in message_records(whole)]
    for size in (ends[0], *(rng.randrange(ends[0], ends[-1]) for _ in range(20))):
        path.write_bytes(whole[:size])
        there = [chunk for chunk, end in zip(CHUNKS, ends, strict=True) if end <= size]
        assert read(path)[1] == there
        repair(path, tmp_path / "c.mcap")
        assert read(tmp_path / "c.mcap")[1] == there
        (tmp_path / "c.mcap").unlink()


def test_a_flipped_bit_of_what_export_writes_costs_less_than_a_second(tmp_path: Path) -> None:
    """Of the ports; a derived message costs itself, and is made again."""
    walk, chunks = tmp_path / "walk.mcap", walk_chunks(8.0)
    write_recording(walk, chunks, {"seed": "3"})
    done = echostep("export", walk, "--plan", DEMO, "--start", "?", "-o", tmp_path / "out.mcap")
    assert done.returncode == 0, done.stderr
    whole, rng, path = (tmp_path / "out.mcap").read_bytes(), random.Random(1), tmp_path / "flip.mcap"
    assert len(whole) > 1.2 * walk.stat().st_size  # it has derived messages
    a_second = max(sum(0 <= c.t_arrival_ns - begin.t_arrival_ns < 10**9 for c in chunks) for begin in chunks[::50])
    for _ in range(40):
        path.write_bytes(flipped(whole, rng.randrange(8, len(whole)), rng.randrange(8)))
        found = set(read(path)[1])
        assert sum(chunk in found for chunk in chunks) > len(chunks) - a_second


def channel_flip(whole: bytes) -> bytes:
    """The name of the board's port, /board/bytec, in the channel record between the messages."""
    return flipped(whole, whole.index(b"/board/bytes") + len("/board/byte"), 4)


def test_a_damaged_channel_is_taken_from_the_summary(tmp_path: Path) -> None:
    path, mended = tmp_path / "a.mcap", tmp_path / "b.mcap"
    path.write_bytes(channel_flip(content()))
    recording, found = read(path)
    assert found == CHUNKS
    assert CHECKSUM in replay_says(recording)
    assert any(CHECKSUM in line for line in repair(path, mended))
    recording, found = read(mended)
    assert found == CHUNKS
    assert f"of a.mcap, of which it was made: {CHECKSUM}" in replay_says(recording)


def test_a_port_without_a_readable_channel_is_named(tmp_path: Path) -> None:
    """The summary is cut off: nothing tells the name of the port any more."""
    path, mended, again = (tmp_path / f"{name}.mcap" for name in "abc")
    path.write_bytes(channel_flip(content())[:-2000])
    recording, found = read(path)
    assert {chunk.port for chunk in found} == {"mtx"}
    told = ["the channel /board/bytec is damaged", "no bytes of board can be read"]
    repaired = "\n".join(repair(path, mended))
    repair(mended, again)
    for said in (replay_says(recording), "\n".join(info(path)), repaired):
        assert all(words in said for words in told), said
    for made_of in (mended, again):
        recording, _ = read(made_of)
        assert all(words in replay_says(recording) for words in told)
        assert all(words in "\n".join(info(made_of)) for words in told)
        assert not info(made_of)[-1].endswith("whole")


@pytest.mark.parametrize(
    "damage",
    [
        lambda whole: whole[:-3000],
        lambda whole: channel_flip(whole)[:-2000],
        lambda whole: whole[:9000] + bytes(700) + whole[9700:],
        lambda whole: whole[:9000] + bytes(10) + whole[9010:20_000] + bytes(10) + whole[20_010:],
        lambda whole: flipped(whole, arrival_offsets(whole)[100] + 20, 3),
        lambda whole: whole[:30720] + whole[30720:38912] + whole[30720:],
    ],
    ids=["cut", "channel", "zeros", "two places", "flip", "twice"],
)
def test_every_command_says_the_same_of_a_damage(tmp_path: Path, damage: Callable[[bytes], bytes]) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(damage(content()))
    told = read(path)[0].damage()
    assert told
    assert info(path)[-1 - len(told) : -1] == [f"  {line}" for line in told]
    assert repair(path, tmp_path / "b.mcap")[-len(told) :] == [f"  {line}" for line in told]


def test_a_compressed_chunk_that_holds_no_records_is_told_by_every_command(tmp_path: Path) -> None:
    """Its own checksum is right: the program that packed it wrote what is no record."""
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=1 << 20, compression=CompressionType.ZSTD)
        writer.start()
        channel = writer.register_channel("/board/bytes", RAW_ENCODING, 0)
        for chunk in CHUNKS:
            writer.add_message(channel, chunk.t_arrival_ns, chunk.data, 0)
        builder = writer._Writer__chunk_builder  # type: ignore[attr-defined]
        builder.record_writer.write(bytes(40))
        writer.finish()  # type: ignore[no-untyped-call]
    recording, found = read(path)
    assert len(found) == len(CHUNKS)
    assert "1 compressed chunks cannot be opened, or not be read to their end" in "\n".join(recording.damage())
    assert info(path)[-1].endswith("makes a whole file of what is readable")


def test_the_damage_goes_into_a_piece_too(tmp_path: Path) -> None:
    path, piece = tmp_path / "a.mcap", tmp_path / "b.mcap"
    path.write_bytes(flipped(content(), arrival_offsets(content())[100] + 20, 3))
    assert any(CHECKSUM in line for line in cut(path, 0.0, 5.0, piece))
    assert CHECKSUM in replay_says(read(piece)[0])


@settings(max_examples=40, deadline=None)
@given(st.data())
def test_a_flip_is_told_when_it_changes_content_and_not_when_it_does_not(
    tmp_path_factory: pytest.TempPathFactory, draw: st.DataObject
) -> None:
    """Content is all that is before the checksum of the data; behind it stand copies and an index."""
    whole, path = content(), tmp_path_factory.getbasetemp() / "flip.mcap"
    end = whole.rindex(b"\x0f" + struct.pack("<Q", 4), 0, len(whole) - 100)
    where = st.integers(0, len(whole) - 1) | st.integers(end, len(whole) - 1) | st.integers(0, 300)
    offset = draw.draw(where)
    path.write_bytes(flipped(whole, offset, draw.draw(st.integers(0, 7))))
    recording, found = read(path)
    assert bool(replay_says(recording)) == (offset < end)
    assert (info(path)[-1] == "  whole") == (offset >= end)
    if offset >= end:
        assert (found, recording.metadata) == (CHUNKS, {"seed": "4"})


def test_a_block_that_stands_twice_is_used_once(tmp_path: Path) -> None:
    whole, at = content(), 60 * 512
    (tmp_path / "a.mcap").write_bytes(whole[:at] + whole[at : at + 8192] + whole[at:])
    recording, found = read(tmp_path / "a.mcap")
    assert len(found) == len(set(found)) >= len(CHUNKS) - 2
    assert [c.t_arrival_ns for c in found] == sorted(c.t_arrival_ns for c in found)
    assert recording.own_damage.misplaced > 50
    assert "stand twice in the file, or not where they were written" in replay_says(recording)
    repair(tmp_path / "a.mcap", tmp_path / "b.mcap")
    assert read(tmp_path / "b.mcap")[1] == found


def test_exchanged_blocks_cost_what_is_in_them(tmp_path: Path) -> None:
    whole = content()
    begins = [record.start for record in message_records(whole)]
    (a, a_end), (b, b_end) = ((begins[k], begins[k + 40]) for k in (300, 900))
    changed = whole[:a] + whole[b:b_end] + whole[a_end:b] + whole[a:a_end] + whole[b_end:]
    (tmp_path / "a.mcap").write_bytes(changed)
    repair(tmp_path / "a.mcap", tmp_path / "b.mcap")
    for name in ("a.mcap", "b.mcap"):
        assert read(tmp_path / name)[1] == CHUNKS[:300] + CHUNKS[340:900] + CHUNKS[940:]


def test_a_damaged_number_costs_no_message(tmp_path: Path) -> None:
    offset = arrival_offsets(content())[700] - 4
    (tmp_path / "a.mcap").write_bytes(flipped(content(), offset + 2, 5))
    assert read(tmp_path / "a.mcap")[1] == CHUNKS


@given(st.lists(st.integers(0, 30), max_size=9))
def test_the_messages_kept_are_as_many_as_can_be_in_order(numbers: list[int]) -> None:
    """Beside all subsequences, one by one."""
    kept = Placement().keep(np.array(numbers, np.int64), np.empty(0, np.int64))
    shown = np.array(numbers, float)
    for k, (before, this, after) in enumerate(zip(numbers, numbers[1:], numbers[2:], strict=False), 1):
        if before < after and not before < this < after:
            shown[k] = (before + after) / 2
    best = 0
    for chosen in range(1 << len(shown)):
        part = [shown[k] for k in range(len(shown)) if chosen >> k & 1]
        if all(a < b for a, b in zip(part, part[1:], strict=False)):
            best = max(best, len(part))
    assert kept.sum() == best
    assert (np.diff(shown[kept]) > 0).all()


def test_a_file_of_other_numbers_is_read_as_it_is(tmp_path: Path) -> None:
    """Another recorder may count each channel by itself."""
    whole = bytearray(content())
    whole[whole.index(b"echostep", 10) : whole.index(b"echostep", 10) + 8] = b"recorder"
    for k, record in enumerate(message_records(bytes(whole))):
        struct.pack_into("<I", whole, record.start + HEAD_SIZE + 2, k % 7)
    (tmp_path / "a.mcap").write_bytes(whole)
    assert read(tmp_path / "a.mcap")[1] == CHUNKS


def test_a_recording_that_is_being_written_is_whole_so_far(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.mcap", {"seed": "4"})
    for chunk in CHUNKS:
        recorder.write(chunk)
    while (tmp_path / "a.mcap").stat().st_size < recorder.offset:
        recorder.wait_for_disk(CHUNKS[-1])
    assert info(tmp_path / "a.mcap")[-1] == "  it is being written: whole so far"
    assert not replay_says(read(tmp_path / "a.mcap")[0])
    recorder.close()
    assert info(tmp_path / "a.mcap")[-1] == "  whole"


def test_a_repaired_recording_is_read_by_its_index_of_chunks(tmp_path: Path) -> None:
    made(tmp_path, "repair")
    for reverse in (False, True):
        assert len(read_by_index(tmp_path / "repair.mcap", 1, reverse=reverse)) == len(CHUNKS)
