# SPDX-License-Identifier: MIT
"""What happens to a recording when its process is killed or its disk is full."""

from __future__ import annotations

import random
import resource
import subprocess
import sys
import time
from pathlib import Path

import pytest

from echostep.errors import EchostepError
from echostep.ports.chunks import Chunk
from echostep.recording.reading import open_recording
from echostep.recording.recorder import RAW_LIMIT, Recorder
from kill_recorder import kill_once

FULL_DISK = """
import resource, sys, time
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, resource.RLIM_INFINITY))
from echostep.recording.recorder import Recorder
from echostep.ports.chunks import Chunk
slowest = 0.0
recorder = Recorder(sys.argv[1], {})
for n in range(1000):
    began = time.perf_counter()
    recorder.write(Chunk("mtx", n * 1_000_000, bytes(100)))
    slowest = max(slowest, time.perf_counter() - began)
    time.sleep(0.0002)
time.sleep(0.3)
print(*recorder.notices, sep="\\n")
recorder.notices.clear()
if len(sys.argv) > 2:
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    time.sleep(1.5)
recorder.close()
print(*recorder.notices, sep="\\n")
print(f"slowest {slowest:.6f}")
"""


def test_a_killed_recorder_has_lost_less_than_a_second_and_no_earlier_recording(tmp_path: Path) -> None:
    """The small version of `tools/kill_recorder.py`."""
    rng = random.Random(7)
    for _ in range(2):
        kill = kill_once(tmp_path / "walk.mcap", rng.uniform(0.1, 0.8))
        assert kill.opens
        assert kill.missing_s <= 1.0
        assert kill.changed == 0


def run_on_a_full_disk(path: Path, *more: str) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-c", FULL_DISK, path, *more], capture_output=True, text=True, check=False, timeout=60
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.splitlines()


def test_a_full_disk_is_announced_and_keeps_what_it_has(tmp_path: Path) -> None:
    said = run_on_a_full_disk(tmp_path / "a.mcap")
    assert "the disk takes no more" in said[0]
    assert "tracking goes on" in said[0]
    assert "are not on the disk" in said[-2]
    assert float(said[-1].split()[1]) < 0.2  # the tracker is not kept waiting, on a machine that has other things to do
    chunks = list(open_recording(tmp_path / "a.mcap").chunks())
    assert (tmp_path / "a.mcap").stat().st_size == 20_000
    assert chunks == [Chunk("mtx", n * 1_000_000, bytes(100)) for n in range(len(chunks))]
    assert len(chunks) > 140


def test_when_there_is_room_again_nothing_is_missing(tmp_path: Path) -> None:
    said = run_on_a_full_disk(tmp_path / "a.mcap", "room again")
    assert any("takes bytes again" in line for line in said)
    assert list(open_recording(tmp_path / "a.mcap").chunks()) == [
        Chunk("mtx", n * 1_000_000, bytes(100)) for n in range(1000)
    ]
    assert not open_recording(tmp_path / "a.mcap").truncated


def test_a_disk_that_stays_full_costs_no_more_memory_than_the_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("echostep.recording.recorder.RAW_LIMIT", 100_000)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
    try:
        recorder = Recorder(tmp_path / "a.mcap", {})
        for n in range(1000):
            recorder.write(Chunk("mtx", n, bytes(1000)))
        deadline = time.monotonic() + 5.0
        while not recorder.notices and time.monotonic() < deadline:
            time.sleep(0.02)
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
