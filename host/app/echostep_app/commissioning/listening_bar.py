# SPDX-License-Identifier: MIT
"""A bar that fills while a command listens to the ports.

In: a text, the seconds that it takes. Out: a bar on a terminal that vanishes at the end; nothing elsewhere. Owns the thread that moves it.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

REDRAW_S = 0.1


@contextmanager
def listening_bar(text: str, seconds: float, console: Console) -> Iterator[None]:
    """Fill the bar in `seconds`, while the block runs."""
    if not console.is_terminal:
        yield
        return
    over = threading.Event()
    with Progress(
        TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn(), console=console, transient=True
    ) as bars:
        task, began_s = bars.add_task(text, total=seconds), time.monotonic()

        def move() -> None:
            while not over.wait(REDRAW_S):
                bars.update(task, completed=min(time.monotonic() - began_s, seconds))

        thread = threading.Thread(target=move, daemon=True)
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()
