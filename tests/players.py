# SPDX-License-Identifier: MIT
"""Boards on pseudo terminals for the tests: the Python board at the pace of the wall clock, or the real firmware in the twin."""

from __future__ import annotations

import contextlib
import math
import os
import signal
import subprocess
import threading
import time
import tty
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from board_runs import quiet_rows, tool
from echostep_simulation.devices.board import PythonBoard
from twin.run import PtyBoard
from waiting import PATIENCE_S


@contextlib.contextmanager
def pseudo_terminal() -> Iterator[tuple[int, str]]:
    """Our end, and the name of the port."""
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    os.set_blocking(ours, False)
    try:
        yield ours, os.ttyname(theirs)
    finally:
        os.close(theirs)
        os.close(ours)


@contextlib.contextmanager
def playing(step: Callable[[], None]) -> Iterator[None]:
    """Another thread makes one step after the other."""
    over = threading.Event()

    def play() -> None:
        while not over.is_set():
            step()

    thread = threading.Thread(target=play)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join(timeout=PATIENCE_S)


@contextlib.contextmanager
def babbling_port(sent: bytes) -> Iterator[str]:
    """A port that says the same thing ten times a second."""
    with pseudo_terminal() as (ours, port):

        def step() -> None:
            with contextlib.suppress(BlockingIOError):
                os.write(ours, sent)
            time.sleep(0.1)

        with playing(step):
            yield port


def some_noise(rows: NDArray[Any], start_ms: int) -> None:
    """Gyros that are never quite still."""
    noise = np.random.default_rng(start_ms)
    for name in ("thigh", "calf", "belt"):
        rows[name] += np.rint(noise.normal(0.0, 2.5, len(rows))).astype(np.int16)


@contextlib.contextmanager
def python_board(shape: Callable[[NDArray[Any], int], None] = some_noise) -> Iterator[str]:
    """The port of a Python board that never falls behind the clock; `shape` changes the rows of a quiet person from that millisecond on."""
    board, began, played_ms = PythonBoard(), time.monotonic(), 0
    with pseudo_terminal() as (ours, port):

        def step() -> None:
            nonlocal played_ms
            heard = b""
            with contextlib.suppress(BlockingIOError):
                heard = os.read(ours, 4096)
            due_ms = math.ceil((time.monotonic() - began) * 1e3)  # its answers bear a time after their questions
            if due_ms > played_ms:
                rows = quiet_rows(due_ms - played_ms)
                shape(rows, played_ms)
                for _, sent in board.advance(rows):
                    with contextlib.suppress(BlockingIOError):
                        os.write(ours, sent)
                played_ms = due_ms
            board.send(heard)
            time.sleep(0.001)

        with playing(step):
            yield port


@contextlib.contextmanager
def twin_board(*faults: str, rows: Callable[[int], NDArray[Any]] = quiet_rows) -> Iterator[str]:
    """The port of the real firmware in the twin, in real time, with these faults thrown from the start; its inputs, by milliseconds."""
    board = PtyBoard()
    for fault in faults:
        board.fault(fault)
    due_s = time.monotonic()

    def step() -> None:
        nonlocal due_s
        board.advance(rows(5))
        due_s = max(due_s + 0.005, time.monotonic() - 0.5)
        time.sleep(max(0.0, due_s - time.monotonic()))

    try:
        with playing(step):
            yield str(board.port)
    finally:
        board.close()


@contextlib.contextmanager
def walking_twin(folder: Path, *options: str) -> Iterator[tuple[str, str]]:
    """A walk through the demo building in the twin: the ports of the board, real firmware in the simulator, and of an MTx or a foot board."""
    command = [*tool("twin.run"), *options, "--out", str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as running:
        try:
            assert running.stdout is not None
            board, mtx = (running.stdout.readline().split()[1] for _ in range(2))
            yield board, mtx
        finally:
            running.send_signal(signal.SIGINT)
            running.wait(timeout=PATIENCE_S)
