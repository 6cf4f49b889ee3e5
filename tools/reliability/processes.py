# SPDX-License-Identifier: MIT
"""Processes of Python that a campaign starts.

In: arguments of the interpreter. Out: running processes, which end with the context. Owns nothing.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

END_S = 20.0  # for the end of a process after SIGINT; then it is killed


def start_python(opened: ExitStack, arguments: Sequence[str], errors: Path | None = None) -> subprocess.Popen[str]:
    """A process that is ended with the context; its stderr goes into the file `errors`, if there is one."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    stderr = subprocess.DEVNULL if errors is None else opened.enter_context(errors.open("w"))
    running = subprocess.Popen(
        [sys.executable, *arguments], stdout=subprocess.PIPE, stderr=stderr, text=True, env=environment
    )
    opened.callback(end, running)
    return running


def end(running: subprocess.Popen[str]) -> None:
    """Ask a process to end, and kill it where it does not."""
    if running.poll() is None:
        running.send_signal(signal.SIGINT)
    try:
        running.communicate(timeout=END_S)
    except subprocess.TimeoutExpired:
        running.kill()
        running.communicate()
