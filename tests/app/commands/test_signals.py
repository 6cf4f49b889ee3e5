# SPDX-License-Identifier: MIT
"""A run ends with whole files, whatever ends it: SIGTERM, SIGHUP, a terminal that is closed; with SIGHUP ignored it goes on."""

from __future__ import annotations

import contextlib
import importlib
import os
import pty
import select
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from numba.core.registry import cpu_target

from command_line import PROGRAM, echostep
from echostep.ports.chunks import Chunk
from echostep.recording import MCAP_MAGIC, open_recording
from echostep_app.interruption import end_by_signals, holding_signals, is_asked, sleep, wait_for
from echostep_app.recording.recorder import Recorder
from operation.crowd import child_cpu_s
from players import playing, python_board
from waiting import PATIENCE_S, until
from walks import DEMO as PLAN

COST_BYTES = 200_000  # of a recording: some five seconds of a board alone


@contextlib.contextmanager
def live_on_a_terminal(
    out: Path, hangup: signal.Handlers
) -> Iterator[tuple[subprocess.Popen[bytes], Callable[[], None]]]:
    """A live run, recording already, whose terminal is read all the time, and a function that closes the terminal; `hangup`: what SIGHUP does."""
    terminal, theirs = pty.openpty()

    def begin() -> None:
        signal.signal(signal.SIGHUP, hangup)
        os.close(os.open(os.ttyname(0), os.O_RDWR))  # makes it the controlling terminal

    with python_board() as port:
        live = subprocess.Popen(
            [*PROGRAM, "live", "--plan", PLAN, "--board", port, "--out", out, "--no-page"],
            stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True, preexec_fn=begin,  # noqa: PLW1509
        )  # fmt: skip
        os.close(theirs)
        with terminal_read(terminal) as close:
            try:
                assert until(lambda: _recorded(out) > 10_000)
                yield live, close
            finally:
                live.kill()
                live.wait()


@contextlib.contextmanager
def terminal_read(terminal: int) -> Iterator[Callable[[], None]]:
    """Reads what the program prints, so that it does not wait for the terminal, until the function is called that closes it."""

    def read() -> None:
        if select.select([terminal], [], [], 0.05)[0]:
            with contextlib.suppress(OSError):  # EIO: the program has ended
                os.read(terminal, 1 << 16)

    with contextlib.ExitStack() as reading:
        reading.callback(os.close, terminal)
        reading.enter_context(playing(read))
        yield reading.close


@pytest.mark.long
@pytest.mark.process
@pytest.mark.parametrize("end", ["SIGINT", "SIGTERM", "closed"])
def test_a_live_run_ends_with_a_whole_recording(tmp_path: Path, end: str) -> None:
    """A terminal that is closed sends SIGHUP."""
    with live_on_a_terminal(tmp_path, signal.SIG_DFL) as (live, close):
        if end == "closed":
            close()
        else:
            live.send_signal(getattr(signal, end))
        live.wait(timeout=PATIENCE_S)
        check_files(tmp_path, live)


@pytest.mark.long
@pytest.mark.process
def test_a_run_that_ignores_sighup_records_on_without_its_terminal(tmp_path: Path) -> None:
    """As nohup asks; a loop that spins on the closed terminal would cost a whole core beside the run's own work. SIGTERM ends it."""
    with live_on_a_terminal(tmp_path, signal.SIG_IGN) as (live, close):
        with_terminal = _cost(tmp_path, live.pid)
        close()
        without = _cost(tmp_path, live.pid)
        assert live.poll() is None
        live.send_signal(signal.SIGTERM)
        live.wait(timeout=PATIENCE_S)
        check_files(tmp_path, live)
    assert without < 1.5 * with_terminal


@pytest.mark.parametrize("command", ["live", "record"])
def test_an_interrupt_that_is_dropped_ends_the_run_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str
) -> None:
    """As by a callback of LLVM while a kernel is loaded."""
    write, written = Recorder.write, list[Chunk]()

    def dropping(recorder: Recorder, chunk: Chunk) -> None:
        written.append(chunk)
        if len(written) == 3:
            with contextlib.suppress(KeyboardInterrupt):
                signal.raise_signal(signal.SIGTERM)
        write(recorder, chunk)

    monkeypatch.setattr(Recorder, "write", dropping)
    more = ["--plan", PLAN, "--headless", "--out", tmp_path] if command == "live" else ["--out", tmp_path / "walk.mcap"]
    with python_board() as port:
        done = echostep(command, "--board", port, "--seconds", PATIENCE_S, *more)
    assert done.returncode == 0, done.stderr
    assert written[-1].t_arrival_ns - written[2].t_arrival_ns < 0.5e9 * PATIENCE_S
    recording = open_recording(tmp_path / "walk.mcap")
    assert list(recording.chunks()) == written
    assert not recording.own_damage.truncated


def test_a_held_signal_ends_a_wait_and_a_second_ends_at_once() -> None:
    """As in a replay at the speed of the walk, over an hour in which the computer slept."""
    end_by_signals()
    with holding_signals():
        assert not is_asked()
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            sleep(PATIENCE_S)
        with pytest.raises(KeyboardInterrupt):
            wait_for(lambda: None, PATIENCE_S)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


def test_a_wait_gives_the_first_value_and_none_after_the_longest_time() -> None:
    values = iter([None, 0, 1])
    assert wait_for(lambda: next(values), PATIENCE_S) == 0
    assert wait_for(lambda: None, 0.0) is None


def check_files(out: Path, live: subprocess.Popen[bytes]) -> None:
    assert live.returncode == 0
    recording = open_recording(out / "walk.mcap")
    assert sum(len(chunk.data) for chunk in recording.chunks()) > 1_000
    assert not recording.own_damage.truncated
    assert (out / "track.csv").exists()


def _recorded(out: Path) -> int:
    """Bytes of the recording so far."""
    path = out / "walk.mcap"
    return path.stat().st_size if path.exists() else 0


def _cost(out: Path, pid: int) -> float:
    """Processor time (s) that the program takes to record a byte, over COST_BYTES."""
    began, cpu_s = _recorded(out), child_cpu_s(pid)
    assert until(lambda: _recorded(out) > began + COST_BYTES)
    return (child_cpu_s(pid) - cpu_s) / (_recorded(out) - began)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_ctrl_c_while_a_kernel_is_compiled_ends_without_a_traceback(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its exception is dropped in a callback of LLVM; numba then misses what was compiled."""
    (tmp_path / "some_kernel.py").write_text("import numba\n\n@numba.njit(cache=True)\ndef same(x):\n    return x\n")
    monkeypatch.syspath_prepend(tmp_path)
    engine = cpu_target.target_context.codegen()._engine._ee

    def interrupted(*_: object) -> None:
        signal.raise_signal(signal.SIGINT)

    def compiling(_: Path) -> list[str]:
        monkeypatch.setattr(engine, "_object_cache_notify", interrupted)
        importlib.import_module("some_kernel").same(1)
        return []

    monkeypatch.setattr("echostep_app.recording.repair.contents.info", compiling)
    (tmp_path / "walk.mcap").write_bytes(MCAP_MAGIC)
    done = echostep("info", tmp_path / "walk.mcap")
    assert done.returncode == 130
    assert not done.stdout
