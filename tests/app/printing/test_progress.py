# SPDX-License-Identifier: MIT
"""Progress: what takes longer than two seconds shows how far it is; the first start says once that it compiles."""

from __future__ import annotations

import io
import sys
from collections.abc import Iterator

import numba
import pytest
from rich.console import Console

import echostep.jit  # noqa: F401 (it reports what is compiled)
from echostep.kernel_cache import on_compiling
from echostep_app.printing import progress
from echostep_app.printing.compiling import COMPILING, counting_compiled, tell_of_compiling
from waiting import PATIENCE_S, until


@pytest.mark.parametrize("terminal", [True, False])
def test_a_line_says_what_is_done(monkeypatch: pytest.MonkeyPatch, terminal: bool) -> None:
    shown = io.StringIO()
    monkeypatch.setattr(progress, "console", Console(file=shown, force_terminal=terminal, width=100))
    monkeypatch.setattr(progress, "SHOWN_AFTER_S", 0.01)
    with progress.progress_line("Preparing"):
        assert until(lambda: "Preparing" in shown.getvalue())


def test_what_is_quick_prints_nothing_elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = io.StringIO()
    monkeypatch.setattr(progress, "console", Console(file=shown, force_terminal=False))
    monkeypatch.setattr(progress, "SHOWN_AFTER_S", PATIENCE_S)
    with progress.progress_line("Preparing"):
        pass
    assert list(progress.with_bar([1, 2], "counting", lambda: 0.5)) == [1, 2]
    assert shown.getvalue() == ""


def test_bars_fill(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = io.StringIO()
    console = Console(file=shown, force_terminal=True, width=100)
    monkeypatch.setattr(progress, "console", console)
    assert list(progress.with_bar(range(3), "tracking walk.mcap", lambda: 0.5)) == [0, 1, 2]
    assert "tracking walk.mcap" in shown.getvalue()
    with progress.listening_bar("Listening for 1 s", 1.0, console):
        assert until(lambda: "0:00:00" in shown.getvalue())
    assert "Listening for 1 s" in shown.getvalue()


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
    tell_of_compiling()
    yield
    on_compiling[:] = before


def compile_two() -> None:
    """Two kernels without a cache; the second calls another one."""
    inner = numba.njit(lambda x: x + 1)
    numba.njit(lambda x: x - 1)(1)
    numba.njit(lambda x: inner(x))(1)  # noqa: PLW0108 (a kernel that calls a kernel)


@pytest.mark.parametrize("terminal", [True, False])
def test_one_line_on_a_terminal(monkeypatch: pytest.MonkeyPatch, terminal: bool) -> None:
    screen = Screen(terminal=terminal)
    monkeypatch.setattr(sys, "stderr", screen)
    compile_two()
    assert screen.getvalue() == (f"{COMPILING}\n" if terminal else "")


def test_progress_that_is_shown_counts_them(monkeypatch: pytest.MonkeyPatch) -> None:
    screen, counts = Screen(terminal=True), list[int]()
    monkeypatch.setattr(sys, "stderr", screen)
    with counting_compiled(counts.append):
        compile_two()
    assert counts == [1, 2]  # the inner one is compiled within
    assert not screen.getvalue()
    numba.njit(lambda x: x)(1)
    assert screen.getvalue() == f"{COMPILING}\n"


def test_a_kernel_that_is_kept_is_not_compiled() -> None:
    kept = numba.njit(lambda x: x)
    kept(1)
    counts = list[int]()
    with counting_compiled(counts.append):
        kept(2)
    assert not counts
