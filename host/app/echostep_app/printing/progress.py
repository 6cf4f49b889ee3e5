# SPDX-License-Identifier: MIT
"""Progress on the terminal, wherever a command takes longer than a moment.

In: the name of the work; how far it is. Out: a line that is redrawn on a terminal and vanishes at the end, or one plain line elsewhere. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from threading import Timer
from typing import TypeVar

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from echostep_app.printing.console import console

SHOWN_AFTER_S = 2.0  # elsewhere than on a terminal: what ends before needs no line
LEAST_SHARE = 1e-3  # by which a bar grows: items may be many
Item = TypeVar("Item")


@contextmanager
def progress_line(text: str) -> Iterator[Callable[[float], None]]:
    """Show the name of the work while the block runs; the block is given a function that shows a share."""
    if not console.is_terminal:
        timer = Timer(SHOWN_AFTER_S, console.print, [f"{text} ..."])
        timer.daemon = True
        timer.start()
        try:
            yield lambda _share: None
        finally:
            timer.cancel()
        return
    with Progress(
        SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn(), console=console, transient=True
    ) as bars:
        task = bars.add_task(text, total=None)
        yield lambda share: bars.update(task, description=f"{text}: {share:.0%}")


def with_bar(
    items: Iterable[Item], text: str, fraction: Callable[[], float | None], on: Console | None = None
) -> Iterator[Item]:
    """The same items, with a bar on a terminal; `fraction`, 0 to 1, is asked at each item; None: it is not known."""
    shown = -1.0
    with bar(text, on) as show:
        for item in items:
            yield item
            if (done := fraction()) is not None and done > shown + LEAST_SHARE:
                show(done)
                shown = done


@contextmanager
def bar(text: str, on: Console | None = None) -> Iterator[Callable[[float], None]]:
    """A bar on a terminal while the block runs; it is given a function that shows the share that is done."""
    on = on or console
    if not on.is_terminal:
        yield lambda _share: None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=on, transient=True) as bars:
        task = bars.add_task(text, total=None)
        yield lambda share: bars.update(task, total=1.0, completed=share)
