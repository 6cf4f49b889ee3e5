# SPDX-License-Identifier: MIT
"""Whether a recording is still being written.

In: a path. Out: whether a process has locked the file, as the recorder does. Owns nothing.
"""

from __future__ import annotations

from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows: there an open file cannot be removed
    fcntl = None  # type: ignore[assignment]

SUFFIX = ".mcap"  # of a recording


def is_being_written(path: Path) -> bool:
    """Whether a process has locked the file."""
    if fcntl is None:
        return False
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        except OSError:  # a file system without locks
            return False
    return False
