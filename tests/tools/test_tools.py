# SPDX-License-Identifier: MIT
"""Every tool of tools/ starts and says what it is for; those without a test of their own run in small; the twin in real time."""

from __future__ import annotations

import contextlib
import importlib
import os
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from board_runs import ROOT, needs_twin, tool
from waiting import PATIENCE_S, until

Start = Callable[..., int | None]


@pytest.fixture
def start(monkeypatch: pytest.MonkeyPatch) -> Start:
    """Run a tool's `main` with words of a command line; its exit status."""

    def run(name: str, *words: object) -> int | None:
        monkeypatch.setattr("sys.argv", [name, *map(str, words)])
        status: int | None = importlib.import_module(name).main()
        return status

    return run


def tools() -> list[str]:
    """The modules that are programs."""
    files = [path for path in sorted((ROOT / "tools").rglob("*.py")) if "def main(" in path.read_text()]
    return [".".join(path.relative_to(ROOT / "tools").with_suffix("").parts) for path in files]


@pytest.mark.parametrize("name", tools())
def test_every_tool_says_what_it_is_for(name: str, start: Start, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        start(name, "--help")
    assert ended.value.code == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "usage:" in said
    assert len(said.partition("options:")[0]) > 60


@needs_twin
def test_measured_seconds_of_the_firmware(start: Start, capsys: pytest.CaptureFixture[str]) -> None:
    start("twin.measure", "--minutes", 0.1)
    said = capsys.readouterr().out
    assert said.count("PASS") > 20
    assert "FAIL" not in said


@needs_twin
def test_a_port_that_is_opened_again_begins_the_walk_anew(tmp_path: Path) -> None:
    """The true path then begins at the time of the second opening."""
    twin = subprocess.Popen([*tool("twin.run"), "--out", tmp_path], stdout=subprocess.PIPE, text=True)

    def began_s(after_s: float = -1.0) -> float | None:
        with contextlib.suppress(FileNotFoundError, IndexError, ValueError):
            t_s = float((tmp_path / "truth.csv").read_text().splitlines()[1].split(",")[0])
            return t_s if t_s > after_s else None
        return None

    try:
        assert twin.stdout is not None
        port = twin.stdout.readline().split()[1]
        opened = os.open(port, os.O_RDWR | os.O_NOCTTY)
        assert until(lambda: began_s() is not None)
        first_s = began_s()
        assert first_s is not None
        os.close(opened)
        assert any("begins the walk anew" in line for line in iter(twin.stdout.readline, ""))
        opened = os.open(port, os.O_RDWR | os.O_NOCTTY)
        assert until(lambda: began_s(first_s) is not None)
        os.close(opened)
    finally:
        twin.send_signal(signal.SIGINT)
        twin.communicate(timeout=PATIENCE_S)
