# SPDX-License-Identifier: MIT
"""What CI runs on machines with one, several and no supported Python: a PATH of stubs instead of make and the Pythons."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from board_runs import ROOT

pytestmark = pytest.mark.process

MAKE, PYTHON = 'echo "make $@"', '[ "$1" != --version ] || echo "Python {}"'


def run(path: Path, pythons: dict[str, str]) -> list[str]:
    """Lines printed by `.ci/run` where the PATH has these Pythons, by name or by place at home, with their bodies."""
    path.mkdir()
    for tool in ("bash", "dirname", "id", "sed"):
        (path / tool).symlink_to(str(shutil.which(tool)))
    for name, body in {"make": MAKE, "python3": PYTHON.format("3.9.2"), **pythons}.items():
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        (path / name).write_text(f"#!/bin/sh\n{body}\n")
        (path / name).chmod(0o755)
    environment = {"PATH": str(path), "HOME": str(path)}
    done = subprocess.run([ROOT / ".ci/run"], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_the_oldest_and_the_newest_are_tested(tmp_path: Path) -> None:
    versions = {"python3.11": "3.11.7", "python3.12": "3.12.1", "python3.13": "3.13.0", "python3.99": "3.99.0"}
    assert run(tmp_path / "bin", {name: PYTHON.format(version) for name, version in versions.items()}) == [
        "Two Pythons are tested: first Python 3.13.0 with the quick tests, then Python 3.11.7 with all.",
        "make setup PYTHON=python3.13 VENV=.venv/newest",
        "make quick PYTHON=python3.13 VENV=.venv/newest",
        "make core-alone PYTHON=python3.11",
        "make test PYTHON=python3.11",
        "make long PYTHON=python3.11",
    ]


def test_a_name_that_does_not_run_is_no_python(tmp_path: Path) -> None:
    """As pyenv's, for versions that it has and does not use."""
    pythons = {"python3.11": PYTHON.format("3.11.7"), "python3.13": "exit 127"}
    assert run(tmp_path / "one", pythons) == [
        "One Python is tested: Python 3.11.7.",
        "make core-alone PYTHON=python3.11",
        "make test PYTHON=python3.11",
        "make long PYTHON=python3.11",
    ]
    pythons[".pyenv/versions/3.13.0/bin/python"] = PYTHON.format("3.13.0")
    assert f"make setup PYTHON={tmp_path}/two/.pyenv/versions/3.13.0/bin/python VENV=.venv/newest" in run(
        tmp_path / "two", pythons
    )
    assert run(tmp_path / "none", {}) == [
        "One Python is tested: Python 3.9.2.",
        "make core-alone PYTHON=python3",
        "make test PYTHON=python3",
        "make long PYTHON=python3",
    ]
