# SPDX-License-Identifier: MIT
"""Guidance from end to end: board, MTx and beacon gateway on real ports, `live` in a process of its own, a page that looks; then its replay."""

from __future__ import annotations

import contextlib
import csv
import importlib
import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from websockets.exceptions import InvalidMessage

from echostep_app.commands.actions.beacon_player import simulate_gateway
from echostep_simulation.devices.board import PythonBoard, Sent
from echostep_simulation.scenario import Scenario
from free_ports import free_port
from page.elements.test_page_guide import until
from page.frames import opened_url
from players import pseudo_terminal
from walks import DEMO, PLAN, walk_chunks

SEED = 3
WALK = ((2.0, 7.5), (9.0, 7.5))
PATIENCE_S = 180.0  # on a fresh clone the kernels are compiled first


class PortBoard:
    """A Python board whose bytes go to a port, and whose orders come from there."""

    def __init__(self, ours: int) -> None:
        self._ours = ours
        self._board = PythonBoard(seed=SEED)
        self.is_open = False
        self.t_s = 0.0  # board time

    def advance(self, rows: NDArray[Any]) -> Sent:
        """Let the milliseconds of these rows pass."""
        self.t_s += 1e-3 * len(rows)
        with contextlib.suppress(BlockingIOError):
            self._board.send(os.read(self._ours, 4096))
            self.is_open = True
        for _, sent in self._board.advance(rows):
            with contextlib.suppress(BlockingIOError):
                os.write(self._ours, sent)
        return []

    def send(self, sent: bytes) -> None:
        """Nothing: the host writes to the port itself."""

    def fault(self, text: str) -> None:
        """None."""

    def close(self) -> None:
        """Nothing to give back."""


@contextlib.contextmanager
def walking(beacons: str, truth: Path) -> Iterator[tuple[str, str]]:
    """Ports of a board and an MTx whose wearer begins to walk when somebody opens them; a gateway tells what beacons hear of him."""
    run = importlib.import_module("twin.run")
    with pseudo_terminal() as (ours, port):
        board, mtx = PortBoard(ours), run.PtyMtx()
        scenario = Scenario(PLAN, WALK, SEED, board)
        # In step with the board, however late that is
        arguments = (DEMO, truth, beacons, 2.0, 1.0, SEED, lambda: board.t_s)
        gateway = threading.Thread(target=simulate_gateway, args=arguments, daemon=True)
        walk_chunks(1.0)  # its kernels are compiled or loaded before the wearer walks

        def walk() -> None:
            run.wait_for_opening(board, mtx)
            scenario.write_truth(truth, board.t_s)
            gateway.start()
            run.play(scenario, board, mtx)

        thread = threading.Thread(target=walk, daemon=True)
        thread.start()
        yield port, mtx.port
        thread.join(PATIENCE_S)
        gateway.join(PATIENCE_S)


@pytest.fixture
def live(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    beacons = f"udp://127.0.0.1:{free_port(socket.SOCK_DGRAM)}"
    with walking(beacons, tmp_path / "truth.csv") as (board, mtx):
        command = [
            *(sys.executable, "-m", "echostep", "live", "--plan", DEMO, "--board", board, "--mtx", mtx, "--port", "0"),
            *("--beacons", beacons, "--guide", "9,7.5", "--out", tmp_path / "live"),
        ]
        running = subprocess.Popen(list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        try:
            yield running
        finally:
            running.kill()
            running.communicate()


@pytest.mark.long
@pytest.mark.process
def test_a_guided_walk_among_beacons_is_seen_on_the_page(live: subprocess.Popen[str], tmp_path: Path) -> None:
    assert live.stdout
    url = next(found[1] for line in live.stdout if (found := re.search(r"The page: (\S+)", line)))
    spoken: set[str] = set()
    marks: dict[int, dict[str, Any]] = {}

    def has_arrived(frame: dict[str, Any]) -> bool:
        marks.update({mark["number"]: mark for mark in frame["beacons"]})
        spoken.update([frame["guidance"]["spoken"]] if frame["guidance"] else [])
        return "You have arrived." in spoken

    try:
        with opened_url(url) as page:
            assert json.loads(page.recv(timeout=PATIENCE_S))["kind"] == "hello"
            seen = until(page, has_arrived)
    except (OSError, InvalidMessage) as error:
        assert live.poll() is None, live.stdout.read()
        pytest.skip(f"this machine is too slow to walk in real time: no page ({error})")
    live.send_signal(signal.SIGINT)
    said, _ = live.communicate(timeout=PATIENCE_S)
    assert live.returncode == 0, said
    assert {"Straight ahead.", "You have arrived."} <= spoken
    assert len(marks) >= 3
    assert all(mark["state"] == "well" for mark in marks.values())
    assert any(mark["heard"] for mark in seen["beacons"])
    cues = (tmp_path / "live/cues.csv").read_bytes()
    assert {row["kind"] for row in csv.DictReader(cues.decode().splitlines())} >= {"ahead", "arrived"}
    again = subprocess.run(
        [sys.executable, "-m", "echostep", "replay", tmp_path / "live/walk.mcap", "--plan", DEMO, "--guide", "9,7.5",
         "--headless", "--out", tmp_path / "again"],
        capture_output=True, text=True, timeout=PATIENCE_S, check=False,
    )  # fmt: skip
    assert again.returncode == 0, again.stderr
    assert (tmp_path / "again/cues.csv").read_bytes() == cues
    truth = np.genfromtxt(tmp_path / "truth.csv", delimiter=",", names=True)
    end = list(csv.DictReader((tmp_path / "live/track.csv").read_text().splitlines()))[-1]
    # A metre before it is there
    assert np.hypot(float(end["x_m"]) - truth["x"][-1], float(end["y_m"]) - truth["y"][-1]) < 1.3
