"""A file that a thread of its own writes: who has something to write never waits for the disk.

In: bytes, at any time. Out: the same bytes in the file, with the operating system within a twentieth of a second and on the disk within one.
Owns the file, the thread, and what the disk has not taken yet. A disk that takes no more is announced, and tried again every second.
"""

from __future__ import annotations

import errno
import os
import threading
import time
from collections import deque
from pathlib import Path

from echostep.errors import EchostepError

DRAIN_S = 0.05
SYNC_S = 0.5
RETRY_S = 1.0
SETTLE_S = 1.0  # nobody waits longer for a disk that takes nothing
CLOSE_S = 10.0


class Spool:
    """Append-only; raises EchostepError when the file cannot be made. `notices` says in words what happens to the disk."""

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self.notices: deque[str] = deque(maxlen=8)
        self.failed = False  # the disk took nothing when it was asked last
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | getattr(os, "O_BINARY", 0), 0o666)
        except OSError as error:
            raise EchostepError(f"{path}: cannot write: {error.strerror}") from error
        self._lock = threading.Condition()
        self._pending = bytearray()
        self._written = 0  # bytes that the operating system has
        self._length = 0
        self._closing = False
        self._thread = threading.Thread(target=self._drain, name="spool", daemon=True)
        self._thread.start()

    @property
    def behind(self) -> int:
        """Bytes that the operating system does not have yet."""
        return self._length - self._written

    def write(self, piece: bytes) -> int:
        """Take bytes; never waits."""
        with self._lock:
            self._pending += piece
            self._length += len(piece)
        return len(piece)

    def tell(self) -> int:
        """Bytes taken so far."""
        return self._length

    def settle(self) -> None:
        """Wait until the operating system has everything; not at all for a disk that is full, and never for longer than a second."""
        end = time.monotonic() + SETTLE_S
        with self._lock:
            while self.behind and not self.failed and (left := end - time.monotonic()) > 0.0:
                self._lock.notify_all()
                self._lock.wait(min(left, DRAIN_S))

    def close(self) -> None:
        """Write what is left, as far as the disk takes it, and close the file."""
        with self._lock:
            self._closing = True
            self._lock.notify_all()
        self._thread.join(CLOSE_S)
        if self.behind:
            self.notices.append(f"{self.path}: the last {self.behind} bytes are not on the disk")
        if not self._thread.is_alive():
            os.close(self._file)

    def _drain(self) -> None:
        """The thread: until closed, and then once more."""
        left, synced_s, dirty = b"", time.monotonic(), False
        while True:
            with self._lock:
                if not self._closing:
                    self._lock.wait(RETRY_S if self.failed else DRAIN_S)
                closing = self._closing
                left += bytes(self._pending)
                self._pending.clear()
            taken = self._pour(left)
            with self._lock:
                left = left[taken:]
                self._written += taken
                self._lock.notify_all()
            dirty = dirty or taken > 0
            if dirty and (closing or time.monotonic() - synced_s >= SYNC_S):
                self._sync()
                synced_s, dirty = time.monotonic(), False
            if closing:
                return

    def _pour(self, left: bytes) -> int:
        """How many bytes the operating system took."""
        taken = 0
        view = memoryview(left)
        try:
            while taken < len(left):
                taken += os.write(self._file, view[taken:])
        except OSError as error:
            if not self.failed:
                self.failed = True
                self.notices.append(
                    f"{self.path}: {_words(error)}; tracking goes on, what comes now is not recorded yet"
                )
            return taken
        if self.failed and left:
            self.failed = False
            self.notices.append(f"{self.path}: the disk takes bytes again; the recording goes on")
        return taken

    def _sync(self) -> None:
        try:
            os.fsync(self._file)
        except OSError as error:
            if error.errno not in (errno.EINVAL, errno.ENOTSUP) and not self.failed:
                self.notices.append(f"{self.path}: {_words(error)}")


def _words(error: OSError) -> str:
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return "the disk is full"
    return f"the disk takes no more: {error.strerror}"
