# SPDX-License-Identifier: MIT
"""Property tests draw the same examples everywhere and know no deadline, for the first one may compile a kernel.

Each test has its layer, by which `make quick` chooses. One Chromium for all tests of a module.
"""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

import layers
from echostep_app.interruption import ENDS, end_by_signals
from waiting import PATIENCE_S

settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.load_profile("repeatable")

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
COMPILER = Path(__file__).with_name("compile_kernels.py")


def pytest_configure(config: pytest.Config) -> None:
    """Compile the kernels before the workers of a parallel run start, not in each of them; what fails is left to the tests."""
    if config.getoption("numprocesses", None) and not hasattr(config, "workerinput"):
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
        subprocess.run([sys.executable, COMPILER], env=environment, check=False)


@pytest.fixture(autouse=True)
def _computer_of_one_user(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever accounts this computer has: they would put a token into the addresses of pages."""
    monkeypatch.setattr("echostep_app.page.web.users.has_other_users", lambda: False)


@pytest.fixture(autouse=True)
def _signals_as_they_were() -> Iterator[None]:
    """A command that ran in this process leaves its handlers, ignores a signal, or was ended by one: what comes next would, too."""
    handlers = [(number, signal.getsignal(number)) for number in (signal.SIGINT, *ENDS)]
    yield
    end_by_signals()  # no signal has come
    for number, handler in handlers:
        signal.signal(number, handler)


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """No report becomes too old to be sent, nor its position lost by its age, however long other programs have the cores."""
    for name in ("FRESH_S", "SETTLED_S", "CLOSING_S"):
        monkeypatch.setattr(f"echostep_app.team.outbox.{name}", PATIENCE_S)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Marks by rule."""
    for item in items:
        layers.mark(item)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """A test that starts a process and is not marked so fails, in `make quick` and in every other run."""
    with layers.no_process() if layers.is_alone(item) else contextlib.nullcontext():
        return (yield)


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
