# SPDX-License-Identifier: MIT
"""A terminal, a pipe or a log that takes nothing ends no run; a run whose recording the disk has not taken says so by its status."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any
from unittest import mock

import pytest
from mcap.reader import make_reader

from command_line import PROGRAM, echostep, fill_disk, interrupt_once_called
from echostep.recording import open_recording
from echostep_app.cli import main
from echostep_app.operation.session import TableFeed
from echostep_app.recording import background_writer
from echostep_simulation.scenario import DEMO_WAYPOINTS
from players import pseudo_terminal, python_board
from waiting import PATIENCE_S, until
from walks import DEMO as PLAN

FULL = Path("/dev/full")  # refuses every byte: no space left [full(4)]
pytestmark = pytest.mark.process

# Runs the program with files closed that its parent left open, as the shell does for >&-
COMMAND = ("command", "mqtt://127.0.0.1:9", "--plan", str(PLAN), "--port", "0")
CLOSING = "import os, sys; [os.close(int(k)) for k in sys.argv[1]]; os.execv(sys.argv[2], sys.argv[2:])"


@contextlib.contextmanager
def unread_pipe() -> Iterator[int]:
    """The end of a pipe whose reader has gone."""
    ours, theirs = os.pipe()
    os.close(ours)
    yield theirs
    os.close(theirs)


@contextlib.contextmanager
def output_of(kind: str) -> Iterator[IO[Any] | int]:
    """Where a run prints: `full` | `gone` | `stopped` (a terminal that nobody reads) | `closed`."""
    with contextlib.ExitStack() as stack:
        if kind == "full":
            yield stack.enter_context(FULL.open("w"))
        elif kind == "gone":
            yield stack.enter_context(unread_pipe())
        elif kind == "stopped":
            stack.enter_context(pseudo_terminal())
            _, name = stack.enter_context(pseudo_terminal())
            yield stack.enter_context(Path(name).open("w"))
        else:
            yield subprocess.DEVNULL


def log_lines(path: Path) -> list[str]:
    with path.open("rb") as file:
        return [json.loads(m.data)["message"] for _, _, m in make_reader(file).iter_messages(topics=["/log"])]


@pytest.mark.long
@pytest.mark.parametrize(
    ("kind", "command"),
    [("full", "live"), ("gone", "live"), ("stopped", "live"), ("closed", "live"), ("full", "record")],
)
def test_a_run_outlasts_its_output(tmp_path: Path, kind: str, command: str) -> None:
    closed = [sys.executable, "-c", CLOSING, "12"] if kind == "closed" else []
    walk = tmp_path / "walk.mcap"
    where = ["--out", walk] if command == "record" else ["--out", tmp_path, "--plan", PLAN, "--no-page"]
    with python_board() as port, output_of(kind) as output:
        arguments = [*closed, *PROGRAM, command, "--board", port, *where]
        run = subprocess.Popen(list(map(str, arguments)), stdin=subprocess.DEVNULL, stdout=output, stderr=output)
        try:
            assert until(lambda: run.poll() is not None or (walk.exists() and walk.stat().st_size > 60_000))
            run.send_signal(signal.SIGQUIT)
            assert run.wait(timeout=PATIENCE_S) == 0
        finally:
            run.kill()
            run.wait()
    recording = open_recording(walk)
    assert sum(len(chunk.data) for chunk in recording.chunks()) > 5_000
    assert not recording.own_damage.truncated
    said = {"full": "No space left on device", "gone": "its reader has gone", "closed": "is closed", "stopped": None}[
        kind
    ]
    lines = log_lines(walk)
    assert len(lines) == len(set(lines)) <= 2
    assert all(said in line for line in lines) if said else not lines
    assert not said or any(line.startswith("standard output") for line in lines)
    assert command == "record" or (tmp_path / "track.csv").exists()


def test_the_commanders_page_and_recording_tell_that_nothing_is_printed_any_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[str] = []
    monkeypatch.setattr(TableFeed, "publish", lambda _, scene: shown.append(scene.fault))
    interrupt_once_called(TableFeed, "publish", monkeypatch, lambda *_: "standard output" in shown[-1])
    with FULL.open("w") as full, mock.patch.object(sys, "stdout", full):
        monkeypatch.setattr(sys, "argv", ["echostep", *COMMAND, "--out", str(tmp_path / "o.mcap")])
        with pytest.raises(SystemExit) as end:
            main()
    assert end.value.code == 0
    assert shown[-1].endswith("standard output: No space left on device")
    (walk,) = tmp_path.glob("o-*.mcap")
    assert log_lines(walk) == ["standard output: No space left on device"]


def test_a_command_whose_result_is_lost_has_status_2() -> None:
    """As any compiler; a reader that had enough is no fault."""
    with FULL.open("w") as full:
        done = subprocess.run([*PROGRAM, "--help"], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "No space left on device" in done.stderr
    with unread_pipe() as gone:
        done = subprocess.run([*PROGRAM, "--help"], stdout=gone, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.fixture
def full_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """No recording becomes longer than a few kilobytes."""
    fill_disk(monkeypatch, 100)
    monkeypatch.setattr(background_writer, "RETRY_S", 0.05)


@pytest.mark.usefixtures("full_disk")
@pytest.mark.parametrize("command", ["demo", "command"])
def test_a_run_whose_recording_is_not_whole_ends_with_status_1(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str
) -> None:
    """It has tracked to its end; the last line says what is missing."""
    monkeypatch.setattr("echostep_app.session.runs.demo.DEMO_WAYPOINTS", DEMO_WAYPOINTS[:2])
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
