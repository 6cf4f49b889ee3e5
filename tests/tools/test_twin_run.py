# SPDX-License-Identifier: MIT
"""The twin in real time: each opening of the board's port begins the walk anew."""

from __future__ import annotations

import contextlib
import importlib
import os
import signal
import subprocess
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from board_runs import needs_twin, tool
from echostep_simulation.stimulus import ROW
from waiting import PATIENCE_S, until

run = importlib.import_module("twin.run")


class CountedBoard:
    """A board whose port is open for so many blocks."""

    def __init__(self, blocks: int) -> None:
        self.left, self.is_open, self.t_s = blocks, True, 7.0

    def advance(self, _: object) -> None:
        self.left -= 1
        self.is_open = self.left > 0


def walk_of(blocks: int) -> SimpleNamespace:
    sensors = SimpleNamespace(rows=lambda begin, end: np.zeros(end - begin, ROW))
    mtx = SimpleNamespace(arrival_s=np.zeros(0), frames=())
    return SimpleNamespace(mtx=mtx, sensors=sensors, walk=SimpleNamespace(t_s=np.zeros(blocks * run.BLOCK_MS)))


@pytest.mark.parametrize(("open_for", "played", "to_its_end"), [(3, 3, False), (20, 10, True)])
def test_a_walk_is_left_when_the_port_is_closed(open_for: int, played: int, to_its_end: bool) -> None:
    board = CountedBoard(open_for)
    mtx = SimpleNamespace(device=SimpleNamespace(pulses=True), answer_requests=lambda: None)
    assert run.play(walk_of(10), board, mtx) is to_its_end
    assert open_for - board.left == played


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


def test_the_gateway_of_a_walk_that_was_left_ends() -> None:
    gateway = run.Gateway(CountedBoard(1))
    assert gateway.now_s() == 7.0
    gateway.left = True
    with pytest.raises(SystemExit):
        gateway.now_s()
