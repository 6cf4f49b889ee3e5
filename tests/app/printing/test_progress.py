# SPDX-License-Identifier: MIT
"""Whatever takes longer than two seconds shows how far it is: on a terminal a bar, elsewhere one plain line."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from echostep_app.printing import progress
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
