# SPDX-License-Identifier: MIT
"""The program where it is no developer's: the manual's unit of systemd, another user without a home, a package that cannot be written, locale C."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from board_runs import ROOT
from waiting import PATIENCE_S

MANUAL = (ROOT / "host/docs/page.md").read_text()


@pytest.mark.process
@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="systemd-analyze is not installed")
def test_the_unit_of_the_manual_is_one(tmp_path: Path) -> None:
    (unit,) = re.findall(r"```ini\n(.*?)```", MANUAL, re.DOTALL)
    program = tmp_path / "echostep"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    path = tmp_path / "echostep.service"
    path.write_text(unit.replace("/opt/echostep/bin/echostep", str(program)))
    done = subprocess.run(
        ["systemd-analyze", "verify", path], capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert "echostep.service" not in done.stdout + done.stderr, done.stdout + done.stderr


@pytest.mark.process
@pytest.mark.parametrize("home", [None, "/", "/nonexistent"])
def test_it_runs_without_a_home_in_a_narrow_terminal_of_locale_c(tmp_path: Path, home: str | None) -> None:
    """The plan's check: it reads the package's files and needs no kernel."""
    paths = os.pathsep.join(path for path in sys.path if path)
    environment = {
        "PATH": os.environ["PATH"],
        "PYTHONPATH": paths,
        "LC_ALL": "C",
        "COLUMNS": "20",
        "TMPDIR": str(tmp_path),
    }
    environment |= {} if home is None else {"HOME": home}
    plan = ROOT / "host/echostep/plans/demo.json"
    command = [sys.executable, "-m", "echostep", "plan", "check", str(plan)]
    done = subprocess.run(command, env=environment, cwd="/", capture_output=True, timeout=PATIENCE_S, check=False)
    assert done.returncode == 0, done.stderr
    assert b"Traceback" not in done.stderr
