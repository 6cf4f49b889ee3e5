# SPDX-License-Identifier: MIT
"""The command line in this process: the same entry point, arguments and exit status as a program of its own, without starting Python anew."""

from __future__ import annotations

import errno
import io
import itertools
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping
from contextlib import ExitStack, chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any
from unittest import mock

import pytest

from echostep.ports.chunks import Chunk
from echostep_app.cli import main
from echostep_app.recording.recorder import Recorder
from echostep_app.session.last_place import PlaceKeeper

PROGRAM = [sys.executable, "-m", "echostep"]  # for tests that need a process: signals, kills, pipes


def echostep(
    *arguments: object, cwd: Path | None = None, env: Mapping[str, str] | None = None, ends: int | None = None
) -> subprocess.CompletedProcess[str]:
    """Exit status and output of `echostep ARGUMENTS`, in `cwd` and with `env` instead of the environment where given; it `ends` with that status."""
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True) for _ in range(2))
    command = ["echostep", *map(str, arguments)]
    with ExitStack() as stack:
        stack.enter_context(redirect_stdout(out))
        stack.enter_context(redirect_stderr(err))
        stack.enter_context(mock.patch.object(sys, "argv", command))
        stack.enter_context(mock.patch.object(sys, "stdin", io.StringIO()))
        stack.enter_context(mock.patch.dict(os.environ, env or {}, clear=env is not None))
        if cwd is not None:
            stack.enter_context(chdir(cwd))
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            stack.callback(signal.signal, number, signal.getsignal(number))
        try:
            main()
            status = 0
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else int(end.code is not None)
    assert ends in (None, status), f"exit status {status}: {_text(out)}{_text(err)}"
    return subprocess.CompletedProcess(command, status, _text(out), _text(err))


def sha_of(printed: str) -> str:
    """The digest of the estimates that a run has printed."""
    found = re.search(r"sha256\s+([0-9a-f]{16})", printed)
    assert found, printed
    return found[1]


def fill_disk(monkeypatch: pytest.MonkeyPatch, most_bytes: int) -> None:
    """No recording becomes longer from now on: the disk is full."""
    write = os.write

    def refused(file: int, data: bytes) -> int:
        if Path(f"/proc/self/fd/{file}").readlink().suffix == ".mcap" and os.fstat(file).st_size > most_bytes:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(file, data)

    monkeypatch.setattr(os, "write", refused)


def interrupt_once_called(
    owner: type, method: str, monkeypatch: pytest.MonkeyPatch, suffices: Callable[..., object] = lambda *_: True
) -> None:
    """A run of this process gets SIGINT, as by Ctrl-C, once a method has been called with an object and arguments that suffice."""
    called, interrupted = getattr(owner, method), list[Any]()

    def then_interrupted(instance: Any, *arguments: Any) -> Any:
        done = called(instance, *arguments)
        if not interrupted and suffices(instance, *arguments):
            interrupted.append(instance)
            signal.raise_signal(signal.SIGINT)
        return done

    monkeypatch.setattr(owner, method, then_interrupted)


def interrupt_when(suffices: Callable[[Chunk], object], monkeypatch: pytest.MonkeyPatch) -> None:
    """The same once a recorded chunk suffices."""
    interrupt_once_called(Recorder, "write", monkeypatch, lambda _, chunk: suffices(chunk))


def interrupt_after(estimates: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A live run of this process gets SIGINT, as by Ctrl-C, while it tracks the portion that gives this estimate."""
    noted = itertools.count(1)
    interrupt_once_called(PlaceKeeper, "note", monkeypatch, lambda *_: next(noted) >= estimates)


def _text(stream: io.TextIOWrapper) -> str:
    stream.seek(0)
    return stream.read()
