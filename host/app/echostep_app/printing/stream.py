# SPDX-License-Identifier: MIT
"""A text stream to people that never raises: unwritable text is dropped, and the reason is kept.

In: texts; standard output or standard error. Out: their bytes. Owns the unwritten text and, once no write may wait, a thread.

A terminal may be closed, the reader of a pipe may go, a disk may be full, a terminal may be stopped by Ctrl-S. A command whose result is its
output waits for its reader, and its exit status reports a loss. A run does not wait: after `outlast` a thread writes, and text more than
`QUEUE_BYTES` behind is dropped.
"""

from __future__ import annotations

import errno
import io
import os
import select
import sys
import threading
import time
from collections.abc import Callable
from typing import TextIO

# Assumed, all of them.
BUFFER_BYTES = 1 << 13  # written at once where it is no terminal
QUEUE_BYTES = 1 << 18  # may wait for a slow reader during a run: some ten drawings of the terminal view
DRAIN_S = 2.0  # longest wait for a slow reader at the end of a run
RETRY_S = 1.0  # longest wait for a stream that takes nothing at present
GONE = "its reader has gone"


class PeopleStream(io.TextIOBase):
    """Writes to `stream`; None: closed, as after `>&-`. `fault` says why nothing is written any more, empty as long as it is."""

    def __init__(self, stream: TextIO | None, name: str) -> None:
        self.fault = "" if stream else f"{name} is closed"
        self.has_lost = False  # something was written and dropped
        self.name = name
        self.on_fault: Callable[[str], None] | None = None  # is called once with the fault, by the thread that writes
        self._stream = stream
        self._file = _file_of(stream)
        if self._file is None and isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=self.errors)
        self._on_terminal = stream is not None and stream.isatty()
        self._buffer = bytearray()
        self._changed = threading.Condition()
        self._thread: threading.Thread | None = None
        self._busy = self._ended = False  # the thread is writing; nothing more comes

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """That of the stream; letters that it lacks are written as `?`."""
        return (self._stream.encoding if self._stream else None) or "utf-8"

    @property
    def errors(self) -> str:  # type: ignore[override]
        """How such letters are written."""
        return "replace"

    @property
    def is_gone(self) -> bool:
        """Whether the reader has gone: for a command with much output."""
        return self.fault.endswith(GONE)

    def fileno(self) -> int:
        """That of the stream."""
        if self._stream is None:
            raise io.UnsupportedOperation("fileno")
        return self._stream.fileno()

    def isatty(self) -> bool:
        """Whether the stream is a terminal that accepts text."""
        return self._on_terminal and not self.fault

    def writable(self) -> bool:
        """Always."""
        return True

    def write(self, text: str) -> int:
        """Write, or drop."""
        if self.fault:
            self.has_lost = True
            return len(text)
        if self._file is None:
            self._write_through(text)
            return len(text)
        data = text.encode(self.encoding, self.errors)
        with self._changed:
            if self._thread is None or len(self._buffer) + len(data) <= QUEUE_BYTES:
                self._buffer += data
            self._changed.notify_all()
        if self._thread is None and (self._on_terminal or len(self._buffer) >= BUFFER_BYTES):
            self.flush()
        return len(text)

    def flush(self) -> None:
        """Write the buffered text; of a stream that must not delay, the thread does."""
        if self._thread is None and not self.fault and self._file is not None:
            with self._changed:
                data = bytes(self._buffer)
                self._buffer.clear()
            self._write_to_file(data)

    def outlast(self) -> None:
        """From now on no write waits."""
        if self._thread is None and self._file is not None:
            self.flush()
            self._thread = threading.Thread(target=self._run, name=self.name, daemon=True)
            self._thread.start()

    def drain(self) -> None:
        """Write the rest, the last; after `outlast` wait for it for at most `DRAIN_S`."""
        self.flush()
        end_s = time.monotonic() + DRAIN_S
        with self._changed:
            while self._thread and (self._buffer or self._busy) and (left_s := end_s - time.monotonic()) > 0.0:
                self._changed.wait(left_s)
            self._ended = True
            self._changed.notify_all()

    def _run(self) -> None:
        """The thread."""
        while True:
            with self._changed:
                self._busy = False
                self._changed.notify_all()
                while not self._buffer:
                    if self._ended:
                        return
                    self._changed.wait()
                data, self._busy = bytes(self._buffer), True
                self._buffer.clear()
            self._write_to_file(data)

    def _write_to_file(self, data: bytes) -> None:
        """All bytes, past the stream's own buffer: a thread that waits for a reader must hold no lock of the interpreter's end."""
        view = memoryview(data)
        while view and not self.fault:
            try:
                view = view[os.write(self._file or 0, view) :]
            except BlockingIOError:  # another program has made the terminal so
                select.select([], [self._file or 0], [], RETRY_S)
            except OSError as error:
                self._fail(error)

    def _write_through(self, text: str) -> None:
        """To a stream without a file."""
        try:
            self._stream.write(text)  # type: ignore[union-attr]
        except (OSError, ValueError) as error:  # ValueError: it is closed
            self._fail(error)

    def _fail(self, error: Exception) -> None:
        self.has_lost = True
        number = getattr(error, "errno", None)
        self.fault = f"{self.name}: " + (
            GONE if number == errno.EPIPE else getattr(error, "strerror", "") or str(error)
        )
        if self.on_fault:
            self.on_fault(self.fault)


def _file_of(stream: TextIO | None) -> int | None:
    """The number of the stream's file; None where it has none, or where the system's own stream must translate (Windows)."""
    try:
        return stream.fileno() if stream and sys.platform != "win32" else None
    except (OSError, ValueError):
        return None
