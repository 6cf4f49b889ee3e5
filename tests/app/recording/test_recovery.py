# SPDX-License-Identifier: MIT
"""What happens to a recording when its process is killed or its disk is full."""

from __future__ import annotations

import errno
import os
import random
import resource
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from echostep.errors import EchostepError
from echostep.ports.chunks import Chunk
from echostep.recording import open_recording
from echostep_app.recording.background_writer import BackgroundWriter
from echostep_app.recording.recorder import RAW_LIMIT, Recorder
from recording.killed import kill_once
from waiting import PATIENCE_S, ends, until

FULL_DISK = """
import resource, sys, time
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, resource.RLIM_INFINITY))
from echostep_app.recording.recorder import Recorder
from echostep.ports.chunks import Chunk
from recording.killed import kill_once
from waiting import until
recorder = Recorder(sys.argv[1], {})
for n in range(1000):
    recorder.write(Chunk("mtx", n * 1_000_000, bytes(100)))
    time.sleep(0.0002)
until(lambda: recorder.notices)
print(*recorder.notices, sep="\\n")
recorder.notices.clear()
if len(sys.argv) > 2:
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    until(lambda: recorder.notices)
recorder.close()
print(*recorder.notices, sep="\\n")
"""


@pytest.mark.process
@pytest.mark.parametrize("kills", [2, pytest.param(50, marks=pytest.mark.long)])
def test_a_killed_recorder_has_lost_less_than_a_second_and_no_earlier_recording(tmp_path: Path, kills: int) -> None:
    rng = random.Random(7)
    for _ in range(kills):
        kill = kill_once(tmp_path / "walk.mcap", rng.uniform(0.1, 0.8))
        assert kill.opens
        assert kill.missing_s <= 1.0
        assert kill.changed == 0


def run_on_a_full_disk(path: Path, *more: str) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-c", FULL_DISK, path, *more],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},  # the tests' own modules too
        capture_output=True,
        text=True,
        check=False,
        timeout=3.0 * PATIENCE_S,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.splitlines()


@pytest.mark.process
def test_a_full_disk_is_announced_and_keeps_what_it_has(tmp_path: Path) -> None:
    said = run_on_a_full_disk(tmp_path / "a.mcap")
    assert "the disk takes no more" in said[0]
    assert "tracking goes on" in said[0]
    assert "are not on the disk" in said[-1]
    chunks = list(open_recording(tmp_path / "a.mcap").chunks())
    assert (tmp_path / "a.mcap").stat().st_size == 20_000
    assert chunks == [Chunk("mtx", n * 1_000_000, bytes(100)) for n in range(len(chunks))]
    assert len(chunks) > 140


def test_a_file_whose_close_fails_is_told_and_ends_no_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    writer = BackgroundWriter(tmp_path / "a.mcap")
    writer.write(b"bytes")
    file, close = writer._file, os.close

    def failing(number: int) -> None:
        close(number)
        if number == file:
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "close", failing)
    writer.close()
    assert list(writer.notices) == [f"{tmp_path / 'a.mcap'}: the disk is full; it may not be whole"]
    assert (tmp_path / "a.mcap").read_bytes() == b"bytes"


def test_a_file_that_is_removed_while_it_is_written_is_told(tmp_path: Path) -> None:
    writer = BackgroundWriter(tmp_path / "a.mcap")
    (tmp_path / "a.mcap").unlink()
    writer.close()
    said = [f"{tmp_path / 'a.mcap'}: was removed while it was written; nothing of it is left"]
    assert (list(writer.notices), writer.is_whole) == (said, False)


def test_a_disk_that_stands_still_does_not_keep_the_tracker_waiting(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stands, goes_on, write = threading.Event(), threading.Event(), os.write

    def held(file: int, data: bytes) -> int:
        if Path(f"/proc/self/fd/{file}").readlink().suffix == ".mcap":
            stands.set()
            goes_on.wait()
        return write(file, data)

    def write_rest() -> None:
        for chunk in chunks[1:]:
            recorder.write(chunk)

    recorder = Recorder(tmp_path / "a.mcap", {})
    chunks = [Chunk("mtx", n * 1_000_000, bytes(100)) for n in range(1000)]
    with monkeypatch.context() as patch:
        patch.setattr("echostep_app.recording.background_writer.os.write", held)
        recorder.write(chunks[0])
        assert stands.wait(PATIENCE_S)
        assert ends(write_rest)
        goes_on.set()
    recorder.close()
    assert list(open_recording(tmp_path / "a.mcap").chunks()) == chunks


@pytest.mark.process
def test_when_there_is_room_again_nothing_is_missing(tmp_path: Path) -> None:
    said = run_on_a_full_disk(tmp_path / "a.mcap", "room again")
    assert any("takes bytes again" in line for line in said)
    assert list(open_recording(tmp_path / "a.mcap").chunks()) == [
        Chunk("mtx", n * 1_000_000, bytes(100)) for n in range(1000)
    ]
    assert not open_recording(tmp_path / "a.mcap").own_damage.truncated


def test_a_disk_that_stays_full_costs_no_more_memory_than_the_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("echostep_app.recording.recorder.RAW_LIMIT", 100_000)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
    try:
        recorder = Recorder(tmp_path / "a.mcap", {})
        for n in range(1000):
            recorder.write(Chunk("mtx", n, bytes(1000)))
        assert until(lambda: recorder.notices)
        recorder.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert recorder.lost_chunks > 850
    assert any(f"{recorder.lost_chunks} chunks were not recorded" in line for line in recorder.notices)
    assert RAW_LIMIT > 1 << 20


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(EchostepError, match=r"file/a\.mcap: cannot write"):
        Recorder(tmp_path / "file" / "a.mcap", {})
