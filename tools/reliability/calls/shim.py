# SPDX-License-Identifier: MIT
"""The library whose calls fail: built, preloaded, armed.

In: `failing_calls.c`. Out: a process that was started with the library; calls that fail in it. Owns the built file.
"""

from __future__ import annotations

import ctypes
import errno
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from places import OUT

SOURCE = Path(__file__).with_name("failing_calls.c")
BUILT = OUT / "failing_calls.so"
LOADED = "ECHOSTEP_FAILING_CALLS"  # set in a process that has the library
# Number in the library, and the error that such a call has in practice
KINDS = {
    "output": (1, errno.ENOSPC),
    "files": (2, errno.ENOSPC),
    "ports": (3, errno.EIO),
    "sockets": (4, errno.ECONNRESET),
}


@dataclass(frozen=True, slots=True)
class Failure:
    """Call number `call` of a kind fails, and with `lasts` all after it; 0: none does."""

    kind: str
    call: int
    lasts: bool = False

    def __str__(self) -> str:
        return f"{self.kind}, call {self.call}{' and all after it' if self.lasts else ''}"

    def arm(self, folder: Path) -> None:
        """From now on, in this process; files are those in `folder`."""
        number, error = KINDS[self.kind]
        ctypes.CDLL(None).fail_call(number, ctypes.c_long(self.call), error, int(self.lasts), os.fsencode(folder))


def calls_made() -> int:
    """Calls of the armed kind so far."""
    count = ctypes.CDLL(None).calls_made
    count.restype = ctypes.c_long
    return int(count())


def preload() -> None:
    """Restart this program with the library, unless it is loaded."""
    if LOADED in os.environ:
        return
    BUILT.parent.mkdir(parents=True, exist_ok=True)
    subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", BUILT, SOURCE, "-ldl"], check=True)
    environment = os.environ | {"LD_PRELOAD": str(BUILT), LOADED: "1"}
    os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], environment)
