# SPDX-License-Identifier: MIT
"""What tests that run the app have in common, imported by the conftest.py of their folders. One Chromium for all tests of a module."""

from __future__ import annotations

import shutil
import signal
from collections.abc import Iterator
from typing import Any

import pytest

from echostep_app.interruption import ENDS, end_by_signals
from waiting import PATIENCE_S

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


@pytest.fixture(autouse=True)
def computer_of_one_user(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever accounts this computer has: they would put a token into the addresses of pages."""
    monkeypatch.setattr("echostep_app.page.web.access.has_other_users", lambda: False)


@pytest.fixture(autouse=True)
def signals_as_they_were() -> Iterator[None]:
    """A command that ran in this process leaves its handlers, ignores a signal, or was ended by one: what comes next would, too."""
    handlers = [(number, signal.getsignal(number)) for number in (signal.SIGINT, *ENDS)]
    yield
    end_by_signals()  # no signal has come
    for number, handler in handlers:
        signal.signal(number, handler)


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """No report becomes too old to be sent, nor its position lost by its age, however long other programs have the cores."""
    for name in ("outbox.FRESH_S", "age.SETTLED_S", "outbox.CLOSING_S"):
        monkeypatch.setattr(f"echostep_app.team.{name}", PATIENCE_S)


@pytest.fixture
def browser(chromium: Any) -> Iterator[Any]:
    """Chromium; the pages that a test has opened are closed at its end."""
    yield chromium
    for context in chromium.contexts:
        context.close()


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    """Chromium, driven by Playwright; skips where one of them is missing."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed: no page is looked at")
    if CHROMIUM is None:
        pytest.skip("no chromium on this machine: no page is looked at")
    with playwright.sync_playwright() as running:
        chromium = running.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield chromium
        chromium.close()
