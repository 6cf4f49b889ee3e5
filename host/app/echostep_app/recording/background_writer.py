# SPDX-License-Identifier: MIT
"""A file that is written by its own thread, so that the caller never waits for the disk.

In: bytes, at any time. Out: the same bytes in the file: passed to the operating system every `WRITE_S` and to the disk every `SYNC_S`.
Owns the file, which is new and locked for this process, the thread, and the buffer of bytes that are not written yet. A disk that refuses bytes
is reported once, and tried again every `RETRY_S`; a disk that is nearly full is reported before.
"""

from __future__ import annotations

import errno
import os
import shutil
import threading
import time
from collections import deque
from pathlib import Path

from echostep_app.recording.names import create

# All assumed: a killed process loses less than a tenth of a second, a power failure less than a second.
WRITE_S = 0.05  # between two writes
SYNC_S = 0.5  # between two fsync
RETRY_S = 1.0  # between two attempts on a disk that refuses bytes
MAX_WAIT_S = 1.0  # of `wait_until_written`
CLOSE_S = 10.0  # longest wait for the thread when the file is closed
MOST_NOTICES = 8  # kept; the oldest is dropped
RESERVE_BYTES = 1 << 28  # of free space: for more than an hour of the ports' bytes [host/docs/recordings.md]


class BackgroundWriter:
    """A new file, to which bytes are appended; raises EchostepError when it cannot be created, or exists. `notices` holds messages about the disk."""

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self.notices: deque[str] = deque(maxlen=MOST_NOTICES)
        self.is_whole = True  # until the disk has refused bytes for good
        self.failed = False  # the disk refused the bytes of the last write
        self.nearly_full = False  # less than `RESERVE_BYTES` are free
        self._file = create(self.path)
        self._check_space()
        self._lock = threading.Condition()
        self._pending = bytearray()  # not yet seen by the thread
        self._written = 0  # bytes passed to the operating system
        self._changes: list[tuple[int, bytes]] = []  # offset and bytes that come in the place of others
        self._length = 0  # bytes accepted by `write`
        self._closing = False
        self._thread = threading.Thread(target=self._run, name="recording", daemon=True)
        self._thread.start()

    @property
    def unwritten_bytes(self) -> int:
        """Bytes that are not yet passed to the operating system."""
        return self._length - self._written + sum(len(data) for _, data in self._changes)

    def write(self, data: bytes) -> int:
        """Append to the buffer; never waits for the disk."""
        with self._lock:
            self._pending += data
            self._length += len(data)
        return len(data)

    def overwrite(self, offset: int, data: bytes) -> None:
        """Replace bytes that were appended before; the file has them after all that was appended by now."""
        with self._lock:
            self._changes.append((offset, data))

    def tell(self) -> int:
        """Bytes accepted so far: the position in the file."""
        return self._length

    def wait_until_written(self) -> None:
        """Wait until the operating system has all bytes, for at most `MAX_WAIT_S`; return at once when the disk refuses bytes."""
        end_s = time.monotonic() + MAX_WAIT_S
        with self._lock:
            while self.unwritten_bytes and not self.failed and (left_s := end_s - time.monotonic()) > 0.0:
                self._lock.notify_all()
                self._lock.wait(min(left_s, WRITE_S))

    def close(self) -> None:
        """Write the rest of the buffer and close the file; a notice states the number of refused bytes, and a failed close."""
        with self._lock:
            self._closing = True
            self._lock.notify_all()
        self._thread.join(CLOSE_S)
        if self.unwritten_bytes:
            self.is_whole = False
            self.notices.append(f"{self.path}: the last {self.unwritten_bytes} bytes are not on the disk")
        if self._thread.is_alive():
            return
        try:
            if not os.fstat(self._file).st_nlink:
                self.is_whole = False
                self.notices.append(f"{self.path}: was removed while it was written; nothing of it is left")
            os.close(self._file)
        except OSError as error:  # it is closed all the same [close(2)]
            self.is_whole = False
            self.notices.append(f"{self.path}: {_reason(error)}; it may not be whole")

    def _run(self) -> None:
        """The thread: write the buffer until `close` is called, and once more after it."""
        unwritten, synced_s, dirty = b"", time.monotonic(), False
        while True:
            with self._lock:
                if not self._closing:
                    self._lock.wait(RETRY_S if self.failed else WRITE_S)
                closing = self._closing
                unwritten += bytes(self._pending)
                self._pending.clear()
                changes = list(self._changes)
            count = self._write_to_file(unwritten)
            done = self._change_file(changes) if count == len(unwritten) else 0
            with self._lock:
                unwritten = unwritten[count:]
                self._written += count
                del self._changes[:done]
                self._lock.notify_all()
            dirty = dirty or count > 0 or done > 0
            if dirty and (closing or time.monotonic() - synced_s >= SYNC_S):
                self._sync()
                self._check_space()
                synced_s, dirty = time.monotonic(), False
            if closing:
                return

    def _write_to_file(self, data: bytes) -> int:
        """Pass bytes to the operating system; returns how many it accepted."""
        count = 0
        view = memoryview(data)
        try:
            while count < len(data):
                count += os.write(self._file, view[count:])
        except OSError as error:
            if not self.failed:
                self.failed = True
                self.notices.append(f"{self.path}: {_reason(error)}; tracking goes on, new bytes are not recorded yet")
            return count
        if self.failed and data:
            self.failed = False
            self.notices.append(f"{self.path}: the disk takes bytes again; the recording goes on")
        return count

    def _change_file(self, changes: list[tuple[int, bytes]]) -> int:
        """Write bytes in the place of others; returns how many changes were made."""
        done = 0
        for offset, data in changes:
            os.lseek(self._file, offset, os.SEEK_SET)
            if self._write_to_file(data) < len(data):
                break
            done += 1
        os.lseek(self._file, 0, os.SEEK_END)
        return done

    def _check_space(self) -> None:
        """Compare the free space with `RESERVE_BYTES`; a notice when it has become less."""
        try:
            free = shutil.disk_usage(self.path.parent).free
        except OSError:
            return
        if free < RESERVE_BYTES and not self.nearly_full:
            what = f"only {free / 1e6:.0f} MB are free; from now on only the ports' bytes are recorded, nothing derived"
            self.notices.append(f"{self.path}: {what}: free some space")
        self.nearly_full = free < RESERVE_BYTES

    def _sync(self) -> None:
        """Ask the operating system to bring the file to the disk; pipes and some file systems have no fsync."""
        try:
            os.fsync(self._file)
        except OSError as error:
            if error.errno not in (errno.EINVAL, errno.ENOTSUP) and not self.failed:
                self.notices.append(f"{self.path}: {_reason(error)}")


def _reason(error: OSError) -> str:
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return "the disk is full"
    return f"the disk takes no more: {error.strerror}"
