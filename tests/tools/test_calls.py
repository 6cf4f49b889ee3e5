# SPDX-License-Identifier: MIT
"""The campaign in which calls of the operating system fail, with a few calls of each kind; and that it sees what goes wrong."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from board_runs import ROOT
from reliability.calls.cases import Case
from reliability.calls.run import CRASHED, Outcome, faults_of
from reliability.calls.shim import Failure

CAMPAIGN = [sys.executable, "-m", "reliability.calls.campaign"]
SOUND = Outcome(0, 9, "", "", {"track.csv": "digest"}, truncated=False)
CASE = Case("replay", (), ("files",), repeats=True)


@pytest.mark.long
@pytest.mark.process
@pytest.mark.skipif(shutil.which("cc") is None or sys.platform != "linux", reason="no C compiler, or no LD_PRELOAD")
@pytest.mark.parametrize(
    ("command", "kind"), [("replay", "files"), ("replay on a terminal", "output"), ("record", "ports"), ("live with a page", "sockets")]
)  # fmt: skip
def test_a_call_that_fails_ends_no_run_with_an_exception(tmp_path: Path, command: str, kind: str) -> None:
    words = ["--only", command, "--kinds", kind, "--most", "2", "--out", str(tmp_path / "calls.jsonl")]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    run = subprocess.run([*CAMPAIGN, *words], cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    assert len((tmp_path / "calls.jsonl").read_text().splitlines()) >= 2


@pytest.mark.parametrize(
    ("outcome", "kind", "named"),
    [
        (SOUND, "files", ""),
        (replace(SOUND, status=None), "files", "did not end"),
        (replace(SOUND, status=CRASHED), "files", "no code handles"),
        (replace(SOUND, crashes="OSError: x"), "files", "no code handles: ['OSError: x']"),
        (replace(SOUND, status=2, printed="echostep: out: the disk is full\n"), "files", ""),
        (replace(SOUND, status=2, printed=""), "files", "without its one line"),
        (replace(SOUND, status=2, printed="echostep: out: the disk is full\n"), "output", "exit status 2"),
        (replace(SOUND, files={}), "files", "no track.csv"),
        (replace(SOUND, files={"track.csv": "other"}), "files", "other than without a fault: track.csv"),
        (replace(SOUND, truncated=True), "files", "not whole"),
        (replace(SOUND, truncated=True, printed="the last 9 bytes are not on the disk"), "files", "exit status say so"),
        (
            replace(SOUND, truncated=True, status=1, printed="the last 9 bytes are not on the disk\nechostep: x"),
            "files",
            "",
        ),
    ],
)
def test_what_must_not_be_is_seen(outcome: Outcome, kind: str, named: str) -> None:
    faults = ". ".join(faults_of(CASE, Failure(kind, 1), outcome, SOUND))
    assert named in faults
    assert bool(named) == bool(faults)
