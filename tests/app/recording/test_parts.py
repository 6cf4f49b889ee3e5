# SPDX-License-Identifier: MIT
"""Files of recordings: a new name per run, nothing is overwritten; parts by --split are replayed as one."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path

import pytest

from command_line import echostep
from echostep.errors import EchostepError
from echostep.ports.chunks import Chunk
from echostep.recording import open_parts, open_recording
from echostep_app.output.derived import PRESSURE
from echostep_app.recording import background_writer, names
from echostep_app.recording.recorder import DerivedMessage, Recorder, Topic
from echostep_app.recording.repair.contents import info
from echostep_app.recording.repair.edit import cut, repair
from echostep_app.recording.splitting import SplitLimit, numbered_recorder, parse_split
from echostep_app.session.metadata import start_recording
from players import pseudo_terminal


def record(wanted: Path, data: bytes, keep: int | None = None) -> Path:
    with start_recording(wanted, {"note": "a test"}, keep) as recorder:
        recorder.write(Chunk("board", 1, data))
    return recorder.path


def bytes_of(path: Path) -> bytes:
    return b"".join(chunk.data for chunk in open_recording(path).chunks())


def test_each_run_has_a_file_of_its_own_and_the_short_name_is_the_newest(tmp_path: Path) -> None:
    wanted = tmp_path / "walk.mcap"
    first, second = record(wanted, b"first"), record(wanted, b"second")
    assert (bytes_of(first), bytes_of(second), bytes_of(wanted)) == (b"first", b"second", b"second")
    assert [int(path.name.split("-")[1]) for path in (first, second)] == [1, 2]
    assert not list(tmp_path.glob("*.link"))


def test_a_file_that_is_not_a_runs_own_stays(tmp_path: Path) -> None:
    wanted = tmp_path / "walk.mcap"
    wanted.write_bytes(b"precious")
    path = record(wanted, b"new")
    assert wanted.read_bytes() == b"precious"
    assert bytes_of(path) == b"new"
    moved = tmp_path / "moved.mcap"
    wanted.rename(moved)
    record(wanted, b"newer")
    wanted.rename(tmp_path / "taken.mcap")  # out of the folder's reach: the recording keeps its other name
    assert bytes_of(tmp_path / "taken.mcap") == b"newer"
    record(wanted, b"newest")
    assert (bytes_of(tmp_path / "taken.mcap"), bytes_of(wanted)) == (b"newer", b"newest")


def test_no_writer_takes_a_name_that_exists(tmp_path: Path) -> None:
    path = record(tmp_path / "walk.mcap", b"whole")
    before = path.read_bytes()
    other = record(tmp_path / "other.mcap", b"other")
    for run in (lambda: Recorder(path, {}), lambda: repair(other, path), lambda: cut(other, 0.0, 1.0, path)):
        with pytest.raises(EchostepError, match="is not overwritten"):
            run()
    assert path.read_bytes() == before


def test_record_takes_no_plan_for_a_recording(tmp_path: Path) -> None:
    plan = tmp_path / "precious.json"
    plan.write_text("{}")
    with pseudo_terminal() as (_, port):
        done = echostep("record", "--board", port, "--out", plan, "--seconds", 0.1)
        assert (done.returncode, plan.read_text()) == (2, "{}")
        assert "ends in .mcap" in done.stderr
        plan = plan.rename(tmp_path / "precious.mcap")
        done = echostep("record", "--board", port, "--out", plan, "--seconds", 0.1)
    assert (done.returncode, plan.read_text()) == (0, "{}"), done.stderr
    assert "precious.mcap is another file and stays" in done.stdout


def test_rotation_removes_the_oldest_and_never_the_newest(tmp_path: Path) -> None:
    wanted = tmp_path / "walk.mcap"
    (tmp_path / "walk-0001-notes.mcap").write_text("mine")
    paths = [record(wanted, b"%d" % k) for k in range(4)]
    with Recorder(names.new_name(wanted), {}) as running:
        paths.append(running.path)
        running.write(Chunk("board", 1, b"running"))
        paths.append(record(wanted, b"kept", keep=0))  # as few as there may be
        paths.append(record(wanted, b"last", keep=2))
        left = [path for path in paths if path.exists()]
    assert left == paths[-3:], "the one that is being written, the one before, and its own"
    assert bytes_of(wanted) == b"last"
    assert (tmp_path / "walk-0001-notes.mcap").read_text() == "mine"


def test_two_runs_in_one_second_get_two_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    wanted = tmp_path / "walk.mcap"
    taken = names.new_name(wanted)
    taken.write_bytes(b"of another process")
    made = iter([taken, tmp_path / "walk-0002-20260101T000000Z.mcap"])
    monkeypatch.setattr("echostep_app.recording.splitting.new_name", lambda _: next(made))
    assert record(wanted, b"new").name == "walk-0002-20260101T000000Z.mcap"
    assert taken.read_bytes() == b"of another process"


def test_a_nearly_full_disk_is_announced_and_kept_for_the_ports(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usage = shutil.disk_usage(tmp_path)._replace(free=background_writer.RESERVE_BYTES - 1)
    monkeypatch.setattr("shutil.disk_usage", lambda _: usage)
    with Recorder(tmp_path / "a.mcap", {}) as recorder:
        recorder.write(Chunk("board", 1, b"bytes"))
        recorder.write_derived([DerivedMessage(Topic("/x", "x", "{}"), 1, {"x": 1})])
    assert recorder.skipped_messages == 1
    assert bytes_of(tmp_path / "a.mcap") == b"bytes"
    assert any("268 MB are free" in notice for notice in recorder.notices), recorder.notices


def test_bytes_and_the_name_reach_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Fsync of the folder when the file is made, and of the file at least once a second."""
    synced: list[int] = []
    fsync = os.fsync

    def noted(file: int) -> None:
        synced.append(os.fstat(file).st_ino)
        fsync(file)

    monkeypatch.setattr(os, "fsync", noted)
    with Recorder(tmp_path / "a.mcap", {}) as recorder:
        assert synced == [tmp_path.stat().st_ino]
        recorder.write(Chunk("board", 1, b"bytes"))
    assert synced[-1] == (tmp_path / "a.mcap").stat().st_ino
    assert background_writer.SYNC_S <= 1.0


