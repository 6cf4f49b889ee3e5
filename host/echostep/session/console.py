# SPDX-License-Identifier: MIT
"""The terminal that the commands print on."""

from __future__ import annotations

from collections import deque
from typing import IO, cast

from rich.console import Console

from echostep.interruption import SafeOutput

_output = cast("IO[str]", SafeOutput())
console = Console(soft_wrap=True, file=_output)  # each message stays on one line, whatever the width of the terminal


def print_notices(notices: deque[str]) -> None:
    """Print queued messages of a port or of a recorder, and empty the queue."""
    while notices:
        console.print(notices.popleft(), markup=False)
