# SPDX-License-Identifier: MIT
"""A run ends with whole files, whatever ends it: SIGTERM, SIGHUP, a terminal that is closed."""

from __future__ import annotations

import contextlib
import os
import pty
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from board_runs import ROOT
from command_line import PROGRAM
from echostep.recording.reading import open_recording
from players import python_board

PLAN = ROOT / "host/echostep/plans/demo.json"


def until(holds: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 60.0
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.05)


@pytest.mark.parametrize("end", ["SIGTERM", "closed"])
def test_a_live_run_ends_with_a_whole_recording(tmp_path: Path, end: str) -> None:
    """A terminal that is closed sends SIGHUP."""
    terminal, theirs = pty.openpty()
    with python_board() as port:
        live = subprocess.Popen(
            [*PROGRAM, "live", "--plan", PLAN, "--board", port, "--out", tmp_path, "--no-page"],
            stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True,
            preexec_fn=lambda: os.close(os.open(os.ttyname(0), os.O_RDWR)),  # noqa: PLW1509  # makes it the controlling terminal
        )  # fmt: skip
        os.close(theirs)
        os.set_blocking(terminal, False)
        try:
            until(lambda: _drain(terminal) and (tmp_path / "walk.mcap").exists())
            until(lambda: _drain(terminal) and (tmp_path / "walk.mcap").stat().st_size > 10_000)
            if end == "closed":
                os.close(terminal)
            else:
                live.send_signal(getattr(signal, end))
                until(lambda: _drain(terminal) and live.poll() is not None)
            live.wait(timeout=120)
        finally:
            live.kill()
            if end != "closed":
                os.close(terminal)
    assert live.returncode == 0
    recording = open_recording(tmp_path / "walk.mcap")
    assert sum(len(chunk.data) for chunk in recording.chunks()) > 1_000
    assert not recording.truncated
    assert (tmp_path / "track.csv").exists()


def _drain(terminal: int) -> bool:
    """Read what the program prints, so that it does not wait for the terminal."""
    with contextlib.suppress(OSError):
        os.read(terminal, 1 << 16)
    return True
