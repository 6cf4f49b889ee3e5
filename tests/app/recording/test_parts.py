# SPDX-License-Identifier: MIT
"""A recording in parts: `--split` begins new files, a replay takes them as one and tells which are missing."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from echostep.errors import EchostepError
from echostep.ports.chunks import Chunk
from echostep.recording import open_parts, open_recording
from echostep_app.output.derived import PRESSURE
from echostep_app.recording import names
from echostep_app.recording.recorder import DerivedMessage
from echostep_app.recording.repair.contents import info
from echostep_app.recording.repair.edit import repair
from echostep_app.recording.splitting import SplitLimit, numbered_recorder, parse_split

CHUNKS = [Chunk("board" if n % 3 else "mtx", n * 20_000_000, bytes([n % 251]) * (n % 40 + 1)) for n in range(600)]
THREE_S = SplitLimit(span_ns=3_000_000_000)


def record(folder: Path, limit: SplitLimit = THREE_S) -> list[Path]:
    """The parts of a run of twelve seconds."""
    with numbered_recorder(folder / "walk.mcap", {"seed": "4", "start_x_y_rad": "1,2,0"}, limit) as recorder:
        for chunk in CHUNKS:
            recorder.write(chunk)
            recorder.write_derived([DerivedMessage(PRESSURE, chunk.t_arrival_ns, {"ticks": 1, "pressure_pa": 1e5})])
    assert not recorder.notices
    return sorted(folder.glob("walk-*.mcap"))


def chunks_of(*paths: Path) -> list[Chunk]:
    return list(open_parts(paths).chunks())


@pytest.mark.parametrize("limit", [THREE_S, SplitLimit(size=20_000)])
def test_each_part_is_a_whole_recording_and_all_replay_as_one(tmp_path: Path, limit: SplitLimit) -> None:
    parts = record(tmp_path, limit)
    assert len(parts) >= 4
    assert re.fullmatch(
        r"walk-0001-\d{8}T\d{6}Z-part0002\.mcap", parts[0].name
    )  # the first one has no number: it sorts behind
    assert all(info(part)[-1] == "  whole" for part in parts)
    together = [chunk for part in [parts[-1], *parts[:-1]] for chunk in open_recording(part).chunks()]
    assert together == CHUNKS
    recording = open_parts(parts)
    assert list(recording.chunks()) == CHUNKS
    assert (recording.metadata["seed"], recording.fraction, recording.damage()) == ("4", 1.0, [])


def test_the_parts_are_found_in_a_folder_and_by_a_pattern(tmp_path: Path) -> None:
    parts = record(tmp_path)
    (tmp_path / "walk.mcap").hardlink_to(parts[-1])
    assert chunks_of(tmp_path) == CHUNKS
    assert chunks_of(tmp_path / "walk-0001*") == CHUNKS
    assert chunks_of(*reversed(parts), parts[0]) == CHUNKS


def test_a_missing_part_is_told(tmp_path: Path) -> None:
    second, third, fourth, first = record(tmp_path)
    recording = open_parts([first, third, fourth])
    assert list(recording.chunks()) == [c for c in CHUNKS if not 3e9 <= c.t_arrival_ns < 6e9]
    assert recording.damage() == ["part 2 of the run is missing: nothing of that time was used"]
    recording = open_parts([first])
    list(recording.chunks())
    assert recording.damage() == [f"the run goes on in {second.name}, which was not given"]
    recording = open_parts([fourth])
    list(recording.chunks())
    assert recording.damage() == ["parts 1 to 3 of the run are missing: nothing of that time was used"]
    assert recording.metadata["start_x_y_rad"] == "unknown"  # the run began elsewhere


def test_damage_of_a_part_is_told_by_its_name(tmp_path: Path) -> None:
    parts = record(tmp_path)
    content = bytearray(parts[1].read_bytes())
    content[len(content) // 2] ^= 1
    parts[1].write_bytes(content)
    recording = open_parts(parts)
    list(recording.chunks())
    assert recording.damage()[0].startswith(f"{parts[1].name}: its checksum is wrong")
    assert recording.to_repair() == [parts[1]]
    repair(parts[1], tmp_path / "mended.mcap")
    found = chunks_of(parts[0], *parts[2:], tmp_path / "mended.mcap")
    assert len(set(found) & set(CHUNKS)) >= len(CHUNKS) - 2


def test_parts_of_two_runs_are_not_one(tmp_path: Path) -> None:
    record(tmp_path)
    record(tmp_path)
    with pytest.raises(EchostepError, match="not a part of the run"):
        open_parts([tmp_path])
    with pytest.raises(EchostepError, match="no recording"):
        open_parts([tmp_path / "nothing*"])


def test_a_part_that_cannot_be_begun_is_told_and_nothing_is_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorder = numbered_recorder(tmp_path / "walk.mcap", {}, THREE_S)
    refused = []

    def create(path: Path) -> int:
        refused.append(path)
        raise EchostepError(f"{path}: cannot write: No space left on device")

    monkeypatch.setattr("echostep_app.recording.background_writer.create", create)
    for chunk in CHUNKS:
        recorder.write(chunk)
    assert [notice for notice in recorder.notices if "the recording goes on in walk-0001" in notice]
    recorder.close()
    assert len(refused) == 1
    assert chunks_of(recorder.path) == CHUNKS


def test_the_parts_of_an_old_run_are_removed_with_it(tmp_path: Path) -> None:
    for _ in range(3):
        record(tmp_path)
    removed = names.remove_older(tmp_path / "walk.mcap", 2)
    assert len(removed) == 4
    assert all("walk-0001" in path.name for path in removed)


@pytest.mark.parametrize("text", ["", "1", "0h", "-1h", "1h1min", "10kB", "1e9MB", "nan h", "0.5min", "99999999h"])
def test_a_limit_that_makes_no_sense_is_refused(text: str) -> None:
    with pytest.raises(EchostepError, match="--split"):
        parse_split(text)


def test_limits() -> None:
    assert parse_split("1.5GB") == SplitLimit(size=1_500_000_000)
    assert parse_split("90min") == SplitLimit(span_ns=5400 * 10**9)
