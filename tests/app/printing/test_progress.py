# SPDX-License-Identifier: MIT
"""Progress of what takes long; kernels are compiled before the first bytes come, counted, told of, and never in a run."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numba
import numpy as np
import pytest
from rich.console import Console

import echostep.jit  # noqa: F401 (it reports what is compiled)
from echostep.jit import kernel, part
from echostep.kernel_cache import on_compiling
from echostep_app import kernel_parts
from echostep_app.cli import tell_of_compiling
from echostep_app.kernel_parts import LATER, PREPARING, TRACKING, Part, compile_parts, compiling_later
from echostep_app.printing import progress
from waiting import PATIENCE_S, ran, until


@pytest.mark.parametrize("terminal", [True, False])
def test_a_line_says_what_is_done(monkeypatch: pytest.MonkeyPatch, terminal: bool) -> None:
    shown = io.StringIO()
    monkeypatch.setattr(progress, "console", Console(file=shown, force_terminal=terminal, width=80))
    monkeypatch.setattr(progress, "SHOWN_AFTER_S", 0.01)
    with progress.progress_line(PREPARING.capitalize()) as show:
        show(1.0)
        assert until(lambda: PREPARING.capitalize() + (": 100%" if terminal else " ...") in shown.getvalue())


class Screen(io.StringIO):
    """Standard error, on a terminal or not."""

    def __init__(self, *, terminal: bool) -> None:
        super().__init__()
        self._terminal = terminal

    def isatty(self) -> bool:
        return self._terminal


@pytest.fixture(autouse=True)
def _told_anew() -> Iterator[None]:
    before = list(on_compiling)
    yield
    on_compiling[:] = before


@pytest.mark.parametrize("terminal", [True, False])
def test_the_first_kernel_is_told_once_on_a_terminal(monkeypatch: pytest.MonkeyPatch, terminal: bool) -> None:
    monkeypatch.setattr(sys, "stderr", screen := Screen(terminal=terminal))
    kept = numba.njit(lambda x: x)
    on_compiling[:] = [tell_of_compiling]
    for _ in range(2):
        kept(1)
    numba.njit(lambda x: x + 1)(1)
    assert screen.getvalue().count("kernels are compiled, once") == terminal


RUN = """
from numba.core import event
from echostep.plan import Pose, load_plan
from echostep_app.session.runs.demo import SIMULATION
from echostep.tracker import Tracker
from echostep_app.kernel_parts import LATER, SEARCH, TRACKING, compile_parts, compiling_later
from echostep.tracker.kernels import beacons, search
from walks import DEMO, walk_chunks

class Compiled(event.Listener):
    def on_start(self, event):
        print("compiled:", event.data["dispatcher"].py_func.__qualname__)
    def on_end(self, event):
        pass

shares = []
compile_parts([*TRACKING, SIMULATION, SEARCH], shares.append)
assert max(shares, default=1.0) == 1.0, max(shares)
assert sum(share < 1.0 for share in shares) >= 0.8 * len(shares), "the numbers of kernels are too small"
chunks = walk_chunks(6.0)
tracker = Tracker(load_plan(DEMO), Pose(1.0, 1.0, 0.0))  # not where the walk begins
tracker.warm_up()
event.register("numba:compile", Compiled())
with compiling_later(LATER) as child:
    assert child is None or child.wait() == 0
estimates = [estimate for chunk in chunks for estimate in tracker.feed(chunk)]
assert len(estimates) > 5
search()
beacons()
"""


def run(folder: Path) -> str:
    """What a run prints of the kernels that it compiles by itself, with a cache in this folder."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "NUMBA_CACHE_DIR": str(folder)}
    done = ran([sys.executable, "-c", RUN], env=environment, timeout=20 * PATIENCE_S)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.process
@pytest.mark.long
def test_a_run_never_waits_for_a_kernel_when_its_first_search_begins(tmp_path: Path) -> None:
    """With an empty cache."""
    assert run(tmp_path) == ""


@pytest.mark.process
def test_what_is_compiled_is_not_compiled_again(monkeypatch: pytest.MonkeyPatch) -> None:
    compile_parts(TRACKING)
    monkeypatch.setattr(kernel_parts, "start_compiling", lambda *_: pytest.fail("it starts a process"))
    compile_parts(TRACKING)
    with compiling_later(TRACKING) as child:
        assert child is None


def test_a_python_that_cannot_be_started_leaves_the_kernels_to_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Part, "is_compiled", False)
    monkeypatch.setattr(sys, "executable", "/nowhere/python")

    def refuse(*_: object, **__: object) -> None:
        raise FileNotFoundError("/nowhere/python")

    monkeypatch.setattr(subprocess, "Popen", refuse)
    compile_parts(LATER)


@part
def _doubled(x: float) -> float:
    return 2.0 * x


@kernel
def _sum_of_doubled(x: np.ndarray) -> float:
    total = _doubled(0)
    for k in range(len(x)):
        total += _doubled(x[k])
    return total


def test_a_part_is_called_by_kernels_alone() -> None:
    assert _sum_of_doubled(np.arange(4.0)) == 12.0
    with pytest.raises(TypeError, match=r"_doubled is a part of kernels: Python cannot call it"):
        _doubled(1.0)
