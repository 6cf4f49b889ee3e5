# SPDX-License-Identifier: MIT
"""One run of a command with a call that fails, in a process forked from this one, whose kernels are compiled; and what must hold after it.

In: a case, a failure, a folder. Out: an `Outcome`. Owns the process, and its terminal where it has one.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import pty
import select
import shutil
import signal
import sys
import threading
import time
import traceback
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

from echostep.errors import EchostepError
from echostep.recording import open_recording
from echostep_app.cli import main
from reliability.calls.cases import Case
from reliability.calls.shim import Failure, calls_made

PATIENCE_S = 90.0  # after which a run counts as hanging: some fifty times as long as one takes
TOLD = ("are not on the disk", "were not recorded", "it may not be whole")  # of a recording that the disk refused
CRASHED = 70  # exit status of a run with an exception that no code handles [sysexits.h, EX_SOFTWARE]


@dataclass(frozen=True, slots=True)
class Outcome:
    """A run: its exit status, None if it did not end; the calls of the kind; what it printed; unhandled exceptions; digests of its files."""

    status: int | None
    calls: int
    printed: str
    crashes: str
    files: dict[str, str]
    truncated: bool  # a recording is not whole


def run(case: Case, failure: Failure, folder: Path) -> Outcome:
    """Run the command once."""
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "out").mkdir(parents=True)
    terminal = pty.openpty() if case.on_terminal else None
    child = os.fork()
    if not child:
        _be(case, failure, folder, terminal[1] if terminal else None)
    status = _wait(child, terminal[0] if terminal else None)
    for end in terminal or ():
        os.close(end)
    calls, printed, crashes = (_text(folder / name) for name in ("calls", "printed", "crashes"))
    return Outcome(status, int(calls or 0), printed, crashes, *_files(folder / "out"))


def _be(case: Case, failure: Failure, folder: Path, terminal: int | None) -> None:
    """The run itself; the process ends in here."""
    crashes = os.open(folder / "crashes", os.O_WRONLY | os.O_CREAT, 0o600)
    counted = os.open(folder / "calls", os.O_WRONLY | os.O_CREAT, 0o600)
    printed = terminal or os.open(folder / "printed", os.O_WRONLY | os.O_CREAT, 0o600)

    def note(crash: object) -> None:
        error = getattr(crash, "exc_value", crash)
        os.write(crashes, "".join(traceback.format_exception(error)).encode())  # type: ignore[call-overload]

    threading.excepthook = note
    sys.unraisablehook = note
    status = CRASHED
    try:
        for number in (1, 2):
            os.dup2(printed, number)
        streams = (os.fdopen(number, "w", closefd=False) for number in (1, 2))
        sys.stdout, sys.stderr = streams
        with mock.patch.object(sys, "argv", ["echostep", *case.words(folder / "out")]):
            failure.arm(folder / "out")
            main()
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else CRASHED
    except BaseException as error:  # that is what is looked for
        note(error)
    finally:
        made = calls_made()
        Failure(failure.kind, 0).arm(folder)
        os.write(counted, str(made).encode())
        os._exit(status)


def _wait(child: int, terminal: int | None) -> int | None:
    """The exit status; a terminal is read meanwhile. None: the run did not end."""
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        if terminal is not None and select.select([terminal], [], [], 0.0)[0]:
            with contextlib.suppress(OSError):
                os.read(terminal, 1 << 16)
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.002)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return None


def _files(out: Path) -> tuple[dict[str, str], bool]:
    """Digests of the files by name, a recording's by its chunks, under the name without number; whether a recording is not whole."""
    digests, truncated = {}, False
    for path in sorted(out.rglob("*")):
        name, digest, recorded = (
            path.name.partition("-")[0].removesuffix(".mcap"),
            hashlib.sha256(),
            path.suffix == ".mcap",
        )
        if recorded and path.lstat().st_nlink == 1 and path.with_name(f"{name}.mcap").exists():
            continue
        if recorded:
            try:
                recording = open_recording(path)
                for chunk in recording.chunks():
                    digest.update(chunk.data)
                truncated = truncated or recording.own_damage.truncated
            except EchostepError:
                truncated = True
        elif path.is_file():
            digest.update(path.read_bytes())
        digests[name] = digest.hexdigest()
    return digests, truncated


def _text(path: Path) -> str:
    return path.read_text(errors="replace") if path.exists() else ""


def faults_of(case: Case, failure: Failure, outcome: Outcome, sound: Outcome) -> list[str]:
    """What must not be; `sound`: the outcome of the same command when no call fails."""
    faults = []
    if outcome.status is None:
        faults.append("it did not end")
    if outcome.crashes or outcome.status == CRASHED or "Traceback" in outcome.printed:
        faults.append(f"an exception that no code handles: {outcome.crashes.strip().splitlines()[-1:]}")
    if outcome.status not in (None, 0, 1, 2) or (failure.kind == "output" and outcome.status != sound.status):
        faults.append(f"exit status {outcome.status}")
    if outcome.status in (1, 2) and failure.kind != "output" and not case.on_terminal:
        lines = [line for line in outcome.printed.splitlines() if line.startswith("echostep: ")]
        if len(lines) != 1:
            faults.append(f"an error without its one line: {lines}")
    if outcome.status in (0, 1):
        if missing := sound.files.keys() - outcome.files.keys():
            faults.append(f"no {', '.join(sorted(missing))}")
        if outcome.truncated and not (outcome.status and any(words in outcome.printed for words in TOLD)):
            faults.append("a recording is not whole, and not both its words and the exit status say so")
        other = [name for name, digest in sound.files.items() if outcome.files.get(name, digest) != digest]
        if case.repeats and other:
            faults.append(f"other than without a fault: {', '.join(other)}")
    return faults
