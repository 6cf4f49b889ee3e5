# SPDX-License-Identifier: MIT
"""Waiting for a condition."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

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
