# SPDX-License-Identifier: MIT
"""What ends a run from outside: Ctrl-C, SIGTERM, and a terminal that is closed (SIGHUP).

In: signals. Out: one KeyboardInterrupt, after which the run writes its files; an output that a closed terminal does not break.
Owns the handlers, and whether a signal has come. A second Ctrl-C ends at once.

An exception between two bytecodes would tear a portion: recorded but not tracked, or tracked but not written. So the loop of a run holds the signal
back and asks for it between two portions. That also finds one that came earlier and was lost, where Python drops every exception: in finalizers, and
in the callbacks of LLVM while a kernel is compiled or loaded.
"""

from __future__ import annotations

import errno
import io
import os
import signal
import stat
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TextIO

SIGNAL_POLL_S = 0.1  # a run that ends this late ends at once
_asked = threading.Event()  # a signal has come since `end_by_signals`
_holding = threading.Event()  # the first one is held back
HANGUP: signal.Signals | None = getattr(signal, "SIGHUP", None)  # missing on Windows


def end_by_signals() -> None:
    """Handle the signals; a SIGHUP that this process was told to ignore (nohup) stays ignored."""
    _asked.clear()
    signal.signal(signal.SIGINT, _end)
    signal.signal(signal.SIGTERM, _end)
    if HANGUP is not None and signal.getsignal(HANGUP) is not signal.SIG_IGN:
        signal.signal(HANGUP, _end)


@contextmanager
def holding_signals() -> Iterator[None]:
    """Hold the first signal back until `raise_held`."""
    _holding.set()
    try:
        yield
    finally:
        _holding.clear()


def raise_held() -> None:
    """Raise KeyboardInterrupt when a signal has come."""
    if _asked.is_set():
        raise KeyboardInterrupt


def sleep(span_s: float) -> None:
    """Sleep; a signal that is held back ends it with KeyboardInterrupt."""
    ends_s = time.monotonic() + span_s
    while (left_s := ends_s - time.monotonic()) > 0.0:
        raise_held()
        time.sleep(min(left_s, SIGNAL_POLL_S))


def _end(number: int, _frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt, unless it is held back; afterwards only Ctrl-C still interrupts."""
    held = _holding.is_set() and not _asked.is_set()
    _asked.set()
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    if HANGUP is not None:
        signal.signal(HANGUP, lambda *_: leave_terminal())
    if number == HANGUP:
        leave_terminal()
    if not held:
        raise KeyboardInterrupt


def leave_terminal() -> None:
    """Send output to nowhere if it goes to a terminal: that is closed, and each write to it would fail."""
    for stream in (sys.__stdout__, sys.__stderr__):
        try:
            if stream is None:
                continue
            if os.isatty(stream.fileno()) or _is_closed(stream.fileno()):
                nowhere = os.open(os.devnull, os.O_WRONLY)
                os.dup2(nowhere, stream.fileno())
                os.close(nowhere)
        except (OSError, ValueError):  # a stream without a file
            continue


def _is_closed(file: int) -> bool:
    """Whether it is a terminal that was closed: such a one is no longer known as a terminal."""
    try:
        os.write(file, b"")
    except OSError as error:
        return error.errno == errno.EIO
    return stat.S_ISCHR(os.fstat(file).st_mode)


class SafeOutput(io.TextIOBase):
    """`sys.stdout` as it is at each call; when its terminal was closed, what is written is dropped."""

    @property
    def _stdout(self) -> TextIO:
        """The stream behind rich's own replacement of `sys.stdout`, which writes to this object."""
        stream: TextIO = getattr(sys.stdout, "rich_proxied_file", sys.stdout)
        return stream

    def write(self, text: str) -> int:
        """Write, or drop."""
        with self._dropping():
            return self._stdout.write(text)
        return len(text)

    def flush(self) -> None:
        """Flush, or drop."""
        with self._dropping():
            self._stdout.flush()

    def fileno(self) -> int:
        """That of `sys.stdout`."""
        return self._stdout.fileno()

    def isatty(self) -> bool:
        """Whether `sys.stdout` is a terminal."""
        return self._stdout.isatty()

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """That of `sys.stdout`."""
        return self._stdout.encoding

    @contextmanager
    def _dropping(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            if error.errno != errno.EIO:
                raise
            leave_terminal()
