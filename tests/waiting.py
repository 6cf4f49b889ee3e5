# SPDX-License-Identifier: MIT
"""Waiting for a condition, and for a program."""

from __future__ import annotations

import subprocess
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

# Reached only by a test that fails: far more than anything takes while other programs have the cores
PATIENCE_S = 120.0


def until(holds: Callable[[], object], timeout_s: float = PATIENCE_S) -> bool:
    """Whether a condition came to hold before the timeout."""
    end_s = time.monotonic() + timeout_s
    while not holds():
        if time.monotonic() > end_s:
            return False
        time.sleep(0.01)
    return True


def ends(work: Callable[[], object]) -> bool:
    """Whether a call comes to its end although what it must not wait for stands still; it runs in a thread of its own."""
    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(PATIENCE_S)
    return not thread.is_alive()


def ran(command: Sequence[str | Path], **more: Any) -> subprocess.CompletedProcess[str]:
    """Exit status and output of a program that has run; `more` as for `subprocess.run`."""
    return subprocess.run(command, capture_output=True, text=True, check=False, **more)