def test_the_files_of_a_run_are_found_by_any_of_them(tmp_path: Path) -> None:
    first = tmp_path / "[my-party]-0001.mcap"
    parts = [names.part_name(first, number) for number in (2, 10)]
    for path in (first, *parts, tmp_path / "[my-party]-00012.mcap", names.part_name(tmp_path / "m-0001.mcap", 2)):
        path.touch()
    for any_of_them in (first, *parts):
        assert names.files_of(any_of_them) == [first, *parts]


CHUNKS = [Chunk("board" if n % 3 else "mtx", n * 20_000_000, bytes([n % 251]) * (n % 40 + 1)) for n in range(600)]
THREE_S = SplitLimit(span_ns=3_000_000_000)


def record_parts(folder: Path, limit: SplitLimit = THREE_S) -> list[Path]:
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
    parts = record_parts(tmp_path, limit)
    assert len(parts) >= 4
    # The first one has no number: it sorts behind
    assert re.fullmatch(r"walk-0001-\d{8}T\d{6}Z-part0002\.mcap", parts[0].name)
    assert all(info(part)[-1] == "  whole" for part in parts)
    together = [chunk for part in [parts[-1], *parts[:-1]] for chunk in open_recording(part).chunks()]
    assert together == CHUNKS
    recording = open_parts(parts)
    assert list(recording.chunks()) == CHUNKS
    assert (recording.metadata["seed"], recording.fraction, recording.damage()) == ("4", 1.0, [])


def test_the_parts_are_found_in_a_folder_and_by_a_pattern(tmp_path: Path) -> None:
    parts = record_parts(tmp_path)
    (tmp_path / "walk.mcap").hardlink_to(parts[-1])
    assert chunks_of(tmp_path) == CHUNKS
    assert chunks_of(tmp_path / "walk-0001*") == CHUNKS
    assert chunks_of(*reversed(parts), parts[0]) == CHUNKS


def test_a_missing_part_is_told(tmp_path: Path) -> None:
    second, third, fourth, first = record_parts(tmp_path)
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
    parts = record_parts(tmp_path)
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
    record_parts(tmp_path)
    record_parts(tmp_path)
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
        record_parts(tmp_path)
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
