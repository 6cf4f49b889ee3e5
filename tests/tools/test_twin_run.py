# SPDX-License-Identifier: MIT
"""The twin in real time: each opening of the board's port begins the walk anew."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
from pathlib import Path

from board_runs import needs_twin, tool
from waiting import PATIENCE_S, until


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
