# SPDX-License-Identifier: MIT
"""Exit status of a run whose recording the disk has not taken: the run is done, and its status tells."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from board_runs import ROOT
from command_line import echostep
from echostep_app.recording import background_writer

PLAN = ROOT / "host/core/echostep/plans/demo.json"


@pytest.fixture
def full_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """No recording becomes longer than a few kilobytes."""
    write = os.write

    def refused(file: int, data: bytes) -> int:
        if Path(f"/proc/self/fd/{file}").readlink().suffix == ".mcap" and os.fstat(file).st_size > 100:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(file, data)

    monkeypatch.setattr(os, "write", refused)
    monkeypatch.setattr(background_writer, "RETRY_S", 0.05)


@pytest.mark.usefixtures("full_disk")
@pytest.mark.parametrize("command", ["demo", "command"])
def test_a_run_whose_recording_is_not_whole_ends_with_status_1(tmp_path: Path, command: str) -> None:
    """It has tracked to its end; the last line says what is missing."""
    arguments = {
        "demo": ("demo", "--headless", "--out", tmp_path),
        "command": ("command", "mqtt://127.0.0.1:9", "--plan", PLAN, "--no-page", "--seconds", "0.3", "--out", tmp_path / "o.mcap"),
    }  # fmt: skip
    done = echostep(*arguments[command])
    assert done.returncode == 1, done.stdout + done.stderr
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"echostep: {tmp_path}")
    assert line.endswith(".mcap: the recording is not whole; all else was done")
    assert "the disk is full" in done.stdout
    assert command == "command" or (tmp_path / "track.csv").exists()
