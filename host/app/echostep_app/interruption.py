# SPDX-License-Identifier: MIT
"""Signals that end a run: Ctrl-C, SIGTERM, SIGQUIT, and a terminal that is closed (SIGHUP).

In: signals. Out: one KeyboardInterrupt, after which the run writes its files. Owns the handlers, and whether a signal has come. A second Ctrl-C ends
at once. Waiting for a condition (`wait_for`) ends with a signal, too.

An exception between two bytecodes would tear a portion: recorded but not tracked, or tracked but not written. So the loop of a run holds the signal
back, and its source asks for it between two portions; a live run then takes what its ports have received, and no more. That also finds one that came
earlier and was lost, where Python drops every exception: in finalizers, and in the callbacks of LLVM while a kernel is compiled or loaded.
"""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TypeVar

Item = TypeVar("Item")
SIGNAL_POLL_S = 0.1  # a run that ends this late ends at once
POLL_S = 0.05  # of a condition that is waited for: a USB port that restarts is away for longer; assumed
_asked = threading.Event()  # a signal has come since `end_by_signals`
_holding = threading.Event()  # the first one is held back
HANGUP: signal.Signals | None = getattr(signal, "SIGHUP", None)  # missing on Windows, as is SIGQUIT
ENDS = [signal.SIGTERM, *filter(None, (HANGUP, getattr(signal, "SIGQUIT", None)))]  # besides Ctrl-C


def end_by_signals() -> None:
    """Handle the signals; a SIGHUP that this process ignores (nohup) stays ignored."""
    _asked.clear()
    signal.signal(signal.SIGINT, _end)
    for number in ENDS:
        if number != HANGUP or signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _end)


@contextmanager
def holding_signals() -> Iterator[None]:
    """Hold the first signal back: `is_asked` is then true."""
    _holding.set()
    try:
        yield
    finally:
        _holding.clear()


def is_asked() -> bool:
    """Whether a signal has come."""
    return _asked.is_set()


def until_asked(items: Iterable[Item]) -> Iterator[Item]:
    """The items until a signal comes; for a source that would go on."""
    for item in items:
        yield item
        if is_asked():
            return


def sleep(span_s: float) -> None:
    """Sleep; a signal that is held back ends it with KeyboardInterrupt."""
    ends_s = time.monotonic() + span_s
    while (left_s := ends_s - time.monotonic()) > 0.0:
        if is_asked():
            raise KeyboardInterrupt
        time.sleep(min(left_s, SIGNAL_POLL_S))


def wait_for(poll: Callable[[], Item | None], longest_s: float) -> Item | None:
    """The first value that is not None; None after the longest time. Ends as `sleep` does."""
    end_s = time.monotonic() + longest_s
    while time.monotonic() < end_s:
        if (value := poll()) is not None:
            return value
        sleep(POLL_S)
    return None


def _end(_number: int, _frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt, unless it is held back; afterwards only Ctrl-C still interrupts."""
    held = _holding.is_set() and not _asked.is_set()
    _asked.set()
    for number in ENDS:
        signal.signal(number, signal.SIG_IGN)
    if not held:
        raise KeyboardInterrupt
