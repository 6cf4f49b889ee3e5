# SPDX-License-Identifier: MIT
"""The terminal that the commands print on."""

from __future__ import annotations

from collections import deque

from echostep_app.printing.console import console_for_people

console = console_for_people()


def print_notices(notices: deque[str]) -> None:
    """Print queued messages of a port or of a recorder, and empty the queue."""
    while notices:
        console.print(notices.popleft(), markup=False)
