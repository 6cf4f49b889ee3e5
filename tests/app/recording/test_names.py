# SPDX-License-Identifier: MIT
"""Recordings are never overwritten: a new name per run, and what is in the way stays."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from command_line import echostep
from echostep.errors import EchostepError
from echostep.ports.chunks import Chunk
from echostep.recording import open_recording
from echostep_app.recording import background_writer, names
from echostep_app.recording.recorder import DerivedMessage, Recorder, Topic
from echostep_app.recording.repair.edit import cut, repair
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
