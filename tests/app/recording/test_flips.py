# SPDX-License-Identifier: MIT
"""Recordings with flipped bits and damaged blocks: no track ends early or is falsely sure, and the replay says what it skipped."""

from __future__ import annotations

import random
import struct
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from echostep.localization import Estimate
from echostep.particles.limits import TRACKING_M
from echostep.ports.chunks import Chunk
from echostep.recording import open_recording
from echostep.recording.mcap_records import HEAD_SIZE
from echostep.tracker import Tracker
from echostep_app.recording.repair.contents import info
from echostep_app.recording.repair.edit import repair
from echostep_app.session.losses import skipped
from recording.damages import (
    KINDS,
    arrival_offsets,
    compare,
    draw_flips,
    falsely_tracking_m,
    flipped,
    record_walk,
    replay,
    write_recording,
)
from timing.test_disturbed_clocks import track
from walks import PLAN, walk_chunks

SECONDS = 8.0
CHUNKS = [Chunk("board" if n % 3 else "mtx", n * 20_000_000, bytes([n % 251]) * (n % 40 + 1)) for n in range(300)]


@cache
def undamaged() -> list[Estimate]:
    return track(walk_chunks(SECONDS))[0]


def nth(port: str, n: int) -> int:
    """Index of the n-th chunk of a port."""
    return [k for k, chunk in enumerate(walk_chunks(SECONDS)) if chunk.port == port][n]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("port", "n", "bit"),
    [("board", 0, 41), ("mtx", 5, 41), ("board", 1500, 31), ("board", 1500, 41), ("mtx", 305, 42), ("board", 1500, 55)],
)
def test_one_flipped_bit_of_an_arrival_time_harms_no_estimate_and_is_counted(port: str, n: int, bit: int) -> None:
    chunks = list(walk_chunks(SECONDS))
    k = nth(port, n)
    chunks[k] = replace(chunks[k], t_arrival_ns=chunks[k].t_arrival_ns ^ 1 << bit)
    estimates, tracker = track(tuple(chunks))
    first = n < 100  # of its port: until the next ones have shown that it is wrong, it is the only one
    assert compare(estimates, undamaged()) in (("same", "near") if first else ("same",))
    assert tracker.streams.front_end.bad_arrivals >= 1


def damage(path: Path, offset: int, bit: int) -> None:
    path.write_bytes(flipped(path.read_bytes(), offset, bit))


def test_a_flipped_arrival_time_is_corrected_by_repair(tmp_path: Path) -> None:
    times = arrival_offsets(write_recording(tmp_path / "a.mcap", CHUNKS, {"seed": "1"}))
    damage(tmp_path / "a.mcap", times[100] + 5, 0)
    assert any("1 arrival times contradict" in line for line in info(tmp_path / "a.mcap"))
    repair(tmp_path / "a.mcap", tmp_path / "b.mcap")
    found = list(open_recording(tmp_path / "b.mcap").chunks())
    assert [chunk.data for chunk in found] == [chunk.data for chunk in CHUNKS]
    assert max(abs(a.t_arrival_ns - b.t_arrival_ns) for a, b in zip(found, CHUNKS, strict=True)) <= 40_000_000
    assert info(tmp_path / "b.mcap")[-1] == "  whole, but made of a damaged recording"


def test_a_wrong_length_costs_a_few_messages_not_all_behind_it(tmp_path: Path) -> None:
    """Bit 13 of a length would swallow a hundred messages, an impossible opcode ended the reading."""
    for name, offset, bit in (("length", 1 + 1, 5), ("opcode", 0, 6)):
        path = tmp_path / f"{name}.mcap"
        record = arrival_offsets(write_recording(path, CHUNKS, {"seed": "1"}))[150] - HEAD_SIZE - 6
        assert struct.unpack_from("<B", path.read_bytes(), record) == (5,)
        damage(path, record + offset, bit)
        recording = open_recording(path)
        found = list(recording.chunks())
        assert set(found) <= set(CHUNKS)
        assert len(found) >= len(CHUNKS) - 3
        assert (recording.own_damage.places, recording.own_damage.altered) == (1, True)
        said = skipped(recording, Tracker(PLAN).streams)
        assert any("checksum is wrong" in line for line in said)
        assert any("damaged bytes in one place were not used" in line for line in said)


@pytest.mark.slow
def test_no_flip_ends_a_track_early_without_a_word(tmp_path: Path) -> None:
    """Nor does the track of the repaired file; a campaign of 314 flips had the same result."""
    damaged, whole = tmp_path / "damaged.mcap", tmp_path / "whole.mcap"
    content = record_walk(tmp_path / "walk.mcap", SECONDS)
    expected = replay(tmp_path / "walk.mcap").estimates
    assert list(expected) == undamaged()
    for offset, bit in draw_flips(content, 8, 5):
        damaged.write_bytes(flipped(content, offset, bit))
        whole.unlink(missing_ok=True)
        repair(damaged, whole)
        replayed = replay(damaged)
        assert replayed.said
        assert {compare(replayed.estimates, expected), compare(replay(whole).estimates, expected)} <= {"same", "near"}


@pytest.mark.slow
def test_no_damaged_block_is_tracked_over_and_each_is_told(tmp_path: Path) -> None:
    content, rng, path = record_walk(tmp_path / "walk.mcap", SECONDS), random.Random(2), tmp_path / "damaged.mcap"
    expected = replay(tmp_path / "walk.mcap").estimates
    for kind, damage_blocks in KINDS.items():
        path.write_bytes(damage_blocks(content, rng))
        replayed = replay(path)
        assert falsely_tracking_m(replayed.estimates, expected) < TRACKING_M, kind
        assert replayed.said or list(replayed.estimates) == list(expected), kind
